"""One id used by two robots: when that is sure, and when it is over.

Two starts of one id that speak at the same time are two robots. What looks like it and is not:

* a robot that began again: its earlier start says nothing any more, though what it said may still
  be under way. So what counts is when a message was made, by the clock of its start, and not when
  it came;
* a recording: only a start that has named this start of ours counts, and what was made before is
  old whenever it comes again;
* a single lie: both have to speak for a second.

A robot that hears its own id from somebody else names that start in its status, as it names all
whom it hears. So the other one sees itself named, and it in turn: both know. Who hears both names
both, and tells those two of each other who do not hear one another.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import combinations

from drslamd.conventions import SECOND_US, Chain
from drslamd.gossip.message_types import UNANSWERED, Heard, Status
from drslamd.gossip.peer import SILENCE_US
from drslamd.gossip.seal import Header

SURE_US = SECOND_US * 9 // 10
"""For so long both speak before it is believed: two statuses in a row, give or take the radio."""
GONE_US = 30 * SECOND_US
"""So long after the last word of one of them the id is used again."""
TOLD_US = GONE_US - SILENCE_US
"""The same from what a peer says, which names for a while who has gone."""
OF_LATE_US = 10 * SECOND_US
"""How long after a message under our own id it is still spoken of."""
VOICES = 4
"""Starts of one id that are told apart; an earlier one that began to speak again is not heard."""
CREEP = 1_000
"""A clock may lose one microsecond in so many; none is so bad."""


class NamesakeFault(Enum):
    TWICE = "of an id that two robots use"


@dataclass
class _Voice:
    """One start.

    Attributes:
        sender: its address.
        sent: when its latest message was made, on its own clock.
        delay_us: the least (arrival here - time there) of late.
        since, latest: when its first and its latest message were made, on our clock.
        heard: when something came from it.
    """

    sender: str
    sent: int
    delay_us: int
    since: int
    latest: int
    heard: int

    def speaks(self, sent: int, utime: int, sender: str) -> None:
        """A copy, whoever sends it, and what was overtaken say nothing new."""
        if sent <= self.sent:
            return
        crept = max(0, utime - self.heard) // CREEP
        self.delay_us = min(self.delay_us + crept, utime - sent)
        self.sent, self.sender = sent, sender
        self.latest = max(self.latest, sent + self.delay_us)
        self.heard = max(self.heard, utime)


@dataclass
class _Told:
    """By one peer: that it hears two robots under our id; since when, and when last."""

    since: int
    latest: int


class Namesakes:
    """Who speaks under which id, as one start, `own`, hears it."""

    def __init__(self, own: Chain) -> None:
        self._own = own
        self._voices: dict[int, dict[int, _Voice]] = {}
        """By robot and epoch; robot ids bound their number."""
        self._several: set[int] = set()
        """Robots of which more than one start was heard."""
        self._over: dict[int, int] = {}
        """Starts that were forgotten, up to this epoch, by robot: not heard again."""
        self._own_id: dict[int, int] = {}
        """When other starts of our id were heard, proven or not whether they live, by epoch."""
        self._own_id_sender = ""
        self._told: dict[int, _Told] = {}

    def hear(self, header: Header, answers: bool, utime: int, sender: str) -> None:
        """A proven message straight from its origin, whatever else may be wrong with it.

        Args:
            answers: does it name this start of ours?
        """
        robot, epoch = header.origin, header.epoch
        if robot == self._own.robot:
            self._hear_own_id(epoch, utime, sender)
        voice = self._voices.get(robot, {}).get(epoch)
        if voice is not None:
            voice.speaks(header.utime, utime, sender)
        elif answers and epoch > self._over.get(robot, -1):
            voices = self._voices.setdefault(robot, {})
            self._make_room(robot, voices)
            voices[epoch] = _Voice(sender, header.utime, utime - header.utime, utime, utime, utime)
            if len(voices) > 1:
                self._several.add(robot)

    def _hear_own_id(self, epoch: int, utime: int, sender: str) -> None:
        self._own_id.pop(epoch, None)
        self._own_id[epoch], self._own_id_sender = utime, sender
        while len(self._own_id) > VOICES:
            del self._own_id[next(iter(self._own_id))]

    def _make_room(self, robot: int, voices: dict[int, _Voice]) -> None:
        if len(voices) >= VOICES:
            oldest = min(voices, key=lambda epoch: voices[epoch].latest)
            del voices[oldest]
            self._over[robot] = max(oldest, self._over.get(robot, oldest))

    def on_status(self, sender: int, status: Status, utime: int) -> None:
        """A peer says whom it hears: two of our id?"""
        of_us = [heard for heard in status.heard if heard.id == self._own.robot]
        epochs = {heard.epoch for heard in of_us}
        are_doubted = all(heard.delay_us == UNANSWERED for heard in of_us)
        if self._own.epoch in epochs and len(epochs) > 1 and are_doubted:
            told = self._told.setdefault(sender, _Told(utime, utime))
            if utime - told.latest >= TOLD_US:
                told.since = utime
            told.latest = utime

    @property
    def latest(self) -> dict[int, dict[int, int]]:
        """When the latest message of each start was made, by robot and epoch."""
        return {r: {e: v.latest for e, v in of.items()} for r, of in self._voices.items()}

    # who is there twice

    def twice(self, utime: int) -> set[int]:
        """Ids that two robots use, our own among them."""
        others = {r for r in self._several if r != self._own.robot and self._pair(r, utime)}
        return others | {self._own.robot} if self.is_own_id_used(utime) else others

    def fault(self, robot: int, utime: int) -> NamesakeFault | None:
        """May another robot be listened to?"""
        is_twice = robot in self._several and self._pair(robot, utime) is not None
        return NamesakeFault.TWICE if is_twice else None

    def is_own_id_used(self, utime: int) -> bool:
        """Does another robot live under our id, for sure?"""
        return self._rival(utime) is not None or self._teller(utime) is not None

    def is_own_id_heard(self, utime: int) -> bool:
        """Was anything heard of late under our id, be it a recording?"""
        return any(utime - then < OF_LATE_US for then in self._own_id.values())

    def _pair(self, robot: int, utime: int) -> tuple[_Voice, _Voice] | None:
        """Two starts of one robot that speak at the same time."""
        alive = [v for v in self._voices[robot].values() if utime - v.latest < GONE_US]
        for a, b in combinations(alive, 2):
            if min(a.latest, b.latest) - max(a.since, b.since) >= SURE_US:
                return a, b
        return None

    def _rival(self, utime: int) -> _Voice | None:
        for voice in self._voices.get(self._own.robot, {}).values():
            if utime - voice.latest < GONE_US and voice.latest - voice.since >= SURE_US:
                return voice
        return None

    def _teller(self, utime: int) -> int | None:
        for robot, told in self._told.items():
            if utime - told.latest < TOLD_US and told.latest - told.since >= SURE_US:
                return robot
        return None

    # what is said of it

    def named(self, utime: int) -> set[Chain]:
        """Starts to be named in our status beside those of our peers."""
        own = {
            Chain(self._own.robot, epoch)
            for epoch, then in self._own_id.items()
            if utime - then < SILENCE_US
        }
        others = {
            Chain(robot, epoch)
            for robot in self.twice(utime) - {self._own.robot}
            for epoch, voice in self._voices[robot].items()
            if utime - voice.heard < SILENCE_US
        }
        return own | others

    def conditions(self, utime: int) -> list[tuple[str, str | None]]:
        """What must be spoken of, by key, in sentences with a remedy."""
        others = sorted(self.twice(utime) - {self._own.robot})
        said = [self._of_another(robot, utime) for robot in others]
        return [
            ("team.own_id_used", self._of_us(utime)),
            ("team.id_used_twice", "; ".join(said) or None),
        ]

    def _of_us(self, utime: int) -> str | None:
        own, rival, teller = self._own.robot, self._rival(utime), self._teller(utime)
        if rival is None and teller is None:
            if not self.is_own_id_heard(utime):
                return None
            return (
                f"hears messages under its own id {own} that it did not make, from "
                f"{self._own_id_sender or 'an unknown sender'}: another robot uses the id and does "
                "not hear this one, or somebody plays a recording; give every robot a robot.id of "
                "its own"
            )
        where = f"as robot {teller} hears"
        if rival is not None:
            where = f"at {rival.sender or 'an unknown address'}"
        return (
            f"another robot uses id {own}, {where}: neither says its pose, and nobody uses them; "
            "give every robot a robot.id of its own"
        )

    def _of_another(self, robot: int, utime: int) -> str:
        pair = self._pair(robot, utime)
        senders = sorted({v.sender for v in pair or () if v.sender})
        where = f", at {' and '.join(senders)}" if senders else ""
        return (
            f"two robots use id {robot}{where}: neither is believed; give every robot a robot.id "
            "of its own"
        )


def unanswered(chain: Chain) -> Heard:
    """As a status names whom it hears and does not believe."""
    return Heard(*chain, UNANSWERED)
