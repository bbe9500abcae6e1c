"""Module 2 among a thousand closures, and its cliques beside exact ones of networkx and igraph."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from itertools import product

import networkx as nx
import numpy as np

from drslamd.slam.consistency.incremental_clique import IncrementalClique, bits
from drslamd.slam.consistency.pcm import PairConsistency
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
ByName = dict[str, list[float]]
Finder = Callable[[int, list[tuple[int, int]]], Callable[[], int]]
"""Makes of the nodes' number and the edges a program that finds the size of the largest clique."""
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
    finders, shares, ours_ms = exact_finders(), [], []
    exact_ms: dict[str, list[float]] = {name: [] for name in finders}
    for good, understated in product(SHARES, UNDERSTATED):
        for seed in range(1 if quick else 5):
            pair, times = grown(SMALL, good, seed, understated)
            share, taken = beside_exact(pair.graph, finders)
            shares.append(share)
            ours_ms.append(times.median)
            for name, ms in taken.items():
                exact_ms[name].append(ms)
    work = f"clique / exact clique, worst of {len(shares)} with {SMALL} closures"
    yield Row(2, work, min(shares), "share", 0.94)
    work = f"one more closure among {SMALL}"
    yield _beside(work, np.median, ours_ms, exact_ms)
    yield _beside(f"{work}, slowest of {len(shares)} graphs", np.max, ours_ms, exact_ms)


def _beside(
    work: str, figure: Callable[[list[float]], float], ours: list[float], exact: ByName
) -> Row:
    peers = (Peer(f"{name}, clique alone", float(figure(ms)), True) for name, ms in exact.items())
    return Row(2, work, float(figure(ours)), "ms", None, None, tuple(peers))


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


def beside_exact(
    graph: IncrementalClique, finders: dict[str, Finder]
) -> tuple[float, dict[str, float]]:
    """Our size as a share of the exact one, and what each peer took for that, ms."""
    edges = [(v, w) for v, row in enumerate(graph.adjacency) for w in bits(row) if v < w]
    taken, sizes = {}, set()
    for name, finder in finders.items():
        find = finder(len(graph), edges)
        began = timing.now_ms()
        sizes.add(find())
        taken[name] = timing.now_ms() - began
    if len(sizes) > 1:
        raise AssertionError(f"peers that are exact found cliques of {sorted(sizes)}")
    return graph.clique.bit_count() / sizes.pop(), taken


def exact_finders() -> dict[str, Finder]:
    """Those that are installed; igraph may be missing, and that is said."""
    if importlib.util.find_spec("igraph") is None:
        print("igraph is not installed, so module 2 stands beside networkx alone", file=sys.stderr)
        return {"networkx": _networkx}
    return {"networkx": _networkx, "igraph": _igraph}


def _networkx(count: int, edges: list[tuple[int, int]]) -> Callable[[], int]:
    whole = nx.Graph(edges)
    whole.add_nodes_from(range(count))
    return lambda: int(nx.max_weight_clique(whole, weight=None)[1])


def _igraph(count: int, edges: list[tuple[int, int]]) -> Callable[[], int]:
    import igraph

    whole = igraph.Graph(count, edges)
    return lambda: int(whole.clique_number())
