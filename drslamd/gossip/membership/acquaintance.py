"""Who has answered this very start of ours: nobody else is believed.

What a robot said can be recorded and played again later, and everything in it proves true: only a
robot that began after it was said has not seen it before. But such a robot has an epoch that no
recording names. So a peer counts from its first status on that names our start, and what it said
before that status never counts. Until then a robot is a stranger: our status names it, for it must
know that we hear it and wait, and nothing else is taken from it.

A log may come through others, from robots that we do not hear or that are gone. It counts as soon
as an acquaintance holds that very log: that one has its answer, or knows somebody who has.
"""

from __future__ import annotations

from collections.abc import Collection

from drslamd.conventions import SECOND_US, Chain
from drslamd.gossip.message_types import Status
from drslamd.gossip.peer import SILENCE_US, Peer

PATIENCE_US = 10 * SECOND_US
"""A peer that hears us says so within a second or two, at any loss worth living with; and what it
knew of an earlier start of ours it has forgotten."""


class Acquaintance:
    """Strangers, by robot, and what speaks for a recording.

    Attributes:
        strangers: robots that were heard of late and have not answered.
    """

    def __init__(self, own: Chain) -> None:
        self._own = own
        self.strangers: dict[int, Peer] = {}
        self._senders: dict[int, str] = {}
        self._since: dict[int, int] = {}
        self._began: int | None = None
        self._of_the_past: dict[int, int] = {}
        """Who named an earlier start of ours when it should have known better, and when."""

    def answers(self, status: Status) -> bool:
        """Does it name this start of ours? Nothing that was said before it can."""
        own = self._own
        return any((heard.id, heard.epoch) == own for heard in status.heard)

    def hear(self, origin: Chain, sent: int, utime: int, sender: str) -> None:
        """A stranger has spoken."""
        stranger = self.strangers.get(origin.robot)
        if stranger is None or stranger.chain != origin or not stranger.is_alive(utime):
            stranger = self.strangers[origin.robot] = Peer(origin, utime)
            self._since[origin.robot] = utime
        stranger.on_message(sent, utime)
        self._senders[origin.robot] = sender

    def read(self, origin: Chain, status: Status, utime: int) -> None:
        """What a stranger says of us: a robot that lives does not speak of our past for long."""
        self._began = utime if self._began is None else self._began
        if status.leaving:
            self._forget(origin.robot)
        earlier = any(h.id == self._own.robot and h.epoch < self._own.epoch for h in status.heard)
        if earlier and utime - self._began >= PATIENCE_US:
            self._of_the_past[origin.robot] = utime

    def met(self, origin: Chain, utime: int) -> Peer:
        """A robot has answered: from now on a peer, with what its voice told of its clock."""
        stranger = self.strangers.get(origin.robot)
        self._forget(origin.robot)
        return stranger if stranger and stranger.chain == origin else Peer(origin, utime)

    def _forget(self, robot: int) -> None:
        self.strangers.pop(robot, None)
        self._senders.pop(robot, None)
        self._since.pop(robot, None)

    def forget_silent(self, utime: int) -> None:
        for robot in [r for r, p in self.strangers.items() if not p.is_alive(utime)]:
            self._forget(robot)
        of_late = self._of_the_past.items()
        self._of_the_past = {r: t for r, t in of_late if utime - t < PATIENCE_US}

    def waiting(self, utime: int) -> dict[int, str]:
        """Who speaks for long and does not answer, and from where."""
        return {
            robot: self._senders[robot]
            for robot, peer in sorted(self.strangers.items())
            if peer.is_alive(utime) and peer.last_heard - self._since[robot] >= PATIENCE_US
        }

    def recording(self, utime: int) -> str | None:
        """One sentence when what is heard was said long ago."""
        waiting, past = self.waiting(utime), self._of_the_past
        senders = {sender for sender in waiting.values() if sender}
        one_voice = len(waiting) > 1 and len(senders) == 1
        if not one_voice and not any(utime - then < SILENCE_US for then in past.values()):
            return None
        robots = sorted({*waiting, *past})
        where = f" from {' and '.join(sorted(senders))}" if senders else ""
        return (
            f"what is heard{where} as robot {_listed(robots)} was said before this start: somebody "
            "plays a recording; nothing of it is believed"
        )


def _listed(robots: Collection[int]) -> str:
    return ", ".join(map(str, robots))


def vouched(origin: Chain, acquaintances: Collection[Peer]) -> bool:
    """Does any acquaintance hold this log?"""
    return any(peer.holds(origin) for peer in acquaintances)
