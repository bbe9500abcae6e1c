"""Module 3 with `rbcd` alone: robots that take turns over datagrams, in rounds of a second.

In a round every robot's time to move comes once, at a phase of its own. What it then says goes to
all others as the daemon would say it, each datagram lost or not, at once or late; who waits asks
and is answered as the clock goes on.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
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

    def on_solution(self, result: TeamEstimate, utime: int) -> list[PublicPoses]: ...

    def hear(self, origin: Chain, message: PublicPoses) -> None: ...


@dataclass(frozen=True)
class Air:
    """What happens to datagrams, and to time.

    Attributes:
        loss: share of datagrams that a receiver misses, each by itself.
        latest: ticks by which a datagram comes late at most, each by itself.
        takes: ticks that a move is computed for.
    """

    loss: float = 0.0
    latest: int = 0
    takes: int = 0


CALM = Air()


class Turns:
    """A team of movers.

    Attributes:
        moves: that were made; bytes_sent: with LCM's framing, by all.
    """

    def __init__(self, movers: Mapping[int, Mover], air: Air = CALM, seed: int = 0) -> None:
        self._movers = movers
        self._teams = {robot: Team(Seal(KEY, robot, EPOCH, {})) for robot in movers}
        for robot, team in self._teams.items():
            for other in movers.keys() - {robot}:
                team.meet(Chain(other, EPOCH), 0, 0)
        self._phase = {robot: k * TICKS // len(movers) for k, robot in enumerate(movers)}
        self._air, self._rng = air, np.random.default_rng(seed)
        self._tick = TICKS
        self._due: defaultdict[int, list[Callable[[], None]]] = defaultdict(list)
        self._busy: set[int] = set()
        self.moves = self.bytes_sent = 0

    def round(self) -> bool:
        """Let a second pass; False when nobody moved in it, nor wants to."""
        before = self.moves
        for tick in range(TICKS):
            for action in self._due.pop(self._tick, []):
                action()
            for robot, mover in self._movers.items():
                if tick == self._phase[robot] or mover.exchange.is_waiting:
                    self._begin(robot)
                at_rest = not mover.exchange.is_waiting and robot not in self._busy
                self._send(robot, mover.exchange.answers(self._utime, at_rest))
            self._tick += 1
        wants = any(not mover.exchange.is_at_rest for mover in self._movers.values())
        return self.moves > before or bool(self._busy) or bool(self._due) or wants

    @property
    def _utime(self) -> int:
        return self._tick * TICK_US

    def _later(self, ticks: int, action: Callable[[], None]) -> None:
        if ticks:
            self._due[self._tick + ticks].append(action)
        else:
            action()

    def _begin(self, robot: int) -> None:
        job = None if robot in self._busy else self._movers[robot].begin(self._utime)
        if job is not None:
            self._busy.add(robot)
            result = job()
            self._later(self._air.takes, lambda: self._end(robot, result))

    def _end(self, robot: int, result: TeamEstimate) -> None:
        self._busy.remove(robot)
        self.moves += 1
        self._send(robot, self._movers[robot].on_solution(result, self._utime))

    def _send(self, sender: int, said: list[PublicPoses]) -> None:
        for poses in said:
            for send in self._teams[sender].send_public(poses, self._utime):
                self.bytes_sent += len(lc02.encode(0, send.channel, send.payload))
                for robot in self._movers.keys() - {sender}:
                    if self._rng.random() >= self._air.loss:
                        self._deliver(robot, send.channel, send.payload)

    def _deliver(self, robot: int, channel: str, payload: bytes) -> None:
        late = int(self._rng.integers(0, self._air.latest + 1))
        self._later(late, lambda: self._arrive(robot, channel, payload))

    def _arrive(self, robot: int, channel: str, payload: bytes) -> None:
        received = self._teams[robot].receive(ChannelMessage(self._utime, channel, payload))
        assert received is not None
        assert isinstance(received.message, PublicPoses)
        self._movers[robot].hear(received.origin, received.message)
