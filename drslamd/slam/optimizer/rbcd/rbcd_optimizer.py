"""`optimizer.algorithm = "rbcd"`: the paper's module 3, each robot for its own block.

A robot holds its own trajectory, the closures that it takes part in and the public poses of its
neighbours. Who is not yet placed waits until a neighbour is; the group's lowest robot is always
placed, so the frame spreads from it. When a robot may move says `pose_exchange`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import Lifted, TeamEstimate, Trajectory
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.optimizer.closures.claimed import WINDOW_N
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.factors import chain_links
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.optimizer.rbcd import riemannian_descent
from drslamd.slam.optimizer.rbcd.lifted_neighbours import (
    LiftedNeighbours,
    SharedClosures,
    lifted_neighbours,
    on_sphere,
    shared_closures,
)
from drslamd.slam.optimizer.rbcd.whole_claim import NOTHING, WholeClaim, whole_claim
from drslamd.slam.se2 import Array, Index

SETTLED = 1e-9
"""Relative gain of a move below which a block waits for news: what the whole team could still gain
is some hundred times as much."""
MOST_LEAN = 0.9
"""How far past its minimum a block goes at most: where the team is stiff, halves what is missing
in seven rounds; where it is not, still in fifteen."""
HALF_LEAN = 4
"""Moves until a block goes half of that past its minimum."""
AFTER_NEWS = 2
"""So many count when something new was measured: what goes far past what is only just measured
swings about it, and news come every second."""


@dataclass(frozen=True)
class OwnBlock:
    """What is measured of our own poses.

    Attributes:
        n: (k,) keyframes; odometry: (k, 3) where it has them; links: between them, by their places.
        shared: closures to other robots.
    """

    chain: Chain
    n: Index
    odometry: Array
    links: BetweenFactors
    shared: list[SharedClosures]


@dataclass(frozen=True)
class AnchoredFrame:
    """The frame of the team: its segment, and where (3,) in it the pose is that anchors it."""

    segment: Segment
    origin: Array


@dataclass(frozen=True)
class Start:
    """Our block before a move.

    Attributes:
        lifted: (k, 2 r).
        anchor: (2 r,) of the frame; None where the frame is ours.
        quiet: how many moves were made on the very same measurements.
        claim: of our last pose and the last public ones of neighbours.
    """

    own: OwnBlock
    around: LiftedNeighbours
    frame: AnchoredFrame
    lifted: Array
    anchor: Array | None
    quiet: int
    claim: Callable[[], WholeClaim] = lambda: NOTHING


class RbcdOptimizer:
    """One move of block coordinate descent at a time."""

    def __init__(self, own: Chain, rank: int, window_n: int = WINDOW_N) -> None:
        """
        Args:
            rank: of the relaxation.
            window_n: see `WholeGraph.of`.
        """
        self._own, self._rank, self._window_n = own, rank, window_n

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
        keyframes = data.keyframes.chosen(used)
        shared = shared_closures(graph, self._own)
        own = OwnBlock(self._own, keyframes.n, keyframes.poses, _links(data, used), shared)
        frame = AnchoredFrame(group.frame, graph.view.segment(group.frame).poses[0])
        before = previous.lifted if previous and previous.frame == group.frame else None
        begun = start(own, frame, before, public, self._rank)
        if begun is None:
            return None
        claim = partial(
            whole_claim, graph.frozen(), group, previous, self._window_n, _newest(begun)
        )
        return partial(move, replace(begun, claim=claim))


def _newest(begun: Start) -> dict[int, int]:
    """Our last keyframe and the last public ones of neighbours, in the order of `_trajectories`."""
    out = {begun.own.chain.robot: int(begun.own.n[-1])}
    for chain, n in zip(begun.around.chains, begun.around.n.tolist(), strict=True):
        out[chain.robot] = max(out.get(chain.robot, n), n)
    return out


def _is_of(before: Lifted, begun: Start) -> bool:
    """Are keyframes and closures of ours those of our last move?"""
    return np.array_equal(before.n, begun.own.n) and before.ends == len(begun.around.n)


def start(
    own: OwnBlock,
    frame: AnchoredFrame,
    before: Lifted | None,
    public: Mapping[int, PublicPoses],
    rank: int,
) -> Start | None:
    """Our block where it is before a move; None while neither it nor the frame is known.

    Args:
        before: after our last move in this frame.
        public: poses of others in this frame, by robot.
        rank: of the relaxation.
    """
    fitting = {
        robot: poses.of_rank(rank) for robot, poses in sorted(public.items()) if poses.rank <= rank
    }
    around = lifted_neighbours(own.shared, own.n, fitting, rank)
    owns = frame.segment.chain == own.chain
    anchor = None if owns else _anchor(fitting, frame.segment.robot)
    lifted = placed_rows(own.n, own.odometry, before, around, rank if owns else None)
    if lifted is None or (anchor is None and not owns):
        return None
    begun = Start(own, around, frame, lifted, anchor, before.quiet + 1 if before else 0)
    if before is not None and _is_of(before, begun):
        return begun
    return replace(begun, quiet=min(begun.quiet, AFTER_NEWS))


def placed_rows(
    n: Array, odometry: Array, before: Lifted | None, around: LiftedNeighbours, rank: int | None
) -> Array | None:
    """(k, 2 r) our keyframes: as they were, else by odometry from the nearest that is known, else
    as closures to neighbours tell. None: no neighbour is known.

    Args:
        n, odometry: (k,) and (k, 3) our keyframes.
        before: after our last move in this frame.
        rank: of the relaxation, where the frame is ours; then the first keyframe is where odometry
            has it.
    """
    known = np.isin(n, before.n) if before else np.zeros(len(n), dtype=bool)
    if before is not None and known.any():
        at = np.flatnonzero(known)
        rows = before.rows[np.searchsorted(before.n, n[at])]
    elif rank is not None:
        at, rows = np.zeros(1, dtype=np.int64), riemannian_descent.lift(odometry[:1], rank)
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
    return riemannian_descent.moved(rows[nearest], se2.between(odometry[at][nearest], odometry))


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


def _anchor(public: Mapping[int, PublicPoses], owner: int) -> Array | None:
    """The pose that anchors the frame as the nearest to its owner has it."""
    nearest = sorted(public, key=lambda robot: (robot != owner, robot))
    anchors = (public[robot].values[0] for robot in nearest)
    return next((a for a in anchors if on_sphere(a[None]).all()), None)


def move(begun: Start) -> TeamEstimate:
    """Our block moves, if that is worth it; what that means in the frame of the team."""
    own, around, frame = begun.own, begun.around, begun.frame
    edges = [ComplexFactors.of(e) for e in (own.links, around.leaving, around.arriving)]
    block = riemannian_descent.block(edges[0], edges[1], edges[2], around.rows, len(own.n))
    before = riemannian_descent.stacked(begun.lifted)
    lowest, steps = riemannian_descent.descend(block, before)
    cost = block.cost(before)
    gain = (cost - block.cost(lowest)) / (1 + cost)
    after = before
    if gain > SETTLED:
        lean = MOST_LEAN * begun.quiet / (begun.quiet + HALF_LEAN)
        after = riemannian_descent.leaned(block, before, lowest, lean)
    lifted = riemannian_descent.rows(after)
    anchor = lifted[0] if begun.anchor is None else begun.anchor
    claim = begun.claim()
    return TeamEstimate(
        frame.segment,
        _trajectories(begun, lifted, anchor),
        joint=claim.joint,
        cost=block.cost(after),
        iterations=steps,
        converged=gain <= SETTLED,
        lifted=Lifted(
            n=own.n,
            rows=lifted,
            anchor=anchor,
            origin=frame.origin,
            carriers=around.carriers,
            weights=around.weights,
            ends=len(around.n),
            quiet=begun.quiet,
            gain=gain,
            claimed_of=claim.of,
        ),
    )


def _trajectories(begun: Start, lifted: Array, anchor: Array) -> dict[int, Trajectory]:
    """Ours, and what is known of our neighbours'."""
    own, around, origin = begun.own, begun.around, begun.frame.origin
    out = {own.chain.robot: Trajectory(own.chain, own.n, _in_frame(lifted, anchor, origin))}
    for other in dict.fromkeys(around.chains):
        mine = [k for k, c in enumerate(around.chains) if c == other]
        keyframes, first = np.unique(around.n[mine], return_index=True)
        poses = _in_frame(around.rows[mine][first], anchor, origin)
        out[other.robot] = Trajectory(other, keyframes, poses)
    return out


def _in_frame(lifted: Array, anchor: Array, origin: Array) -> Array:
    """(k, 3) in the frame of the team, where the anchor is at `origin`."""
    return se2.compose(origin[None], riemannian_descent.rounded(lifted, anchor))


def at_anchor(estimate: TeamEstimate, owner: PublicPoses) -> TeamEstimate:
    """The same estimate where the owner of the frame has moved the pose that anchors it."""
    lifted = estimate.lifted
    if lifted is None or owner.rank > len(lifted.anchor) // 2:
        return estimate
    anchor = owner.of_rank(len(lifted.anchor) // 2).values[0]
    if np.array_equal(lifted.anchor, anchor) or not on_sphere(anchor[None])[0]:
        return estimate
    was = _in_frame(lifted.anchor[None], anchor, lifted.origin)[0]
    turn = se2.compose(was, se2.inverse(lifted.origin))
    trajectories = {
        robot: replace(t, poses=se2.compose(turn[None], t.poses))
        for robot, t in estimate.trajectories.items()
    }
    return replace(estimate, trajectories=trajectories, lifted=replace(lifted, anchor=anchor))
