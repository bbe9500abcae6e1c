"""What one robot said of itself since it started: its keyframes, and what its sensors are like."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.graph.tables import KeyedRows, KeyframeTable, positions
from drslamd.slam.odometry.noise import growth
from drslamd.slam.robot_model import UNTOLD, RobotModel
from drslamd.slam.se2 import Array

MAX_KEYFRAMES = 4_000
"""Of one chain: over an hour of driving at one a second; the oldest are forgotten."""


class ChainData:
    """One chain.

    Attributes:
        model: of its sensors, as it last said.
    """

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.model = UNTOLD
        self._model_seq = -1
        self._table = KeyedRows(5, MAX_KEYFRAMES)
        self._rows = self._table.data
        self._sums = np.empty((0, 6))
        self._source = self._rows
        self._kept_n, self._kept_detours = np.zeros(0), np.zeros((0, 6))

    def add(self, k: Keyframe) -> None:
        metres, radians = TRANSLATION_STEP_M, ROTATION_STEP_RAD
        self._table.add([k.n, k.segment, k.x * metres, k.y * metres, k.theta * radians])

    def take_model(self, seq: int, model: RobotModel) -> None:
        """What the robot says of its sensors in log entry `seq`; the latest entry counts."""
        if seq > self._model_seq and model.is_plausible():
            self._model_seq, self.model = seq, model

    @property
    def keyframes(self) -> KeyframeTable:
        """All of them."""
        self._renew()
        return KeyframeTable(self._rows)

    @property
    def sums(self) -> Array:
        """(k, 6) `noise.growth` along the chain; only differences within a segment count."""
        self._renew()
        return self._sums

    def _renew(self) -> None:
        table = self._table.data
        if table is self._source:
            return
        rows, known = table.copy(), self._rows
        # a segment never comes back, so each is one block of rows whatever its robot says
        rows[:, 1] = np.maximum.accumulate(rows[:, 1])
        sums = growth(rows[:, 2:]) + self._detours(rows[:, 0])
        if len(known):
            # what came late in front of the known rows, or was dropped there, moves no sum
            at, there = positions(rows[:, 0], known[:, 0])
            if there.any():
                first = int(np.argmax(there))
                sums += self._sums[first] - sums[at[first]]
        self._rows, self._sums, self._source = rows, sums, table

    def keep(self, stays: NDArray[np.bool_]) -> None:
        """Forget the keyframes (k,) that do not stay; the sums of the others do not change."""
        self._renew()
        self._rows, self._sums = self._rows[stays], self._sums[stays]
        self._table.replace(self._rows)
        self._source = self._table.data
        # from now on straight links stand for the way that was gone
        self._kept_n = self._rows[:, 0]
        self._kept_detours = self._sums - growth(self._rows[:, 2:])

    def _detours(self, n: Array) -> Array:
        """(k, 6) what is missing of `growth` at keyframes n (k,) since some were forgotten."""
        if not len(self._kept_n):
            return np.zeros((len(n), 6))
        at = np.searchsorted(self._kept_n, n, side="right") - 1
        return np.asarray(self._kept_detours[np.maximum(at, 0)])
