"""What outlives a start of a robot: epochs of everybody, and what was learned of its sensors."""

from __future__ import annotations

from typing import Any

from drslamd.conventions import SECOND_US, Chain
from drslamd.events import Effect, Save, SaveDone
from drslamd.gossip.epochs import kept_epochs
from drslamd.gossip.seal import Seal
from drslamd.slam.calibration.calibration_store import CalibrationStore

LISTEN_US = 10 * SECOND_US
"""How long a start says nothing whose number could not be kept: peers name the later one that they
know within five seconds, and where messages are lost a little later."""


class Memory:
    """Of one robot.

    A start whose number is nowhere kept may have one that was used before. So it listens first:
    peers that know as late a one say so, and then another start begins above it
    (`drslamd.gossip.starts`), before anything was said under this one.

    Attributes:
        fault: why nothing can be kept; empty while all is well.
    """

    def __init__(self, own: Chain, seal: Seal, calibration: CalibrationStore) -> None:
        self.fault = ""
        self._own, self._seal, self._calibration = own, seal, calibration
        self._saved_epochs = dict(seal.epochs)
        self._listens_until: int | None = None

    def is_listening(self, utime: int) -> bool:
        """Has nothing to be said yet?"""
        return self._listens_until is not None and utime < self._listens_until

    def state(self) -> dict[str, Any]:
        """What must be kept."""
        state = {"epoch": self._own.epoch, "epochs": kept_epochs(self._seal.epochs)}
        return {**state, "calibration": self._calibration.latest.state()}

    def save(self) -> list[Save]:
        """Keep it, if there is anything new."""
        if self._seal.epochs == self._saved_epochs and not self._calibration.is_news():
            return []
        self._calibration.on_saved()
        self._saved_epochs = dict(self._seal.epochs)
        return [Save(self.state())]

    def on_saved(self, done: SaveDone) -> list[Effect]:
        """What was to be kept is kept, or cannot be."""
        self.fault = done.fault
        if done.fault and not self._seal.has_spoken:
            self._listens_until = done.utime + LISTEN_US
        return []
