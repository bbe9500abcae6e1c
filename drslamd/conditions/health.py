"""What is wrong, in sentences, and when to say so: when it begins, and now and then after that.

A condition is a key with a sentence that names the fault and its remedy, or None while all is well.
The same sentences stand in the log and in `drslamd status`.
"""

from __future__ import annotations

from dataclasses import dataclass

from drslamd.conventions import SECOND_US
from drslamd.events import Level, Note

REPEAT_US = 60 * SECOND_US
MAX_CONDITIONS = 512
"""Keys name our own ports and stages and the at most 255 ids of a team."""


CAUSES_FIRST = (
    "team.own_id_used",
    "team.id_used_twice",
    "uwb",
    "wheels",
    "gyro",
    "wheels.slip",
    "wheels.track",
    "network",
    "sleep",
    "team.flood",
    "team.recording",
    "team.wrong_tag",
    "team.wrong_version",
    "team.uwb_id",
    "team.beyond_clocks",
    "mounting",
    "budget",
    "load",
    "doubt",
    "odometry",
    "sight",
    "partners",
    "pose",
    "site",
    "state",
)
"""Each may be why those behind it hold: a robot without a port is not localised either."""
_RANKS = {key: rank for rank, key in enumerate(CAUSES_FIRST)}


@dataclass
class _Condition:
    sentence: str
    since: int
    noted: int


class Health:
    """The conditions that hold now."""

    def __init__(self) -> None:
        self._conditions: dict[str, _Condition] = {}

    def set(self, key: str, sentence: str | None, utime: int) -> list[Note]:
        """State a condition anew; what should be logged about it."""
        known = self._conditions.get(key)
        if sentence is None:
            if known is None:
                return []
            del self._conditions[key]
            return [
                Note(Level.INFO, f"{key}.well", {"after_s": (utime - known.since) // SECOND_US})
            ]
        if known is None:
            if len(self._conditions) >= MAX_CONDITIONS:
                return []
            self._conditions[key] = _Condition(sentence, utime, utime)
            return [Note(Level.WARNING, f"{key}.fault", {"what": sentence})]
        due = utime - known.noted >= REPEAT_US
        known.sentence = sentence
        if not due:
            return []
        known.noted = utime
        return [
            Note(
                Level.WARNING,
                f"{key}.fault",
                {"what": sentence, "for_s": (utime - known.since) // SECOND_US},
            )
        ]

    def sentences(self) -> dict[str, str]:
        """What holds now, by key, causes first."""
        return {key: self._conditions[key].sentence for key in self._ranked()}

    def ages_us(self, utime: int) -> dict[str, int]:
        """For how long each has held, in the same order."""
        return {key: utime - self._conditions[key].since for key in self._ranked()}

    def _ranked(self) -> list[str]:
        return sorted(self._conditions, key=lambda key: (_RANKS.get(key, len(_RANKS)), key))
