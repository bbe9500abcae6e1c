"""Module 3 over messages: robots that know only their own edges, rounds, bytes and CPU.

Every robot starts with its own odometry and the closures that it measured. In a round each may say
whatever follows from what it held when the round began; then everything that was said (and not
lost) arrives. What is said are entries of a log of relative poses (`relative_poses`), sealed as the
daemon seals its own, in LCM's datagrams. In its first round a robot says its log once; in every
later one again what a peer may lack, because whoever lost a datagram cannot have said so in time.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drslamd.gossip import lc02
from drslamd.gossip.lc02 import FramingFault
from drslamd.gossip.seal import Seal, SealFault
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from lab.benchmark.graphs import Graph
from lab.benchmark.over_messages import relative_poses
from lab.benchmark.over_messages.relative_graph import SolvedPoses, solve
from lab.benchmark.over_messages.relative_poses import EDGE, FINGERPRINT, RelativePoses

KEY = bytes(32)
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
        self.own = number
        self.solved: SolvedPoses | None = None
        self.bytes_sent = 0
        self._seal = Seal(KEY, number, 1, {})
        self._log: dict[tuple[int, int], RelativePoses] = {}
        """By origin and number."""
        self._held: dict[bytes, bool] = {}
        """Datagrams of log entries: are they our own?"""
        self._news = True
        channel = relative_poses.channel(number)
        for entry in _own_edges(number, graph):
            self._log[number, entry.seq] = entry
            message = relative_poses.encode(self._seal.header(0), entry)
            datagram = lc02.encode(entry.seq, channel, self._seal.close(channel, message))
            self._held[datagram] = True

    def say(self, number: int) -> Iterator[bytes]:
        """Our datagrams of a round."""
        for datagram, ours in self._held.items():
            for _ in range(OWN_AGAIN if number and ours else OTHERS_AGAIN if number else int(ours)):
                self.bytes_sent += len(datagram)
                yield datagram

    def hear(self, datagram: bytes) -> None:
        framed = lc02.decode(datagram)
        if isinstance(framed, FramingFault):
            return
        channel, payload = framed
        # a repetition is harmless, as it is to the daemon's logs
        header = self._seal.open(channel, payload, frozenset([FINGERPRINT]), once=False)
        if isinstance(header, SealFault):
            return
        entry = relative_poses.decode(payload)
        if (header.origin, entry.seq) not in self._log:
            self._log[header.origin, entry.seq] = entry
            self._held[datagram] = False
            self._news = True

    def solve(self) -> None:
        if self._news:
            self.solved, self._news = solve(self._log, self.own), False


def _own_edges(number: int, graph: Graph) -> Iterator[RelativePoses]:
    """The edges that leave a robot's poses, peer by peer, in parts that fit a datagram."""
    read, seq = graph.read, 0
    mine = graph.robot[read.i] == number
    for peer in range(int(graph.robot.max()) + 1):
        at = np.flatnonzero(mine & (graph.robot[read.j] == peer))
        for first in range(0, len(at), relative_poses.MOST):
            part = at[first : first + relative_poses.MOST]
            edges = np.empty(len(part), EDGE)
            edges["a_n"], edges["b_n"] = graph.n[read.i[part]], graph.n[read.j[part]]
            edges["x"], edges["y"], edges["theta"] = read.measured[part].T
            edges["tau"], edges["kappa"] = graph.tau[part], graph.kappa[part]
            yield RelativePoses(seq, peer, edges)
            seq += 1


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
                robot.hear(datagram)
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
