"""Who repeats a lost log entry, and when.

Each status names how far its sender has got with every log. Whoever holds what it lacks sends it
again, sealed as it came: the owner at once, and again when the next status is overdue; the others
when the owner is silent or it is asked for a second time, a little later, in groups by their ids,
and only if nobody else did and nobody says that it is there by now. Where most messages are lost,
requests are too: then an owner says each new entry again before it is asked, until everybody says
that it is there.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field
from typing import NamedTuple

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.gossip.repeats.allowance import Allowance, Speech
from drslamd.gossip.repeats.log_rows import Holding
from drslamd.gossip.replicated_log import ReplicatedLog

REPEATS_AT_ONCE = 12
"""Entries of one log that one status of a lagging peer asks for, and all that one call of
`take_due` hands out: a robot that comes back after an hour catches up in five minutes without
crowding the channel."""
MAX_PLANNED = 20 * REPEATS_AT_ONCE
"""Repeats that wait for their time; what finds no room is asked for by the next status."""
MISSES = 4
"""So many repeats that find no room may let a smaller one go first."""
QUIET_US = 800 * MILLISECOND_US
"""A status cannot know of what was on the air so shortly before it."""
TURN_US = 300 * MILLISECOND_US
"""Between one group of robots and the next that may repeat an entry."""
TURNS = 5
"""The owner, then four groups of relays by their ids."""
SPEAKS_US = 5 * SECOND_US
"""An owner whose last status is not older repeats what is asked for the first time alone."""
MANY = 6
"""Entries of one log that are in no chapter, of those that one status asks for."""
PATIENCE = 3
"""Statuses in a row that may ask for the same entry; then the order moves on by one, because
whoever has the first turn may be heard by the others and not by the one who asks."""
OVERDUE_US = 3_500 * MILLISECOND_US
"""A status that is so late was lost; its sender then still lacks what it lacked before ..."""
BELIEVED_US = 5 * SECOND_US
"""... for so long."""


PUSH_LOSS = 0.4
"""From such a loss on entries are said again unasked ..."""
PUSH_EVERY_US = 500 * MILLISECOND_US
"""... so often ..."""
PUSH_US = 20 * SECOND_US
"""... for so long, until everybody says that it has it: at a loss of 0.7 one robot in 600 lacks an
entry after half of that."""
PRESENT_US = 30 * SECOND_US
"""Whose last status is not older may lack something."""


class Place(NamedTuple):
    """Of one entry."""

    robot: int
    epoch: int
    seq: int


@dataclass
class _Repeat:
    """When somebody asked for an entry, when it is our turn to send it, and who still lacks it."""

    asked: int
    due: int
    askers: set[int] = field(default_factory=set)
    is_own_news: bool = False
    """Nobody asked for it."""


@dataclass
class _Question:
    """What a peer lacks, in how many statuses in a row (of those that name the log) it said so, and
    when to answer again."""

    lacking: dict[Place, int]
    again: int
    until: int


class LogRepeats:
    """What one robot is about to repeat.

    Attributes:
        repeated: how many entries it has sent again.
        pace: of all that are sent again in the team.
    """

    def __init__(self, robot: int, logs: Mapping[int, ReplicatedLog]) -> None:
        """
        Args:
            logs: that it holds, by robot.
        """
        self._robot, self._logs = robot, logs
        self._planned: dict[Place, _Repeat] = {}
        self._questions: dict[int, _Question] = {}
        """By the peer that asks."""
        self._spoke: dict[int, int] = {}
        """When each peer sent a status."""
        self._present: dict[int, tuple[int, Holding | None]] = {}
        """When each peer said last what it holds of our log, and what that is."""
        self._pushed: deque[tuple[int, int]] = deque(maxlen=MAX_PLANNED)
        """Our latest entries, and when they were said."""
        self.repeated = 0
        self.pace = Allowance()

    def on_status(
        self, sender: int, named: Mapping[int, Holding], left_out: Set[int], utime: int
    ) -> None:
        """A peer said what it holds: plan to repeat what it lacks.

        Args:
            named: the logs of its status, by robot.
            left_out: robots whose logs had no room in it.
        """
        self._spoke[sender] = utime
        if self._robot not in left_out:
            self._present[sender] = utime, named.get(self._robot)
        last = self._questions.get(sender)
        asked = last.lacking if last else {}
        lacking = {
            place: asked.get(place, 0) + 1 for place in self._lacking(sender, named, left_out)
        }
        still = {place: times for place, times in asked.items() if place.robot in left_out}
        self._questions[sender] = _Question(
            {**still, **lacking}, again=utime + OVERDUE_US, until=utime + BELIEVED_US
        )
        self._forget_answered(sender, named)
        alone = Counter(place.robot for place in lacking if not self._is_of_chapter(place))
        for place, times in lacking.items():
            is_many = alone[place.robot] >= MANY and not self._is_of_chapter(place)
            if not (is_many and self._waits_for_chapter(place.robot, times, utime)):
                self._plan(place, times, utime, sender)

    def _is_of_chapter(self, place: Place) -> bool:
        return self._logs[place.robot].is_of_chapter(place.seq)

    def _waits_for_chapter(self, owner: int, times: int, utime: int) -> bool:
        """Of many entries that are in no chapter yet their owner makes one, if it is there."""
        return owner != self._robot and times < PATIENCE and self._speaks(owner, utime)

    def _forget_answered(self, sender: int, named: Mapping[int, Holding]) -> None:
        """What a peer holds now need not be said for it: we did not hear who said it again."""
        for place, repeat in list(self._planned.items()):
            held = named.get(place.robot)
            if held is not None and held.epoch == place.epoch and held.has(place.seq):
                repeat.askers.discard(sender)
                if not repeat.askers and not repeat.is_own_news:
                    del self._planned[place]

    def _lacking(
        self, sender: int, named: Mapping[int, Holding], left_out: Set[int]
    ) -> Iterable[Place]:
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
            held = log.held_from(start)
            if theirs is not None and theirs.beyond and theirs.epoch == log.epoch:
                held = [seq for seq in held if not theirs.has(seq)]
            for seq in held[:REPEATS_AT_ONCE]:
                yield Place(robot, log.epoch, seq)

    def _plan(self, place: Place, times: int, utime: int, asker: int) -> None:
        is_alone = place.robot == self._robot or not self._speaks(place.robot, utime)
        if times == 1 and not is_alone and self.pace.loss < PUSH_LOSS:
            return
        turn = 0 if place.robot == self._robot else 1 + self._robot % (TURNS - 1)
        wait = (turn - (times - 1) // PATIENCE) % TURNS * TURN_US
        if place in self._planned or len(self._planned) < MAX_PLANNED:
            self._planned.setdefault(place, _Repeat(utime, utime + wait)).askers.add(asker)

    def _speaks(self, robot: int, utime: int) -> bool:
        return utime - self._spoke.get(robot, utime - SPEAKS_US) < SPEAKS_US

    def say_when_there_is_room(self, place: Place, utime: int) -> None:
        """An entry of ours, before anybody asks for it: until it is said, all others see a gap."""
        news = _Repeat(utime + QUIET_US, utime, is_own_news=True)
        self._planned = {place: news, **self._planned}

    def push(self, seq: int, utime: int) -> None:
        """A new entry of ours: said again unasked where most messages are lost."""
        self._pushed.append((seq, utime))

    def _push(self, utime: int) -> None:
        while self._pushed and utime - self._pushed[0][1] > PUSH_US:
            self._pushed.popleft()
        log = self._logs.get(self._robot)
        if self.pace.loss < PUSH_LOSS or log is None:
            return
        present = [held for heard, held in self._present.values() if utime - heard < PRESENT_US]
        for seq, _ in self._pushed:
            is_there = all(h is not None and h.epoch == log.epoch and h.has(seq) for h in present)
            if not is_there and log.is_held(seq) and utime - log.aired[seq] >= PUSH_EVERY_US:
                self.say_when_there_is_room(Place(self._robot, log.epoch, seq), utime)

    def _answer_again(self, utime: int) -> None:
        """Our own entries to those whose next status is overdue."""
        for sender, question in list(self._questions.items()):
            if utime >= question.until:
                del self._questions[sender]
            elif utime >= question.again:
                question.again = utime + SECOND_US
                for place in question.lacking:
                    if place.robot == self._robot:
                        self._plan(place, 1, utime, sender)

    def take_due(self, utime: int) -> list[tuple[int, bytes]]:
        """What to repeat now: owner's id and sealed message."""
        self._answer_again(utime)
        self._push(utime)
        out: list[tuple[int, bytes]] = []
        misses = 0
        for place, repeat in list(self._planned.items()):
            if repeat.due > utime:
                continue
            log = self._logs[place.robot]
            is_there = log.epoch == place.epoch and log.is_held(place.seq)
            if not is_there or log.aired[place.seq] > repeat.asked - QUIET_US:
                del self._planned[place]
                continue
            size, is_one_of_many = len(log.sealed[place.seq]), len(self._planned) > REPEATS_AT_ONCE
            if len(out) == REPEATS_AT_ONCE or misses == MISSES:
                break
            if not self.pace.has_room(utime, size, is_one_of_many=is_one_of_many):
                misses += 1
                continue
            del self._planned[place]
            log.aired[place.seq] = utime
            self.repeated += 1
            self.pace.on_air(size, utime, Speech.AGAIN, self._robot)
            out.append((place.robot, log.sealed[place.seq]))
        return out
