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

from drslamd.conventions import Chain
from drslamd.slam import se2
from drslamd.slam.graph.estimate import Lifted, TeamEstimate, Trajectory
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.factors import between_factors, chain_links
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.optimizer.rbcd import riemannian_descent
from drslamd.slam.se2 import Array

SETTLED = 1e-7
"""Relative gain of a round below which a block waits for news."""
OFF_SPHERE = 1e-2
"""A rotation whose length is wrong by more than rounding to 32 bits is not one."""


@dataclass(frozen=True)
class LiftedNeighbours:
    """The lifted poses that this robot's closures lead to.

    Attributes:
        chains, n: (m,) whose keyframes they are; rows: (m, 2 r).
        leaving: edges from our poses (i) to rows (j); arriving: from rows (i) to our poses (j).
        carriers: (k,) our keyframes that carry closures, to whomever.
    """

    chains: tuple[Chain, ...]
    n: Array
    rows: Array
    leaving: BetweenFactors
    arriving: BetweenFactors
    carriers: Array


@dataclass(frozen=True)
class Start:
    """Our block before a round: keyframes n (k,), lifted (k, 2 r), with the odometry between."""

    n: Array
    lifted: Array
    own: BetweenFactors


class RbcdOptimizer:
    """One round of block coordinate descent at a time."""

    def __init__(self, own: Chain, rank: int) -> None:
        """
        Args:
            rank: of the relaxation.
        """
        self._own, self._rank = own, rank

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job | None:
        """See `Optimizer.job`."""
        data = graph.view.chains[self._own.robot]
        used = _in_group(data, group)
        fitting = {k: p for k, p in sorted(public.items()) if p.rank == self._rank}
        around = lifted_neighbours(graph, data, used, fitting, self._rank)
        anchor = _anchor(fitting, group)
        lifted = self._start(data, used, group, previous, around)
        if lifted is None or (anchor is None and group.frame.chain != self._own):
            return None
        start = Start(data.keyframes.n[used], lifted, _links(data, used))
        return partial(_round, start, around, anchor, group, self._own)

    def _start(
        self,
        data: ChainView,
        used: Array,
        group: Group,
        previous: TeamEstimate | None,
        around: LiftedNeighbours,
    ) -> Array | None:
        """(k, 2 r) our keyframes: as they were, else by odometry from the nearest that is known."""
        n, poses = data.keyframes.n[used], data.keyframes.poses[used]
        known = previous.lifted if previous and previous.frame == group.frame else None
        if known is not None and np.isin(n, known.n).any():
            at = np.flatnonzero(np.isin(n, known.n))
            rows = known.rows[np.searchsorted(known.n, n[at])]
        elif group.frame.chain == self._own:
            at, rows = np.zeros(1, dtype=np.int64), riemannian_descent.lift(poses[:1], self._rank)
        else:
            out, back = around.leaving, around.arriving
            at = np.concatenate([out.i, back.j])
            rows = np.concatenate(
                [
                    riemannian_descent.moved(around.rows[out.j], se2.inverse(out.measured)),
                    riemannian_descent.moved(around.rows[back.i], back.measured),
                ]
            )
            if not len(at):
                return None
            order = np.argsort(at, kind="stable")
            at, rows = at[order], rows[order]
        nearest = np.searchsorted((n[at][1:] + n[at][:-1]) / 2, n)
        return riemannian_descent.moved(rows[nearest], se2.between(poses[at][nearest], poses))


def _in_group(data: ChainView, group: Group) -> Array:
    """Which of our rows lie in segments of the group."""
    segments = [s.segment for s in group.members if s.chain == data.chain]
    return np.flatnonzero(np.isin(data.keyframes.segment, segments))


def _links(data: ChainView, used: Array) -> BetweenFactors:
    """Our odometry between the rows `used`, numbered as they are."""
    links = chain_links(data, calibrated=False)
    place = np.full(len(data.keyframes), -1)
    place[used] = np.arange(len(used))
    i, j = place[links.i], place[links.j]
    inside = (i >= 0) & (j >= 0)
    return BetweenFactors(i[inside], j[inside], links.measured[inside], links.covariance[inside])


def _anchor(public: Mapping[int, PublicPoses], group: Group) -> Array | None:
    """The origin of the frame as the nearest to its owner has it."""
    nearest = sorted(public, key=lambda robot: (robot != group.frame.robot, robot))
    anchors = (public[robot].values[0] for robot in nearest)
    return next((a for a in anchors if _on_sphere(a[None]).all()), None)


def _on_sphere(rows: Array) -> Array:
    """Which of the rows (k, 2 r) have a rotation."""
    length = np.linalg.norm(rows[:, : rows.shape[1] // 2], axis=1)
    return np.asarray(np.abs(length - 1) < OFF_SPHERE)


def lifted_neighbours(
    graph: PoseGraph,
    data: ChainView,
    used: Array,
    public: Mapping[int, PublicPoses],
    rank: int,
) -> LiftedNeighbours:
    """Sort the kept closures of our own pairs by whether the other end is known.

    Args:
        used: (k,) rows of our chain that the block consists of.
        public: poses of that rank.
    """
    own = data.chain
    leaving: list[tuple[int, int, tuple[float, ...], Array]] = []
    arriving: list[tuple[int, int, tuple[float, ...], Array]] = []
    chains: list[Chain] = []
    keyframes: list[int] = []
    rows: list[Array] = []
    carriers: set[int] = set()
    number = {int(n): k for k, n in enumerate(data.keyframes.n[used])}
    for pair in graph.view.pairs:
        if own not in (pair.a, pair.b):
            continue
        outward = pair.a == own
        other = pair.b if outward else pair.a
        table = public[other.robot].table() if other.robot in public else {}
        for closure in pair.kept_closures():
            mine, far = (closure.a_n, closure.b_n) if outward else (closure.b_n, closure.a_n)
            if mine not in number:
                continue
            carriers.add(mine)
            if far not in table or not _on_sphere(table[far][None])[0]:
                continue
            edge = (closure.a_T_b, se2.unpacked(closure.covariance))
            if outward:
                leaving.append((number[mine], len(rows), *edge))
            else:
                arriving.append((len(rows), number[mine], *edge))
            chains.append(other)
            keyframes.append(far)
            rows.append(table[far])
    return LiftedNeighbours(
        tuple(chains),
        np.array(keyframes),
        np.array(rows, dtype=complex).reshape(-1, 2 * rank),
        between_factors(leaving),
        between_factors(arriving),
        np.array(sorted(carriers)),
    )


def _round(
    start: Start, around: LiftedNeighbours, anchor: Array | None, group: Group, chain: Chain
) -> TeamEstimate:
    """One round on our block, and what it means in the frame of the team."""
    edges = [ComplexFactors.of(e) for e in (start.own, around.leaving, around.arriving)]
    block = riemannian_descent.block(edges[0], edges[1], edges[2], around.rows, len(start.n))
    before = riemannian_descent.stacked(start.lifted)
    after = riemannian_descent.descend(block, before)
    gain, cost = block.cost(before) - block.cost(after), block.cost(after)
    lifted = riemannian_descent.rows(after)
    ours = group.frame.chain == chain
    origin = lifted[0] if anchor is None or ours else anchor
    trajectories = {
        chain.robot: Trajectory(chain, start.n, riemannian_descent.rounded(lifted, origin))
    }
    for other in dict.fromkeys(around.chains):
        mine = [k for k, c in enumerate(around.chains) if c == other]
        keyframes, first = np.unique(around.n[mine], return_index=True)
        poses = riemannian_descent.rounded(around.rows[mine][first], origin)
        trajectories[other.robot] = Trajectory(other, keyframes, poses)
    last = len(start.n) - 1
    return TeamEstimate(
        group.frame,
        trajectories,
        joint=riemannian_descent.conditional_covariance(block, last, 0 if ours else None),
        cost=cost,
        iterations=riemannian_descent.STEPS_PER_ROUND,
        converged=gain <= SETTLED * (1 + cost),
        lifted=Lifted(start.n, lifted, origin, around.carriers),
    )
