"""What an onlooker believes of what it hears: all that its key proves, or, without one, all that
could be true.

An onlooker has no id and sends nothing. With the key of the team it judges a message as a robot
does (`drslamd.gossip.seal`); without one it cannot tell who made a message, takes what is well
formed, and the page says so.
"""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple, Union

from drslamd.conventions import SECOND_US, Chain
from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02, messages
from drslamd.gossip.envelopes.opening import unframed
from drslamd.gossip.messages import Message
from drslamd.gossip.seal import Header, Seal, SealFault, header_of, team_key

NOBODY = -1
"""The id of an onlooker: no robot has it."""
LATELY_US = 10 * SECOND_US
"""How long after a message that was refused it is still spoken of."""
ANOTHER_START_US = 3 * SECOND_US
"""Without a key: silence of a robot after which an earlier start of it may speak."""
_FINGERPRINTS = {kind: frozenset([value]) for kind, value in messages.FINGERPRINTS.items()}

_REMEDIES = {
    SealFault.WRONG_TAG: "messages from {sender} do not fit the team key and are not shown; "
    "they are another team's, or made up",
    SealFault.WRONG_VERSION: "messages from {sender} are of another version of drslamd and are not "
    "shown; install the same version here and on all robots",
}
"""Refusals that somebody must do something about."""


class Said(NamedTuple):
    """One message that is believed.

    Attributes:
        origin: who made it; utime: when, on that robot's clock, us.
    """

    origin: Chain
    utime: int
    message: Message


class Hearing:
    """Judges everything that comes in.

    Attributes:
        accepted, octets: messages that were believed, and their bytes.
        refused: the others, by reason.
    """

    def __init__(self, secret: bytes | None, verifies: bool) -> None:
        """
        Args:
            secret: of the team, None for a team without one.
            verifies: False believes whatever is well formed.
        """
        self.verifies = verifies
        self.accepted = self.octets = 0
        self.refused: Counter[str] = Counter()
        self._seal = Seal(team_key(secret), NOBODY, 0, {})
        self._starts: dict[int, tuple[int, int]] = {}
        """By robot, without a key: its start, and when that last spoke; ids bound their number."""
        self._last: dict[SealFault, tuple[int, str]] = {}

    def receive(self, event: Union[Datagram, ChannelMessage]) -> Said | None:
        """Judge one message; whatever is wrong with it is counted by its reason."""
        verdict = self._judged(event)
        if isinstance(verdict, str):
            self.refused[verdict] += 1
            return None
        self.accepted += 1
        return verdict

    def _judged(self, event: Union[Datagram, ChannelMessage]) -> Said | str:
        framed = unframed(event)
        if isinstance(framed, lc02.FramingFault):
            return framed.value
        channel, payload = framed
        kind = messages.kind_of_channel(channel)
        if kind is None:
            return "channel of another program"
        once = kind != "GRAPH"
        header = self._header(channel, payload, kind, once, event.utime)
        if isinstance(header, SealFault):
            if header in _REMEDIES:
                self._last[header] = event.utime, event.sender or "an unknown sender"
            return header.value
        message = messages.decode(kind, payload)
        if isinstance(message, str):
            return "content out of range"
        if channel != messages.channel(kind, header.origin):
            return "channel of another robot"
        if self.verifies:
            self._seal.accept(header, once)
        elif once:
            self._starts[header.origin] = header.epoch, event.utime
        self.octets += len(payload)
        return Said(Chain(header.origin, header.epoch), header.utime, message)

    def _header(
        self, channel: str, payload: bytes, kind: str, once: bool, utime: int
    ) -> Header | SealFault:
        if self.verifies:
            return self._seal.judge(channel, payload, _FINGERPRINTS[kind], once)
        header = header_of(payload, _FINGERPRINTS[kind])
        if isinstance(header, Header):
            epoch, spoke = self._starts.get(header.origin, (header.epoch, utime))
            if header.epoch < epoch and (not once or utime - spoke < ANOTHER_START_US):
                return SealFault.OLD_EPOCH
        return header

    def trust(self) -> str:
        """Whether what is shown is proven, in a sentence."""
        if self.verifies:
            return "every message was proven with the team key"
        return "not verified: whoever is on the network can make up what is shown here"

    def problems(self, utime: int) -> list[str]:
        """What was refused of late and should not have to be, in sentences."""
        return [
            _REMEDIES[fault].format(sender=sender)
            for fault, (when, sender) in self._last.items()
            if utime - when < LATELY_US
        ]
