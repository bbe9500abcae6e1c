"""`optimizer.algorithm = "rbcd"`: the paper's module 3, each robot for its own block.

A robot holds its own trajectory, the closures that it takes part in and the public poses of its
neighbours. Who is not yet placed waits until a neighbour is; the group's lowest robot is always
placed, so the frame spreads from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from drslamd.config import Config
from drslamd.conventions import Chain
from drslamd.slam import rbcd, se2
from drslamd.slam.estimate import Lifted, TeamEstimate, Trajectory
from drslamd.slam.graph_edges import chain_links, pose_edges
from drslamd.slam.items import PublicPoses
from drslamd.slam.optimizer import Job
from drslamd.slam.pose_graph import ChainItems, TeamGraph
from drslamd.slam.problem import PoseEdges
from drslamd.slam.se2 import Array
from drslamd.slam.team_frame import Group


@dataclass(frozen=True)
class Neighbours:
    """The lifted poses that this robot's closures lead to.

    Attributes:
        chains, n: (m,) whose keyframes they are; rows: (m, 2 r).
        leaving: edges from our poses (i) to rows (j); arriving: from rows (i) to our poses (j).
        carriers: (k,) our keyframes that carry closures, to whomever.
    """

    chains: tuple[Chain, ...]
    n: Array
    rows: Array
    leaving: PoseEdges
    arriving: PoseEdges
    carriers: Array


class Rbcd:
    """One round of block coordinate descent at a time."""

    def __init__(self, config: Config, own: Chain) -> None:
        self._rank = config.optimizer.rank
        self._own = own

    def job(
        self,
        graph: TeamGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job | None:
        """See `Optimizer.job`."""
        items = graph.chains[self._own.robot]
        around = neighbours(graph, items, public, self._rank)
        start = self._start(items, group, previous, around)
        anchor = next((p.values[0] for p in public.values()), None)
        if start is None or (anchor is None and group.frame.chain != self._own):
            return None
        own = chain_links(items, calibrated=False)
        return partial(_round, own, around, items.n, start, anchor, group, self._own)

    def _start(
        self,
        items: ChainItems,
        group: Group,
        previous: TeamEstimate | None,
        around: Neighbours,
    ) -> Array | None:
        """(k, 2 r) our keyframes: as they were, else by odometry from the nearest that is known."""
        n = items.n
        known = previous.lifted if previous and previous.frame == group.frame else None
        if known is not None and np.isin(n, known.n).any():
            at = np.flatnonzero(np.isin(n, known.n))
            rows = known.rows[np.searchsorted(known.n, n[at])]
        elif group.frame.chain == self._own:
            at, rows = np.zeros(1, dtype=np.int64), rbcd.lift(items.poses[:1], self._rank)
        else:
            out, back = around.leaving, around.arriving
            at = np.concatenate([out.i, back.j])
            rows = np.concatenate([
                rbcd.moved(around.rows[out.j], se2.inverse(out.measured)),
                rbcd.moved(around.rows[back.i], back.measured),
            ])  # fmt: skip
            if not len(at):
                return None
        nearest = np.abs(n[:, None] - n[at][None, :]).argmin(axis=1)
        return rbcd.moved(rows[nearest], se2.between(items.poses[at][nearest], items.poses))


def neighbours(
    graph: TeamGraph, items: ChainItems, public: Mapping[int, PublicPoses], rank: int
) -> Neighbours:
    """Sort the kept closures of our own pairs by whether the other end is known."""
    own = items.chain
    leaving: list[tuple[int, int, tuple[float, ...], Array]] = []
    arriving: list[tuple[int, int, tuple[float, ...], Array]] = []
    chains: list[Chain] = []
    keyframes: list[int] = []
    rows: list[Array] = []
    carriers: set[int] = set()
    for pair in graph.usable():
        if own not in (pair.a, pair.b):
            continue
        other = pair.b if pair.a == own else pair.a
        table = public[other.robot].table() if other.robot in public else {}
        for closure in pair.kept():
            outward = pair.a == own
            mine, far = (closure.a_n, closure.b_n) if outward else (closure.b_n, closure.a_n)
            at, there = items.find(np.array([float(mine)]))
            if not there[0]:
                continue
            carriers.add(mine)
            if far not in table:
                continue
            edge = (closure.a_T_b, se2.unpacked(closure.covariance))
            if outward:
                leaving.append((int(at[0]), len(rows), *edge))
            else:
                arriving.append((len(rows), int(at[0]), *edge))
            chains.append(other)
            keyframes.append(far)
            rows.append(table[far])
    return Neighbours(
        tuple(chains), np.array(keyframes), np.array(rows, dtype=complex).reshape(-1, 2 * rank),
        pose_edges(leaving), pose_edges(arriving), np.array(sorted(carriers)),
    )  # fmt: skip


def _round(
    own: PoseEdges,
    around: Neighbours,
    n: Array,
    start: Array,
    anchor: Array | None,
    group: Group,
    chain: Chain,
) -> TeamEstimate:
    """One round on our block, and what it means in the frame of the team."""
    edges = [rbcd.ComplexEdges.of(e) for e in (own, around.leaving, around.arriving)]
    block = rbcd.block(edges[0], edges[1], edges[2], around.rows, len(n))
    lifted = rbcd.rows(rbcd.descend(block, rbcd.stacked(start)))
    ours = group.frame.chain == chain
    origin = lifted[0] if anchor is None or ours else anchor
    trajectories = {chain.robot: Trajectory(chain, n, rbcd.rounded(lifted, origin))}
    for other in dict.fromkeys(around.chains):
        mine = [k for k, c in enumerate(around.chains) if c == other]
        keyframes, first = np.unique(around.n[mine], return_index=True)
        poses = rbcd.rounded(around.rows[mine][first], origin)
        trajectories[other.robot] = Trajectory(other, keyframes, poses)
    return TeamEstimate(
        group.frame,
        trajectories,
        {chain.robot: rbcd.conditional_covariance(block, len(n) - 1, 0 if ours else None)},
        cost=block.cost(rbcd.stacked(lifted)),
        iterations=rbcd.STEPS_PER_ROUND,
        lifted=Lifted(n, lifted, origin, around.carriers),
    )
