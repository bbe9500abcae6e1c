"""Module 2 among a thousand closures, and its cliques beside the exact ones of networkx."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import networkx as nx
import numpy as np

from drslamd.slam.clique import IncrementalClique, bits
from drslamd.slam.consistency import PairConsistency
from lab.benchmark import closures, timing
from lab.benchmark.rows import Peer, Row

EPSILON = 0.05
AMONG = 1000
TIMED = 200
"""The last ones of that thousand."""
SHARES = (0.3, 0.5, 0.8)
"""Of closures that are right."""
UNDERSTATED = (1.0, 1.6)
"""How many times larger the noise of closures is than they say."""
SMALL = 200
"""Closures up to which an exact clique can be waited for."""
KIMERA_MS = {0.3: 462.0, 0.5: 1139.0, 0.8: 2636.0}
PAPER_MS = 24.0


def rows(quick: bool) -> Iterator[Row]:
    """All figures of module 2."""
    for good in SHARES:
        pair, times = grown(AMONG, good, seed=0)
        peers = (Peer("paper", PAPER_MS, False), Peer("Kimera-RPGO", KIMERA_MS[good], False))
        work = f"one more closure among {AMONG}, {good:.0%} right"
        yield Row(2, work, times.median, "ms", 0.5, times.p99, peers)
        yield Row(2, f"{work}, 99th percentile", times.p99, "ms", 3.0)
        yield Row(2, f"closures kept of {AMONG}, {good:.0%} right", len(pair.kept()), "closures")
    shares, exact_ms, ours_ms = [], [], []
    for good, understated in product(SHARES, UNDERSTATED):
        for seed in range(1 if quick else 5):
            pair, times = grown(SMALL, good, seed, understated)
            share, exact = beside_exact(pair.graph)
            shares.append(share)
            exact_ms.append(exact)
            ours_ms.append(times.median)
    yield Row(2, f"clique / exact clique, worst of {len(shares)} with {SMALL} closures",
              min(shares), "share", 0.94)  # fmt: skip
    yield Row(2, f"one more closure among {SMALL}", float(np.median(ours_ms)), "ms", None, None,
              (Peer("networkx, clique alone", float(np.median(exact_ms)), True),))  # fmt: skip


def grown(
    count: int, good: float, seed: int, understated: float = 1.0
) -> tuple[PairConsistency, timing.Times]:
    """A pair after so many closures, and the time that the last of them took.

    Every set on the way was checked by `PairConsistency` itself, which raises when it is no clique.
    """
    pair = PairConsistency(closures.NOISE, closures.NOISE, EPSILON)
    taken = []
    for candidate in closures.candidates(count, good, seed, understated):
        began = timing.now_ms()
        pair.add(candidate)
        taken.append(timing.now_ms() - began)
    return pair, timing.times(taken[-TIMED:])


def beside_exact(graph: IncrementalClique) -> tuple[float, float]:
    """Our size as a share of the exact one, and what networkx took for that, ms."""
    whole = nx.Graph()
    whole.add_nodes_from(range(len(graph)))
    whole.add_edges_from((v, w) for v, row in enumerate(graph.adjacency) for w in bits(row))
    began = timing.now_ms()
    _, exact = nx.max_weight_clique(whole, weight=None)
    return graph.clique.bit_count() / exact, timing.now_ms() - began
