"""Module 3 over messages: robots that know only their own edges, rounds, bytes and CPU.

Every robot starts with its own odometry and the closures that it measured. In a round each may say
whatever follows from what it held when the round began; then everything that was said (and not
lost) arrives. What is said are the daemon's own messages: graph entries of a sealed log, in LCM's
datagrams. In its first round a robot says its log once; in every later one again what a peer may
lack, because whoever lost a datagram cannot have said so in time.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drslamd.conventions import SECOND_US, Chain
from drslamd.events import Datagram
from drslamd.gossip import lc02
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team
from drslamd.slam.graph.measurements import GraphEntry, RelativePoses
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from lab.benchmark.graphs import Graph
from lab.benchmark.relative_graph import SolvedPoses, solve

KEY = bytes(32)
EDGES_PER_ENTRY = 27
"""As many as one datagram takes."""
OWN_AGAIN, OTHERS_AGAIN = 7, 3
"""How often a robot says an entry in every round after the first: its own, and those of others
that it holds. At 30 % loss an entry then fails to reach a third robot by the end of the second
round with a probability of 0.3^8 (1 - 0.7 (1 - 0.3^3)): one team of three in 400 needs another."""


@dataclass(frozen=True)
class Outcome:
    """How it went.

    Attributes:
        rounds: until every robot's gap was reached; None when it was not.
        gap: the largest of all robots at the end.
        megabytes: UDP payload that all robots sent, until then.
        cpu_s: of all robots, summed.
    """

    rounds: int | None
    gap: float
    megabytes: float
    cpu_s: float


class GraphRobot:
    """One robot: its log, what it heard, and what it makes of it."""

    def __init__(self, number: int, graph: Graph) -> None:
        self.own = Chain(number, 1)
        self.team = Team(Seal(KEY, number, 1, {}))
        self.graph = PoseGraph()
        self.solved: SolvedPoses | None = None
        self.bytes_sent = 0
        self._held: dict[bytes, bool] = {}
        """Datagrams of log entries: are they our own?"""
        self._news = True
        for seq, relative in enumerate(_own_edges(number, graph)):
            entry, sealed = self.team.append(GraphEntry(seq, relative=(relative,)), 0)
            self.graph.insert(self.own, entry)
            send = self.team.send_sealed(number, sealed)
            self._held[lc02.encode(seq, send.channel, send.payload)] = True

    def say(self, number: int) -> Iterator[bytes]:
        """Our datagrams of a round."""
        for datagram, ours in self._held.items():
            for _ in range(OWN_AGAIN if number and ours else OTHERS_AGAIN if number else int(ours)):
                self.bytes_sent += len(datagram)
                yield datagram

    def hear(self, datagram: bytes, number: int) -> None:
        received = self.team.receive(Datagram(number * SECOND_US, datagram))
        if received is not None and isinstance(received.message, GraphEntry):
            self.graph.insert(received.origin, received.message)
            self._held[datagram] = False
            self._news = True

    def solve(self) -> None:
        if self._news:
            self.solved, self._news = solve(self.graph, self.own), False


def _own_edges(number: int, graph: Graph) -> Iterator[RelativePoses]:
    """The edges that leave a robot's poses, peer by peer, in parts that fit a datagram."""
    read = graph.read
    mine = graph.robot[read.i] == number
    for peer in range(int(graph.robot.max()) + 1):
        at = np.flatnonzero(mine & (graph.robot[read.j] == peer))
        for first in range(0, len(at), EDGES_PER_ENTRY):
            part = at[first : first + EDGES_PER_ENTRY]
            numbers = (graph.n[read.i[part]], graph.n[read.j[part]])
            values = (*read.measured[part].T, graph.tau[part], graph.kappa[part])
            columns = (tuple(column.tolist()) for column in (*numbers, *values))
            yield RelativePoses(Chain(peer, 1), *columns)


def run(graph: Graph, loss: float, gap: float, most: int, seed: int = 0) -> Outcome:
    """Rounds until every robot is within the gap.

    Args:
        loss: share of datagrams that a receiver misses, each by itself.
        most: bound on rounds.
    """
    rng = np.random.default_rng(seed)
    judge = PoseGraphSolver(graph.edges, graph.count)
    began = time.process_time()
    robots = [GraphRobot(k, graph) for k in range(int(graph.robot.max()) + 1)]
    cpu = time.process_time() - began
    worst, number = np.inf, 0
    while number < most and worst > gap:
        began = time.process_time()
        said = [list(robot.say(number)) for robot in robots]
        cpu += time.process_time() - began
        for robot in robots:
            arriving = [
                datagram
                for sender, datagrams in zip(robots, said, strict=True)
                if sender is not robot
                for datagram, lost in zip(datagrams, rng.random(len(datagrams)), strict=True)
                if lost >= loss
            ]
            began = time.process_time()
            for datagram in arriving:
                robot.hear(datagram, number)
            robot.solve()
            cpu += time.process_time() - began
        worst = max(_gap(robot, graph, judge) for robot in robots)
        number += 1
    sent = sum(robot.bytes_sent for robot in robots) / 1e6
    return Outcome(number if worst <= gap else None, worst, sent, cpu)


def _gap(robot: GraphRobot, graph: Graph, judge: PoseGraphSolver) -> float:
    """Of the whole team's poses as one robot has them; infinite while some are missing."""
    solved = robot.solved
    if solved is None or len(solved.poses) < graph.count:
        return np.inf
    named = np.lexsort((graph.n, graph.robot))
    poses = np.empty((graph.count, 3))
    poses[graph.place[named]] = solved.poses[np.lexsort((solved.n, solved.robot))]
    return graph.gap(judge.cost(poses))
