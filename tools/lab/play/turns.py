"""Module 3 with `rbcd` alone: robots that take turns over datagrams, in rounds of a second.

In a round every robot's time to move comes once, at a phase of its own. What it then says goes to
all others as the daemon would say it, each datagram lost or not; who waits asks and is answered as
the clock goes on. Moves take no time, and none comes before its time.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from drslamd.conventions import MILLISECOND_US, SECOND_US, Chain
from drslamd.events import ChannelMessage
from drslamd.gossip import lc02
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.rbcd.pose_exchange import PoseExchange

EPOCH = 1
KEY = bytes(32)
TICK_US = 20 * MILLISECOND_US
TICKS = SECOND_US // TICK_US


class Mover(Protocol):
    """What a robot's back end can do."""

    exchange: PoseExchange

    def begin(self, utime: int) -> Job | None:
        """Its time to move has come, or comes again because it waits."""

    def on_solution(self, result: TeamEstimate) -> list[PublicPoses]: ...

    def hear(self, origin: Chain, message: PublicPoses) -> None: ...


class Turns:
    """A team of movers.

    Attributes:
        moves: that were made; bytes_sent: with LCM's framing, by all.
    """

    def __init__(self, movers: Mapping[int, Mover], loss: float = 0.0, seed: int = 0) -> None:
        """
        Args:
            loss: share of datagrams that a receiver misses, each by itself.
        """
        self._movers = movers
        self._teams = {robot: Team(Seal(KEY, robot, EPOCH, {})) for robot in movers}
        self._phase = {robot: k * TICKS // len(movers) for k, robot in enumerate(movers)}
        self._loss, self._rng = loss, np.random.default_rng(seed)
        self._utime = SECOND_US
        self.moves = self.bytes_sent = 0

    def round(self) -> int:
        """Let a second pass; how many moves were made in it."""
        before = self.moves
        for tick in range(TICKS):
            for robot, mover in self._movers.items():
                if tick == self._phase[robot] or mover.exchange.is_waiting:
                    self._move(robot)
                self._send(robot, mover.exchange.answers(self._utime, self._is_at_rest(robot)))
            self._utime += TICK_US
        return self.moves - before

    def _is_at_rest(self, robot: int) -> bool:
        return not self._movers[robot].exchange.is_waiting

    def _move(self, robot: int) -> None:
        mover = self._movers[robot]
        job = mover.begin(self._utime)
        if job is not None:
            self.moves += 1
            self._send(robot, mover.on_solution(job()))

    def _send(self, sender: int, said: list[PublicPoses]) -> None:
        for poses in said:
            for send in self._teams[sender].send_public(poses, self._utime):
                self.bytes_sent += len(lc02.encode(0, send.channel, send.payload))
                for robot in self._movers.keys() - {sender}:
                    if self._rng.random() >= self._loss:
                        self._arrive(robot, send.channel, send.payload)

    def _arrive(self, robot: int, channel: str, payload: bytes) -> None:
        received = self._teams[robot].receive(ChannelMessage(self._utime, channel, payload))
        assert received is not None
        assert isinstance(received.message, PublicPoses)
        self._movers[robot].hear(received.origin, received.message)
