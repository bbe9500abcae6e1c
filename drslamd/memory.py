"""What outlives a start of a robot: epochs, what was learned of its sensors, and its place."""

from __future__ import annotations

from typing import Any

from drslamd.conventions import GRID_HZ, SECOND_US, Chain
from drslamd.events import Effect, Save, SaveDone
from drslamd.gossip.epochs import kept_epochs
from drslamd.gossip.seal import Seal
from drslamd.slam.calibration.calibration_store import CalibrationStore
from drslamd.slam.relocation.last_place import LastPlace

LISTEN_US = 10 * SECOND_US
"""How long a start says nothing whose number could not be kept: peers name the later one that they
know within five seconds, and where messages are lost a little later."""

MOVED = 5 * GRID_HZ
"""Samples, five seconds of them: where a robot is that drove on is worth a write."""


class Memory:
    """Of one robot.

    A start whose number is nowhere kept may have one that was used before. So it listens first:
    peers that know as late a one say so, and then another start begins above it
    (`drslamd.gossip.starts`), before anything was said under this one.

    Attributes:
        fault: why nothing can be kept; empty while all is well.
        place: where we were when that was last known.
    """

    def __init__(
        self, own: Chain, seal: Seal, calibration: CalibrationStore, place: LastPlace | None = None
    ) -> None:
        self.fault = ""
        self.place = place
        self._at = self._saved_at = 0
        self._own, self._seal, self._calibration = own, seal, calibration
        self._saved_epochs = dict(seal.epochs)
        self._listens_until: int | None = None

    def is_listening(self, utime: int) -> bool:
        """Has nothing to be said yet?"""
        return self._listens_until is not None and utime < self._listens_until

    def state(self) -> dict[str, Any]:
        """What must be kept."""
        state = {"epoch": self._own.epoch, "epochs": kept_epochs(self._seal.epochs)}
        place = self.place.state() if self.place else {}
        return {**state, "calibration": self._calibration.latest.state(), "place": place}

    def remember(self, place: LastPlace | None, n: int) -> None:
        """Where we are now, if that is known.

        Args:
            n: our last keyframe: who stands makes none.
        """
        if place is not None:
            self.place, self._at = place, n

    def save(self) -> list[Save]:
        """Keep it, if there is anything new."""
        has_moved = self._at - self._saved_at >= MOVED
        is_known = self._seal.epochs == self._saved_epochs and not self._calibration.is_news()
        if is_known and not has_moved:
            return []
        self._saved_at = self._at
        self._calibration.on_saved()
        self._saved_epochs = dict(self._seal.epochs)
        return [Save(self.state())]

    def on_saved(self, done: SaveDone) -> list[Effect]:
        """What was to be kept is kept, or cannot be."""
        self.fault = done.fault
        if done.fault and not self._seal.has_spoken:
            self._listens_until = done.utime + LISTEN_US
        return []
