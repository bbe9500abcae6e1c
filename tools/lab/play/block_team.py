"""A pose graph split over robots that each hold their own block and optimise it with `rbcd`.

No daemon makes such graphs, so there is no log and no window: each robot knows its odometry and the
closures that it takes part in, and hears public poses. All else is the daemon's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.optimizer.rbcd import rbcd_optimizer
from drslamd.slam.optimizer.rbcd.lifted_neighbours import SharedClosures
from drslamd.slam.optimizer.rbcd.pose_exchange import PoseExchange
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import Frame, OwnBlock
from lab.benchmark.graphs import Graph
from lab.play.turns import EPOCH
from lab.recordings.recording import Array

RANK = 5


class BlockRobot:
    """One of them; see `turns.Mover`."""

    def __init__(self, own: OwnBlock, frame: Frame) -> None:
        self.exchange = PoseExchange(own.chain)
        self.estimate: TeamEstimate | None = None
        self._own, self._frame = own, frame
        self._neighbours = sorted({closures.other for closures in own.shared})
        self._known = -1

    def begin(self, utime: int) -> Job | None:
        news = self.exchange.news
        if self.estimate and self.estimate.converged and news == self._known:
            self.exchange.rest()
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

    def on_solution(self, result: TeamEstimate) -> list[PublicPoses]:
        self.estimate = result
        assert result.lifted is not None
        return self.exchange.moved(result.frame.chain, result.lifted)

    def hear(self, origin: Chain, message: PublicPoses) -> None:
        self.exchange.hear(origin, message)


def split(graph: Graph) -> dict[int, BlockRobot]:
    """Robots for the parts of a graph, in the frame of the lowest one."""
    frame = Frame(Segment(int(graph.robot.min()), EPOCH, 0), np.zeros(3))
    robots = np.unique(graph.robot).tolist()
    return {robot: BlockRobot(_block(graph, robot), frame) for robot in robots}


def _block(graph: Graph, robot: int) -> OwnBlock:
    """What one robot measured; keyframe k is its k-th pose."""
    read = graph.read
    i, j = read.i, read.j
    links = _edges(graph, (graph.robot[i] == robot) & (graph.robot[j] == robot))
    shared = []
    for other in np.unique(graph.robot).tolist():
        for leaves in (True, False) if other != robot else ():
            start, end = (robot, other) if leaves else (other, robot)
            e = _edges(graph, (graph.robot[i] == start) & (graph.robot[j] == end))
            ends = (e.i, e.j) if leaves else (e.j, e.i)
            if len(e):
                chain = Chain(other, EPOCH)
                shared.append(SharedClosures(chain, leaves, *ends, e.measured, e.covariance))
    count = int((graph.robot == robot).sum())
    return OwnBlock(Chain(robot, EPOCH), np.arange(count), _reckoned(links, count), links, shared)


def _edges(graph: Graph, which: Array) -> BetweenFactors:
    """Some edges, their ends named by the keyframes of their robots."""
    covariance = np.zeros((int(which.sum()), 3, 3))
    # the inverse of `ComplexFactors.of`
    for axis, weight in enumerate((graph.tau, graph.tau, graph.kappa)):
        covariance[:, axis, axis] = (1, 1, 2)[axis] / weight[which]
    read = graph.read
    ends = graph.n[read.i[which]], graph.n[read.j[which]]
    return BetweenFactors(*ends, read.measured[which], covariance)


def _reckoned(links: BetweenFactors, count: int) -> Array:
    """(count, 3) by the links between one keyframe and the next."""
    steps = np.zeros((count, 3))
    along = links.j == links.i + 1
    steps[links.j[along]] = links.measured[along]
    poses = np.zeros((count, 3))
    for k in range(1, count):
        poses[k] = se2.compose(poses[k - 1], steps[k])
    return poses


def lifted(team: Mapping[int, BlockRobot], graph: Graph) -> Array | None:
    """(k, 2 r) all poses by their places in the graph; None while a robot is not placed."""
    out = np.zeros((graph.count, 2 * RANK), dtype=complex)
    for robot, member in team.items():
        estimate = member.estimate
        if estimate is None or estimate.lifted is None:
            return None
        out[graph.place[graph.robot == robot]] = estimate.lifted.rows
    return out
