"""What outlives a start of a robot: epochs of everybody, and what was learned of its sensors."""

from __future__ import annotations

from typing import Any

from drslamd.conventions import Chain
from drslamd.events import Effect, Save, SaveDone
from drslamd.gossip.epochs import kept_epochs
from drslamd.gossip.seal import Seal
from drslamd.slam.calibration.calibration_store import CalibrationStore


class Memory:
    """Of one robot.

    Attributes:
        fault: why nothing can be kept; empty while all is well.
    """

    def __init__(self, own: Chain, seal: Seal, calibration: CalibrationStore) -> None:
        self.fault = ""
        self._own, self._seal, self._calibration = own, seal, calibration
        self._saved_epochs = dict(seal.epochs)

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
        return []
