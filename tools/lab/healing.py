"""How fast and how quietly a team heals: partitions, late joiners, restarts, lost disks.

Real conversations (`drslamd.gossip.team`) and graphs in virtual time, without the rest of the
robots: what they measured is made up, as much as driving robots measure that all range to each
other. One row for each case, with what it shall show.

    python -m lab.healing                # the cases of a small team, three minutes
    python -m lab.healing --all          # also an hour of partition and newcomers to large teams
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Set
from typing import NamedTuple
from unittest.mock import patch

import numpy as np

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Send
from drslamd.gossip.message_types import UNKNOWN_CLOCK, OdometryBatch, Pose, PoseState, Status
from drslamd.gossip.seal import Seal, team_key
from drslamd.gossip.team import Team
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.robot_model import UNTOLD

SECOND = 1_000_000
STEP = SECOND // 10
DELAY = 2_000
QUIET_S = 3
FRESH_S = 5
"""What was said so shortly ago may still be on its way."""
PARTNERS = 10
"""Robots that one robot of a large team ranges to."""
Link = Callable[[int, int], bool]
Measured = tuple[list[Keyframe], list[RangeMeasurement], list[ClosureMeasurement]]


class Mate:
    """One robot: a conversation and the graph that it leads to."""

    def __init__(self, robot: int, epoch: int) -> None:
        self.team, self.graph = Team(Seal(team_key(None), robot, epoch, {})), PoseGraph()
        self.place = np.zeros(3)
        self.numbers: Counter[int] = Counter()
        self.heard: Set[Chain] = set()


class Conversation:
    """A team that drives and speaks on a radio.

    Attributes:
        hears: does robot b hear what robot a sends?
        bytes: sent in each second so far.
    """

    def __init__(self, robots: int, loss: float = 0.0, seed: int = 0) -> None:
        self.mates = {robot: Mate(robot, 1) for robot in range(robots)}
        self.hears: Link = lambda a, b: True
        self.utime, self.loss, self.bytes = 100 * SECOND, loss, [0]
        self.said: list[tuple[Chain, int, int]] = []
        """Entries, and when they were made."""
        self._chance = random.Random(seed)
        self._phase = {robot: self._chance.randrange(10) for robot in range(robots)}
        self._ends: deque[dict[int, tuple[int, int]]] = deque(maxlen=FRESH_S + 1)

    def join(self, robot: int) -> None:
        """A robot is switched on, with nothing in its memory."""
        known = self.mates.get(robot)
        self.mates[robot] = Mate(robot, known.team.own.epoch + 1 if known else 1)
        self._phase.setdefault(robot, self._chance.randrange(10))

    def seconds(self, count: int) -> None:
        for _ in range(count):
            self.bytes.append(0)
            for robot, mate in list(self.mates.items()):
                self.drive(robot, mate, self._partners(robot, mate))
            for step in range(10):
                self.utime += STEP
                for robot, mate in list(self.mates.items()):
                    self._speak(robot, mate, step)
            self._ends.append({r: (m.team.own.epoch, _end(m, r)) for r, m in self.mates.items()})

    def _carry(self, sender: int, send: Send) -> None:
        self.bytes[-1] += len(send.payload) + len(send.channel) + 9
        for robot, mate in self.mates.items():
            if robot == sender or not self.hears(sender, robot):
                continue
            if self._chance.random() < self.loss:
                continue
            received = mate.team.receive(
                ChannelMessage(self.utime + DELAY, send.channel, send.payload)
            )
            if received and isinstance(received.message, GraphEntry):
                mate.graph.insert(received.origin, received.message)

    def drive(self, robot: int, mate: Mate, partners: Iterable[Chain]) -> None:
        """Another second of a robot, which it tells the others."""
        team = mate.team
        for entry in team.entries(UNTOLD, *self._measure(mate, partners)):
            decoded, sealed = team.append(entry, self.utime)
            self.said.append((team.own, decoded.seq, self.utime))
            mate.graph.insert(team.own, decoded)
            self._carry(robot, team.send_sealed(robot, sealed))
        for entry in team.write_chapters(self.utime, mate.graph, aloud=True):
            mate.graph.insert(team.own, entry)

    def remember(self, minutes: float) -> None:
        """Let a team have driven for so long and heard all: entries go from hand to hand, and one
        graph serves everybody, so hours of many robots take minutes."""
        graph = PoseGraph()
        for mate in self.mates.values():
            mate.graph = graph
        with patch.object(Team, "living", return_value=range(1, len(self.mates))):
            for _ in range(round(60 * minutes)):
                self.utime += SECOND
                for robot, mate in self.mates.items():
                    near = range(robot + 1, min(robot + 1 + PARTNERS, len(self.mates)))
                    partners = [self.mates[peer].team.own for peer in near]
                    self._hand_over(mate, self._measure(mate, partners))

    def _hand_over(self, mate: Mate, measured: Measured) -> None:
        team, logs = mate.team, [other.team.logs for other in self.mates.values()]
        entries = [team.append(e, self.utime)[0] for e in team.entries(UNTOLD, *measured)]
        while entries:
            for entry in entries:
                mate.graph.insert(team.own, entry)
                sealed = team.logs._logs[team.own.robot].sealed[entry.seq]
                for log in logs:
                    log.add(team.own, entry.seq, sealed, self.utime, entry.chapter)
            entries = team.write_chapters(self.utime, mate.graph, aloud=False)

    def _measure(self, mate: Mate, partners: Iterable[Chain]) -> Measured:
        """A keyframe, a range to each partner, a closure now and then."""
        chance, n = self._chance, self.utime // STEP
        mate.place += [chance.gauss(3_000, 500), chance.gauss(0, 500), chance.gauss(100, 300)]
        x, y, theta = (int(v) for v in mate.place)
        ranges, closures = [], []
        for peer in partners:
            metres = float(np.hypot(*(mate.place - self.mates[peer.robot].place)[:2])) * 1e-4
            metres = round(min(metres % 60 + chance.gauss(0, 0.1), 90.0), 4)
            ends = tuple((round(chance.gauss(0.1, 0.05), 3), 0.0) for _ in "ab")
            ranges.append(RangeMeasurement(n, peer, n, ends[0], ends[1], metres, 0.1, 0.001, 0.002))
            if n // 10 % 10 == peer.robot % 10:
                pose = (metres, round(chance.gauss(0, 1), 4), round(chance.gauss(0, 1), 4))
                mate.numbers[peer.robot] += 1
                covariance = tuple(
                    float(np.float32(v)) for v in (0.01, 0, 0, chance.uniform(0.01, 0.02), 0, 0.01)
                )
                closures.append(
                    ClosureMeasurement(mate.numbers[peer.robot], True, n, peer, n, pose, covariance)
                )
        return [Keyframe(n, 0, x, y, theta)], ranges, closures

    def _partners(self, robot: int, mate: Mate) -> Iterator[Chain]:
        """Whom it ranges to: the next ones in a large team, all that are above it in a small."""
        near = [peer for peer in self.mates if robot < peer <= robot + PARTNERS]
        audible = {chain.robot: chain for chain in mate.team.audible(self.utime)}
        return (audible[peer] for peer in near if peer in audible)

    def _speak(self, robot: int, mate: Mate, step: int) -> None:
        team = mate.team
        for send in team.repeats(self.utime):
            self._carry(robot, send)
        second = self.utime // SECOND
        if step != self._phase[robot]:
            return
        news, mate.heard = mate.heard, team.audible(self.utime)
        is_news = news != mate.heard
        if is_news or team.is_asking(self.utime) or second % QUIET_S == robot % QUIET_S:
            heard = team.next_heard(self.utime, range(robot + 1, 255))
            status = Status(
                PoseState.LOCALISED, 0, False, robot, UNKNOWN_CLOCK, 0, heard, (),
                team.logs.next_states(),
            )  # fmt: skip
            self._carry(robot, team.send(status, self.utime))
        pose = Pose(PoseState.LOCALISED, 0, 1, self.utime)
        self._carry(robot, team.send(pose, self.utime))
        if robot:
            steps = np.cumsum(np.full((11, 3), 300.0), axis=0)
            begin = self.utime // STEP - 10
            # (each is whole by itself: nobody here says odometry again)
            batch = OdometryBatch(begin, begin, steps)
            self._carry(robot, team.send(batch, self.utime))

    def is_healed(self) -> bool:
        """Does nobody lack anything that was said five seconds ago?"""
        before = self._ends[0]
        for mate in self.mates.values():
            logs = mate.team.logs
            for robot, (epoch, end) in before.items():
                known = logs.known_below(Chain(robot, epoch))
                if self.mates[robot].team.own.epoch == epoch and known < end:
                    return False
        return True

    def digests(self) -> set[int]:
        """The graphs of all robots, when none lacks anything."""
        return {mate.graph.digest(set(mate.graph.chains)) for mate in self.mates.values()}

    def settle(self) -> None:
        """Nobody drives any more, and what is under way arrives."""
        for _ in range(60):
            for step in range(10):
                self.utime += STEP
                for robot, mate in self.mates.items():
                    self._speak(robot, mate, step)

    def log_bytes(self, robot: int) -> int:
        """Of all logs that a robot holds."""
        return self.mates[robot].team.logs.bytes_held


def _end(mate: Mate, robot: int) -> int:
    return mate.team.logs.known_below(Chain(robot, mate.team.own.epoch))


class Healed(NamedTuple):
    """What became of a fault."""

    seconds: int | None
    peak: float
    """The busiest second, in steady ones."""
    kilobytes: float
    graphs: int


def heal(talk: Conversation, fault: Callable[[Conversation], None], limit: int) -> Healed:
    """Let a team speak, have the fault happen, count until it is healed."""
    talk.seconds(40)
    steady = sum(talk.bytes[-30:]) / 30
    fault(talk)
    before = len(talk.bytes)
    seconds = None
    for second in range(1, limit + 1):
        talk.seconds(1)
        if talk.is_healed():
            seconds = second
            break
    after = talk.bytes[before:]
    talk.seconds(30)
    # a newcomer speaks too
    steady = max(steady, sum(talk.bytes[-15:]) / 15)
    kilobytes = (sum(after) - steady * len(after)) / 1e3
    talk.settle()
    return Healed(seconds, max(after) / steady, kilobytes, len(talk.digests()))


def parted(minutes: float, side: int) -> Callable[[Conversation], None]:
    """Robots below `side` and the others do not hear each other for a while."""

    def fault(talk: Conversation) -> None:
        talk.hears = lambda a, b: (a < side) == (b < side)
        talk.seconds(round(60 * minutes))
        talk.hears = lambda a, b: True

    return fault


def joined(minutes: float) -> Callable[[Conversation], None]:
    """A robot more, after a while."""

    def fault(talk: Conversation) -> None:
        talk.seconds(round(60 * minutes))
        talk.join(len(talk.mates))

    return fault


def restarted(minutes: float) -> Callable[[Conversation], None]:
    """Robot 1 begins again after a while, with nothing in its memory."""

    def fault(talk: Conversation) -> None:
        talk.seconds(round(60 * minutes))
        talk.join(1)

    return fault


class Case(NamedTuple):
    name: str
    robots: int
    loss: float
    fault: Callable[[Conversation], None]
    limit: int
    """Seconds in which it shall be healed."""
    remembered: float = 0.0
    """Minutes that the team has behind it."""

    def play(self, seed: int, limit: int) -> Healed:
        """What becomes of it, looked at for so many seconds after the fault at most."""
        talk = Conversation(self.robots, self.loss, seed)
        talk.remember(self.remembered)
        return heal(talk, self.fault, limit)


SMALL = [
    Case(f"{name}, loss {loss:.0%}", 5, loss, fault, 30 if loss == 0 else 60)
    for loss in (0.0, 0.3)
    for name, fault in (
        ("parted 1 min", parted(1, 2)),
        ("parted 10 min", parted(10, 2)),
        ("newcomer after 10 min", joined(10)),
        ("restart after 10 min", restarted(10)),
    )
]
LARGE = [
    Case("parted 60 min, loss 0%", 5, 0.0, parted(60, 2), 30),
    Case("newcomer after 60 min, loss 0%", 5, 0.0, joined(60), 30),
    Case("newcomer to 20 after 60 min, loss 0%", 20, 0.0, joined(0), 30, remembered=60),
    Case("newcomer to 50 after 60 min, loss 0%", 50, 0.0, joined(0), 30, remembered=60),
]


def main() -> int:
    """Print a row for each case."""
    parser = argparse.ArgumentParser(description="How fast and how quietly a team heals.")
    parser.add_argument("--all", action="store_true", help="also the cases that take long")
    chosen = parser.parse_args()
    rows = [("case", "healed after", "shall", "busiest second", "more than steady", "graphs")]
    for case in SMALL + (LARGE if chosen.all else []):
        found = case.play(seed=1, limit=20 * case.limit)
        when = "never" if found.seconds is None else f"{found.seconds} s"
        rows.append(
            (case.name, when, f"{case.limit} s", f"{found.peak:.1f} x steady (2)",
             f"{found.kilobytes:.0f} kB", str(found.graphs))
        )  # fmt: skip
        print(" | ".join(rows[-1]), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
