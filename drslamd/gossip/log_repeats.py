"""Who repeats a lost log entry, and when.

Each status names how far its sender has got with every log. Whoever holds what it lacks sends it
again, sealed as it came: the owner at once, and once a second until the next status comes; the
others a little later, in groups by their ids, and only if nobody else did.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import NamedTuple

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.gossip.message_types import LogState
from drslamd.gossip.replicated_log import ReplicatedLog
from drslamd.slam.graph.chapters import SPAN

REPEATS_AT_ONCE = 12
"""Entries of one log that one status of a lagging peer asks for, and all that one call of
`take_due` hands out: a robot that comes back after an hour catches up in five minutes without
crowding the channel."""
FAR = 2 * SPAN
"""A peer that lags by more entries is first told the latest chapter."""
MAX_PLANNED = 20 * REPEATS_AT_ONCE
"""Repeats that wait for their time; what finds no room is asked for by the next status."""
QUIET_US = 800 * MILLISECOND_US
"""A status cannot know of what was on the air so shortly before it."""
TURN_US = 300 * MILLISECOND_US
"""Between one group of robots and the next that may repeat an entry."""
TURNS = 5
"""The owner, then four groups of relays by their ids."""
PATIENCE = 3
"""Statuses in a row that may ask for the same entry; then the order moves on by one, because
whoever has the first turn may be heard by the others and not by the one who asks."""
OVERDUE_US = 3_500 * MILLISECOND_US
"""A status that is so late was lost; its sender then still lacks what it lacked before ..."""
BELIEVED_US = 5 * SECOND_US
"""... for so long."""


LEAST_RATE = 1_500
"""Bytes a second that repeats may have where hardly anything else is said."""
MOST_LOSS = 0.8
"""That is reckoned with."""
LOOK_BACK_S = 5.0
"""Over which it is counted what else is said."""


class Allowance:
    """How many bytes of repeats a team sends together: as many as it says anyhow.

    Everybody counts what is on the air, its own messages and what it hears, so that those who heal
    a partition or fill a newcomer share one allowance. Where messages are lost it grows: entries
    then need several repeats.

    Attributes:
        loss: share of the messages that are lost, 0 to 1.
    """

    def __init__(self) -> None:
        self.loss = 0.0
        self._rate, self._level, self._utime = 0.0, 0.0, 0
        self._own_utime = 0
        """When a repeat of ours went out last."""

    def _pass(self, utime: int) -> None:
        passed = max(0, utime - self._utime) / SECOND_US
        self._utime = max(utime, self._utime)
        allowed = max(self._rate, LEAST_RATE) * (1 + 3 * self.loss) / (1 - self.loss)
        # the debt ends: whoever floods the channel with repeats silences nobody for long
        self._level = min(max(self._level, -allowed) + allowed * passed, allowed / 4)
        self._rate *= max(0.0, 1 - passed / LOOK_BACK_S)

    def reckon(self, losses: Sequence[float]) -> None:
        """How much of what each peer says is lost."""
        self.loss = min(sum(losses) / max(1, len(losses)), MOST_LOSS)

    def on_air(self, size: int, utime: int, *, repeated: bool = False, heard: bool = False) -> None:
        """A message of so many bytes; of what is heard others were not."""
        self._pass(utime)
        bytes_sent = size / (1 - self.loss) if heard else size
        if repeated and not heard:
            self._own_utime = utime
        if repeated:
            self._level -= bytes_sent
        else:
            self._rate += bytes_sent / LOOK_BACK_S

    def has_room(self, utime: int) -> bool:
        """May another repeat go out? One of ours each second always may."""
        self._pass(utime)
        return self._level > 0 or utime - self._own_utime >= SECOND_US


class Place(NamedTuple):
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
        self.repeated = 0
        self.pace = Allowance()

    def on_status(
        self, sender: int, named: Mapping[int, LogState], left_out: Set[int], utime: int
    ) -> None:
        """A peer said what it holds: plan to repeat what it lacks.

        Args:
            named: the logs of its status, by robot.
            left_out: robots whose logs had no room in it.
        """
        last = self._questions.get(sender)
        asked = last.lacking if last else {}
        lacking = {
            place: asked.get(place, 0) + 1 for place in self._lacking(sender, named, left_out)
        }
        still = {place: times for place, times in asked.items() if place.robot in left_out}
        self._questions[sender] = _Question(
            {**still, **lacking}, again=utime + OVERDUE_US, until=utime + BELIEVED_US
        )
        for place, times in lacking.items():
            self._plan(place, times, utime)

    def _lacking(
        self, sender: int, named: Mapping[int, LogState], left_out: Set[int]
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
            lacked = log.held_from(start)[:REPEATS_AT_ONCE]
            if log.latest > start + FAR and log.is_held(log.latest):
                # by this one a peer knows what it need not wait for
                lacked = [log.latest, *lacked[: REPEATS_AT_ONCE - 1]]
            for seq in lacked:
                yield Place(robot, log.epoch, seq)

    def _plan(self, place: Place, times: int, utime: int) -> None:
        turn = 0 if place.robot == self._robot else 1 + self._robot % (TURNS - 1)
        wait = (turn - (times - 1) // PATIENCE) % TURNS * TURN_US
        if len(self._planned) < MAX_PLANNED:
            self._planned.setdefault(place, _Repeat(utime, utime + wait))

    def say_when_there_is_room(self, place: Place, utime: int) -> None:
        """An entry of ours that nobody waits for: said in its turn, as if it was asked for."""
        self._planned[place] = _Repeat(utime + QUIET_US, utime)

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

    def take_due(self, utime: int) -> list[tuple[int, bytes]]:
        """What to repeat now: owner's id and sealed message."""
        self._answer_again(utime)
        out: list[tuple[int, bytes]] = []
        for place, repeat in list(self._planned.items()):
            if len(out) == REPEATS_AT_ONCE or not self.pace.has_room(utime):
                break
            if repeat.due > utime:
                continue
            del self._planned[place]
            log = self._logs[place.robot]
            if log.epoch != place.epoch or not log.is_held(place.seq):
                continue
            if log.aired[place.seq] <= repeat.asked - QUIET_US:
                log.aired[place.seq] = utime
                self.repeated += 1
                self.pace.on_air(len(log.sealed[place.seq]), utime, repeated=True)
                out.append((place.robot, log.sealed[place.seq]))
        return out
