"""A pose graph split over robots that each hold their own block and optimise it with `rbcd`.

There is no log and no window: each robot knows its odometry and the closures that it takes part in,
and hears public poses over the air. All else is the daemon's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.optimizer.rbcd import rbcd_optimizer, riemannian_descent
from drslamd.slam.optimizer.rbcd.lifted_neighbours import SharedClosures
from drslamd.slam.optimizer.rbcd.pose_exchange import PoseExchange
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import AnchoredFrame, OwnBlock
from lab.play.turns import CALM, EPOCH, Air, Turns
from lab.recordings.recording import Array

RANK = 5


@dataclass(frozen=True)
class SplitGraph:
    """A pose graph, and whose its poses are.

    Attributes:
        robot, n: (k,) whose pose each one is, and its keyframe; ascending for each robot.
        edges: between poses by their places among the k.
    """

    robot: Array
    n: Array
    edges: ComplexFactors

    def cost(self, lifted: Array) -> float:
        """Of lifted poses (k, 2 r), edge by edge."""
        e, rank = self.edges, lifted.shape[1] // 2
        z, p = lifted[:, :rank], lifted[:, rank:]
        turn = z[e.j] - z[e.i] * e.turn[:, None]
        place = p[e.j] - p[e.i] - z[e.i] * e.shift[:, None]
        squares = [np.sum(np.abs(error) ** 2, axis=1) for error in (turn, place)]
        return float(e.kappa @ squares[0] + e.tau @ squares[1])


@dataclass(frozen=True)
class Descent:
    """How a team came down.

    Attributes:
        costs: of the team after each round, infinite while a robot was not placed.
        lifted: (k, 2 r) where all poses were in the end; None when a robot was never placed.
        at_rest: did it come to an end by itself?
        megabytes: that all sent, with LCM's framing.
    """

    costs: list[float]
    lifted: Array | None
    at_rest: bool
    megabytes: float

    def rounds_to(self, most: float) -> int | None:
        """The first round after which the cost was at most so much, counted from 1."""
        return next((k for k, cost in enumerate(self.costs, 1) if cost <= most), None)

    def worst_rise(self) -> float:
        """Of the cost from one round to the next, relative; 0 when it never rose."""
        placed = np.array([cost for cost in self.costs if np.isfinite(cost)])
        return float(np.max(np.diff(placed) / placed[:-1], initial=0.0))

    def poses(self) -> Array:
        """(k, 3) in the frame of the first pose; everybody was placed."""
        assert self.lifted is not None
        return riemannian_descent.rounded(self.lifted, self.lifted[0])


def descend(graph: SplitGraph, most: int, air: Air = CALM, seed: int = 0) -> Descent:
    """Rounds until the team is at rest, but so many at most."""
    team = split(graph)
    costs: list[float] = []
    turns, goes_on = Turns(team, air, seed), True
    while goes_on and len(costs) < most:
        goes_on = turns.round()
        found = lifted(team, graph)
        costs.append(np.inf if found is None else graph.cost(found))
    return Descent(costs, lifted(team, graph), not goes_on, turns.bytes_sent / 1e6)


class BlockRobot:
    """One of the team; see `turns.Mover`."""

    def __init__(self, own: OwnBlock, frame: AnchoredFrame) -> None:
        self.exchange = PoseExchange(own.chain)
        self.estimate: TeamEstimate | None = None
        self._own, self._frame = own, frame
        self._neighbours = sorted({closures.other for closures in own.shared})
        self._known = -1

    def begin(self, utime: int) -> Job | None:
        news = self.exchange.news
        if self.estimate and self.estimate.converged and news == self._known:
            self.exchange.rest(utime)
            return None
        if not self.exchange.begin(self._neighbours, utime):
            return None
        before = self.estimate.lifted if self.estimate else None
        held = self.exchange.held(self._frame.segment.chain)
        begun = rbcd_optimizer.start(self._own, self._frame, before, held, RANK)
        if begun is None:
            self.exchange.wait(utime)
            return None
        self._known = news
        return partial(rbcd_optimizer.move, begun)

    def on_solution(self, result: TeamEstimate, utime: int) -> list[PublicPoses]:
        self.estimate = result
        assert result.lifted is not None
        return self.exchange.moved(result.frame.chain, result.lifted, utime)

    def hear(self, origin: Chain, message: PublicPoses) -> None:
        self.exchange.hear(origin, message)


def split(graph: SplitGraph) -> dict[int, BlockRobot]:
    """Robots for the parts of a graph, in the frame of the lowest one."""
    robots = np.unique(graph.robot).tolist()
    frame = AnchoredFrame(Segment(robots[0], EPOCH, 0), np.zeros(3))
    return {robot: BlockRobot(_block(graph, robot), frame) for robot in robots}


def lifted(team: Mapping[int, BlockRobot], graph: SplitGraph) -> Array | None:
    """(k, 2 r) where all poses are; None while a robot is not placed."""
    out = np.zeros((len(graph.robot), 2 * RANK), dtype=complex)
    for robot, member in team.items():
        estimate = member.estimate
        if estimate is None or estimate.lifted is None:
            return None
        out[graph.robot == robot] = estimate.lifted.rows
    return out


def _block(graph: SplitGraph, robot: int) -> OwnBlock:
    """What one robot measured."""
    n = graph.n[graph.robot == robot]
    starts, ends = graph.robot[graph.edges.i], graph.robot[graph.edges.j]
    inside = _edges(graph, (starts == robot) & (ends == robot))
    links = BetweenFactors(
        np.searchsorted(n, inside.i), np.searchsorted(n, inside.j), *_measured(inside)
    )
    shared = []
    for other in np.setdiff1d(graph.robot, [robot]).tolist():
        for leaves in (True, False):
            start, end = (robot, other) if leaves else (other, robot)
            edges = _edges(graph, (starts == start) & (ends == end))
            mine, far = (edges.i, edges.j) if leaves else (edges.j, edges.i)
            if len(edges):
                chain = Chain(other, EPOCH)
                shared.append(SharedClosures(chain, leaves, mine, far, *_measured(edges)))
    return OwnBlock(Chain(robot, EPOCH), n, _reckoned(links, len(n)), links, shared)


def _edges(graph: SplitGraph, which: Array) -> BetweenFactors:
    """Some edges, their ends named by the keyframes of their robots."""
    e = graph.edges.chosen(which)
    measured = np.column_stack([e.shift.real, e.shift.imag, np.angle(e.turn)])
    covariance = np.zeros((len(e), 3, 3))
    # the inverse of `ComplexFactors.of`
    for axis, variance in enumerate((1 / e.tau, 1 / e.tau, 2 / e.kappa)):
        covariance[:, axis, axis] = variance
    return BetweenFactors(graph.n[e.i], graph.n[e.j], measured, covariance)


def _measured(edges: BetweenFactors) -> tuple[Array, Array]:
    return edges.measured, edges.covariance


def _reckoned(links: BetweenFactors, count: int) -> Array:
    """(count, 3) by the links between one keyframe and the next."""
    steps = np.zeros((count, 3))
    along = links.j == links.i + 1
    steps[links.j[along]] = links.measured[along]
    poses = np.zeros((count, 3))
    for k in range(1, count):
        poses[k] = se2.compose(poses[k - 1], steps[k])
    return poses
