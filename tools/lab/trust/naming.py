"""What sentences say of a fault: that there is one, what it is, which key of which robot to set.

The robots' sentences are plain English, so they are looked through for words. What may be said of
which fault stands with the fault (`Cause`), and nowhere else.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

KEYS = frozenset(
    {
        "wheels.reverse_left",
        "wheels.reverse_right",
        "wheels.swap_channels",
        "wheels.track_m",
        "wheels.counts_per_metre",
        "uwb.antenna_x_m",
        "uwb.antenna_y_m",
    }
)
"""What people get wrong when they mount and configure a robot."""

OF_THE_START = re.compile(r"^not localised|yet:|^no bytes|^nothing from")
"""Sentences of a robot that was just switched on; only keys in them say anything of a fault."""
KEY = re.compile(r"\b(?:wheels|uwb)\.[a-z_]+\b")
ROBOTS = re.compile(r"\brobots? ((?:\d+(?:, | and | or )?)+)")


class Said(NamedTuple):
    """A sentence that a robot says in a second of the run."""

    t: float
    robot: int
    sentence: str


@dataclass(frozen=True)
class Cause:
    """What may be said of a fault.

    Attributes:
        about: words (a pattern), one of which is in every sentence about it.
        named: one of which is in a sentence that says what it is; empty where keys say it.
        keys: sets of keys, each of which makes it right.
    """

    about: str = ""
    named: str = ""
    keys: frozenset[frozenset[str]] = frozenset()

    def is_about(self, said: Said) -> bool:
        return bool(self.about) and _has(self.about, said)

    def is_named(self, said: Said, robots: frozenset[int]) -> bool:
        """Does it say what the fault of these robots is?"""
        if self.keys:
            return is_right(said, self, robots)
        return bool(self.named) and _has(self.named, said)


NO_CAUSE = Cause()


def _has(words: str, said: Said) -> bool:
    return not OF_THE_START.search(said.sentence) and re.search(words, said.sentence) is not None


def keys(said: Said) -> frozenset[str]:
    """Keys of a mounting that a sentence tells to look at."""
    return KEYS & frozenset(KEY.findall(said.sentence))


def robots(said: Said) -> frozenset[int]:
    """Whom a sentence is about: the robots that it names, else the one that says it."""
    named = {int(n) for found in ROBOTS.findall(said.sentence) for n in re.findall(r"\d+", found)}
    if not named or "this robot" in said.sentence:
        named.add(said.robot)
    return frozenset(named)


def is_right(said: Said, cause: Cause, at_fault: frozenset[int]) -> bool:
    """Does it name keys that make it right, of a robot at fault (or of some with such a one)?"""
    return keys(said) in cause.keys and bool(robots(said) & at_fault)


def wrong_names(said: Iterable[Said], cause: Cause, at_fault: frozenset[int]) -> list[Said]:
    """Sentences that name a key which is not at fault."""
    return [s for s in said if keys(s) and not is_right(s, cause, at_fault)]
