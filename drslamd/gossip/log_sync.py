"""The logs of all robots, and what to repeat to whom.

What a robot adds to the pose graph is a log: messages numbered from 0 within its epoch. Holding
the same logs is holding the same graph, so loss, order and repetition cannot change a result. Each
status names how far the sender has got with every log; whoever holds what it lacks sends it
again, sealed as it came: the owner at once, and once a second until the next status comes; the
others a little later and only if nobody else did.
"""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import dataclass, field
from itertools import islice
from typing import NamedTuple

from drslamd.conventions import MILLISECOND_US, SECOND_US, Chain
from drslamd.gossip.message_types import MAX_LOGS, LogState

MAX_ENTRIES = 36_000
"""Of one log: ten hours at one entry a second, 12 to 17 MB; the oldest go first."""
REPEATS_AT_ONCE = 12
"""Entries of one log that one status of a lagging peer asks for, and all that one call of `due`
hands out: a robot that comes back after an hour catches up in five minutes without crowding the
channel."""
MAX_PLANNED = 20 * REPEATS_AT_ONCE
"""Repeats that wait for their time; what finds no room is asked for by the next status."""
QUIET_US = 800 * MILLISECOND_US
"""A status cannot know of what was on the air so shortly before it."""
TURN_US = 300 * MILLISECOND_US
TURNS = 5
"""Who repeats an entry: the owner at once, then four groups of relays by their ids, one after the
other and each only if nobody before it did."""
PATIENCE = 3
"""Statuses in a row that may ask for the same entry; then the order moves on by one, because
whoever has the first turn may be heard by the others and not by the one who asks."""
OVERDUE_US = 3_500 * MILLISECOND_US
"""A status that is so late was lost; its sender then still lacks what it lacked before ..."""
BELIEVED_US = 5 * SECOND_US
"""... for so long."""


@dataclass
class _Log:
    """Sealed entries by number, and when each was last on the air."""

    epoch: int
    sealed: dict[int, bytes] = field(default_factory=dict)
    aired: dict[int, int] = field(default_factory=dict)
    first: int = 0
    """What lies before it is forgotten and refused."""
    complete: int = 0
    """The first that is missing."""
    end: int = 0
    """One past the last that is held."""
    newest: int = 0
    """One past the last that was heard of."""

    def put(self, seq: int, sealed: bytes) -> None:
        self.sealed[seq] = sealed
        self.end = max(self.end, seq + 1)
        self.newest = max(self.newest, self.end)
        self.forget_before(self.end - MAX_ENTRIES)
        self._advance()

    def forget_before(self, first: int) -> None:
        """Give up what is older, whether it was held or not."""
        if first <= self.first:
            return
        # never count through more numbers than there are entries: `first` comes from outside
        few = first - self.first <= len(self.sealed)
        for seq in range(self.first, first) if few else [s for s in self.sealed if s < first]:
            self.sealed.pop(seq, None)
            self.aired.pop(seq, None)
        self.first = first
        self.complete, self.end = max(self.complete, first), max(self.end, first)
        self.newest = max(self.newest, first)
        self._advance()

    def _advance(self) -> None:
        while self.complete in self.sealed:
            self.complete += 1


class _Place(NamedTuple):
    """Of one entry."""

    robot: int
    epoch: int
    seq: int


@dataclass(frozen=True)
class _Repeat:
    """When somebody asked for an entry, and when it is our turn to send it."""

    asked: int
    due: int


@dataclass
class _Question:
    """What a peer lacks, in how many statuses in a row (of those that name the log) it said so, and
    when to answer again."""

    lacking: dict[_Place, int]
    again: int
    until: int


class LogSync:
    """Logs by robot; only the newest epoch of each is kept."""

    def __init__(self, robot: int) -> None:
        self._robot = robot
        self._logs: dict[int, _Log] = {}
        self._planned: dict[_Place, _Repeat] = {}
        self._questions: dict[int, _Question] = {}
        """By the peer that asks."""
        self._turn = 0
        self.repeated = 0

    def begin(self, origin: Chain) -> bool:
        """A start of a robot was heard of; False when we know of a later one."""
        log = self._logs.get(origin.robot)
        if log is None or origin.epoch > log.epoch:
            self._logs[origin.robot] = _Log(origin.epoch)
            return True
        return origin.epoch == log.epoch

    def add(self, origin: Chain, seq: int, sealed: bytes, utime: int) -> bool:
        """Take one entry; False when it is not new.

        Args:
            origin: robot and epoch that made it.
            sealed: the message as it came, to be repeated unchanged.
        """
        if not self.begin(origin):
            return False
        log = self._logs[origin.robot]
        if seq < log.first:
            return False
        new = seq not in log.sealed
        if new:
            log.put(seq, sealed)
        log.aired[seq] = utime
        return new

    def states(self) -> tuple[LogState, ...]:
        """For our status: our own log, and those of the others, in turn when they are too many."""
        others = sorted(robot for robot in self._logs if robot != self._robot)
        named = [self._robot] if self._robot in self._logs else []
        room = MAX_LOGS - len(named)
        if len(others) > room:
            start = self._turn % len(others)
            others = (others[start:] + others[:start])[:room]
            self._turn = start + room
        return tuple(
            LogState(robot, log.epoch, log.first, log.complete, log.newest)
            for robot, log in ((robot, self._logs[robot]) for robot in named + others)
        )

    def epoch(self, robot: int) -> int | None:
        log = self._logs.get(robot)
        return log.epoch if log else None

    def lacking(self, robot: int) -> int:
        """Entries of a robot's log that we know of and do not hold."""
        log = self._logs.get(robot)
        return log.newest - log.first - len(log.sealed) if log else 0

    def lacks_any(self) -> bool:
        """Do we know of entries, of anybody's, that we do not hold?"""
        return any(log.complete < log.newest for log in self._logs.values())

    def peer_holds(self, states: tuple[LogState, ...], sender: int, utime: int) -> None:
        """A peer said what it holds: learn what we lack, plan to repeat what it lacks."""
        for theirs in states:
            log = self._logs.get(theirs.id)
            if log is not None and theirs.epoch == log.epoch:
                self._learn(log, theirs, sender)
        last = self._questions.get(sender)
        asked = last.lacking if last else {}
        named = {state.id: state for state in states}
        left_out = self._logs.keys() - named if len(states) == MAX_LOGS else set()
        places = self._lacking(sender, named, left_out)
        lacking = {place: asked.get(place, 0) + 1 for place in places}
        still = {place: times for place, times in asked.items() if place.robot in left_out}
        question = _Question({**still, **lacking}, utime + OVERDUE_US, utime + BELIEVED_US)
        self._questions[sender] = question
        for place, times in lacking.items():
            self._plan(place, times, utime)

    def _learn(self, log: _Log, theirs: LogState, sender: int) -> None:
        if theirs.id == self._robot:
            return
        log.newest = max(log.newest, theirs.newest)
        if theirs.id == sender and theirs.first > log.complete:
            # the owner itself no longer holds what we lack
            log.forget_before(theirs.first)

    def _lacking(
        self, sender: int, named: dict[int, LogState], left_out: Set[int]
    ) -> Iterator[_Place]:
        """What a peer lacks and we hold, a few entries of each log."""
        for robot, log in self._logs.items():
            if robot == sender or robot in left_out:
                continue
            theirs = named.get(robot)
            if theirs is None or theirs.epoch < log.epoch:
                start = log.first
            elif theirs.epoch == log.epoch:
                start = max(log.first, theirs.complete)
            else:
                continue
            held = (seq for seq in range(start, log.end) if seq in log.sealed)
            for seq in islice(held, REPEATS_AT_ONCE):
                yield _Place(robot, log.epoch, seq)

    def _plan(self, place: _Place, times: int, utime: int) -> None:
        turn = 0 if place.robot == self._robot else 1 + self._robot % (TURNS - 1)
        wait = (turn - (times - 1) // PATIENCE) % TURNS * TURN_US
        if len(self._planned) < MAX_PLANNED:
            self._planned.setdefault(place, _Repeat(utime, utime + wait))

    def _answer_again(self, utime: int) -> None:
        """Our own entries to those whose next status is overdue."""
        for sender, question in list(self._questions.items()):
            if utime >= question.until:
                del self._questions[sender]
            elif utime >= question.again:
                question.again = utime + SECOND_US
                for place in question.lacking:
                    if place.robot == self._robot:
                        self._plan(place, 1, utime)

    def due(self, utime: int) -> list[tuple[int, bytes]]:
        """What to repeat now: owner's id and sealed message."""
        self._answer_again(utime)
        out: list[tuple[int, bytes]] = []
        for place, repeat in list(self._planned.items()):
            if repeat.due > utime or len(out) == REPEATS_AT_ONCE:
                continue
            del self._planned[place]
            log = self._logs[place.robot]
            if log.epoch != place.epoch or place.seq not in log.sealed:
                continue
            if log.aired[place.seq] <= repeat.asked - QUIET_US:
                log.aired[place.seq] = utime
                self.repeated += 1
                out.append((place.robot, log.sealed[place.seq]))
        return out
