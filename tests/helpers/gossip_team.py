"""A team on a shared, lossy channel in virtual time: only the gossip, no robot around it."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterable

from acquainted import introduce
from message_builders import MS, SECOND, a_seal, a_status

from drslamd.events import ChannelMessage, Send
from drslamd.gossip.message_types import Received
from drslamd.gossip.team import Team
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.robot_model import UNTOLD

STEP = 100 * MS
DELAY = 2 * MS
Link = Callable[[int, int], bool]


class Air:
    """Robots with ids 0, 1, 2, ... that send a status every `period`, each at its own moment.

    Attributes:
        hears: does robot b hear what robot a sends?
        held: entries of all logs by robot: {(owner, seq): entry}.
        sent: messages on the air so far.
        entries_sent: log entries among them, repeated ones and all.
        bytes_sent: by robot.
    """

    def __init__(self, robots: int, loss: float = 0.0, seed: int = 0, period: int = SECOND) -> None:
        self.teams = {robot: Team(a_seal(robot)) for robot in range(robots)}
        self.held: dict[int, dict[tuple[int, int], GraphEntry]] = {r: {} for r in self.teams}
        self.hears: Link = lambda a, b: True
        self.utime = 10 * SECOND
        self.sent = self.entries_sent = 0
        self.bytes_sent: Counter[int] = Counter()
        self._loss = loss
        self._random = random.Random(seed)
        self._steps = period // STEP
        self._phase = {robot: self._random.randrange(self._steps) for robot in self.teams}

    def meet(self) -> Air:
        """Everybody has answered everybody."""
        for team in self.teams.values():
            others = (other.own for other in self.teams.values() if other is not team)
            introduce(team, *others, utime=self.utime)
            for peer in team.peers.values():
                peer.clock.on_message(self.utime, self.utime)
        return self

    def say(self, robot: int, *, aloud: bool = True) -> None:
        """A robot adds an entry to its log, and sends it if `aloud`."""
        team = self.teams[robot]
        for entry in team.entries(UNTOLD, (Keyframe(self.utime // STEP, 0, robot, 0, 0),), (), ()):
            own, sealed = team.append(entry, self.utime)
            self.held[robot][robot, own.seq] = own
            if aloud:
                self.carry(robot, team.send_sealed(robot, sealed))

    def restart(self, robot: int) -> None:
        """It comes back with nothing in its memory and a new epoch."""
        team = self.teams[robot]
        self.teams[robot] = Team(a_seal(robot, team.own.epoch + 1))
        self.held[robot] = {}

    def carry(self, sender: int, send: Send) -> None:
        """One message to whoever hears it."""
        self.sent += 1
        self.bytes_sent[sender] += len(send.payload)
        self.entries_sent += "GRAPH" in send.channel
        for robot, team in self.teams.items():
            if robot == sender or not self.hears(sender, robot):
                continue
            if self._random.random() < self._loss:
                continue
            event = ChannelMessage(self.utime + DELAY, send.channel, send.payload)
            received = team.receive(event)
            if isinstance(received, Received) and isinstance(received.message, GraphEntry):
                key = received.origin.robot, received.message.seq
                assert key not in self.held[robot], "an entry was handed out twice"
                self.held[robot][key] = received.message

    def step(self) -> None:
        """A tenth of a second: repeats, and the statuses whose moment it is."""
        self.utime += STEP
        for robot, team in self.teams.items():
            for send in team.repeats(self.utime):
                self.carry(robot, send)
            if self.utime // STEP % self._steps == self._phase[robot]:
                status = a_status(team.next_heard(self.utime), team.logs.next_states())
                self.carry(robot, team.send(status, self.utime))

    def seconds(self, count: int, speakers: Iterable[int] = (), *, aloud: bool = True) -> None:
        """Let time pass; each speaker says one entry a second."""
        for _ in range(count):
            for robot in speakers:
                self.say(robot, aloud=aloud)
            for _ in range(10):
                self.step()

    def is_equal(self, robots: Iterable[int] | None = None) -> bool:
        """Do these robots (by default all) hold the same entries of everybody?"""
        tables = [self.held[robot] for robot in robots or self.teams]
        return all(table == tables[0] for table in tables)

    def rounds_until_equal(self, at_most: int, robots: Iterable[int] | None = None) -> int:
        """Statuses that each robot sends until all hold the same; `at_most` + 1 if never."""
        group = None if robots is None else list(robots)
        for count in range(at_most + 1):
            if self.is_equal(group):
                return count
            self.seconds(1)
        return at_most + 1
