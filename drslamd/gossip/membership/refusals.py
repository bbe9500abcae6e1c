"""What was turned away, counted by its reason, and what somebody must do about it."""

from __future__ import annotations

from collections import Counter
from typing import Union

from drslamd.conventions import SECOND_US
from drslamd.gossip.membership.namesakes import NamesakeFault
from drslamd.gossip.seal import SealFault
from drslamd.gossip.starts import StartFault

Fault = Union[SealFault, StartFault, NamesakeFault]

UNVERIFIED_US = 10 * SECOND_US
"""How long after a message that does not fit the team key it is still spoken of."""

_REMEDIES: dict[Fault, str] = {
    SealFault.WRONG_TAG: "hears messages that do not fit the team key, from {sender}; "
    "give all robots the same team.key_file",
    SealFault.WRONG_VERSION: "hears messages of another version of drslamd, from {sender}; "
    "install the same version on all robots",
    StartFault.BEYOND_CLOCKS: "hears a start that no clock can show, from {sender}; its state file "
    "is damaged, or somebody who can seal messages makes them up",
}
"""Refusals that somebody must do something about."""


class Refusals:
    """
    Attributes:
        counts: messages that were turned away, by reason.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._last: dict[Fault, tuple[int, str]] = {}

    def add(self, fault: Fault, utime: int, sender: str) -> None:
        self.counts[fault.value] += 1
        self._last[fault] = (utime, sender)

    def is_of_late(self, fault: Fault, utime: int) -> bool:
        when, _ = self._last.get(fault, (None, ""))
        return when is not None and utime - when < UNVERIFIED_US

    def conditions(self, utime: int) -> list[tuple[str, str | None]]:
        """What must be spoken of, by key, in sentences with a remedy."""
        out: list[tuple[str, str | None]] = []
        for fault, sentence in _REMEDIES.items():
            _, sender = self._last.get(fault, (0, ""))
            text = sentence.format(sender=sender or "an unknown sender")
            out.append(
                (f"team.{fault.name.lower()}", text if self.is_of_late(fault, utime) else None)
            )
        return out
