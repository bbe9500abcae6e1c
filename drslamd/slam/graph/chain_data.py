"""What one robot said of itself since it started: its keyframes, and what its sensors are like."""

from __future__ import annotations

import numpy as np

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.slam.graph.chapters.replaced_entries import ReplacedEntries, Span
from drslamd.slam.graph.measurements import Chapter, Keyframe
from drslamd.slam.graph.said_rows import SaidRows
from drslamd.slam.graph.tables import KeyframeTable, positions
from drslamd.slam.graph.timed_rows import NEVER
from drslamd.slam.odometry.noise import SUMS, growth
from drslamd.slam.robot_model import UNTOLD, RobotModel
from drslamd.slam.se2 import Array

MAX_KEYFRAMES = 40_000
"""Of one chain, 1.6 MB: more than there are seconds in what is held (`timed_rows.HELD_BLOCKS`), so
that only a robot which says several a second loses any by it."""


class ChainData:
    """One chain.

    Attributes:
        model: of its sensors, as it last said.
    """

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.model = UNTOLD
        self._model_seq = -1
        self._said = SaidRows(5, identity=1, most=MAX_KEYFRAMES)
        self._replaced = ReplacedEntries()
        self._table = KeyframeTable(np.empty((0, 5)))
        self._table_changes = 0
        self._sums, self._summed_n = np.empty((0, SUMS)), np.empty(0)
        self._summed = 0
        """So many rows from the first on are those that were summed."""

    def add(self, k: Keyframe, entry: int = 0) -> None:
        """A keyframe, as an entry of its log says it."""
        metres, radians = TRANSLATION_STEP_M, ROTATION_STEP_RAD
        self._said.say([k.n, k.segment, k.x * metres, k.y * metres, k.theta * radians], entry)

    def stands_for(self, seq: int) -> bool:
        """Does a chapter stand for this entry of its log?"""
        return self._replaced.has(seq)

    def take_part(self, seq: int, chapter: Chapter) -> tuple[Span, ...]:
        """Entry `seq` is part of a chapter: what chapters stand for now and did not before."""
        return self._replaced.take(seq, chapter)

    def replace(self, spans: tuple[Span, ...]) -> None:
        """What only these entries said of the robot's way goes; how it grew up to what stays is
        known as before."""
        sums = self.sums
        if not self._said.replace(spans):
            return
        rows, known = self._said.rows.copy(), self._table.rows[:, 0]
        rows[:, 1] = np.maximum.accumulate(rows[:, 1])
        at, _ = positions(known, rows[:, 0])
        self._table, self._table_changes = KeyframeTable(rows), self._said.changes
        self._sums, self._summed, self._summed_n = sums[at], len(at), rows[:, 0]

    def take_model(self, seq: int, model: RobotModel) -> None:
        """What the robot says of its sensors in log entry `seq`; the latest entry counts."""
        if seq > self._model_seq and model.is_plausible():
            if model.noise.gyro_span != self.model.noise.gyro_span:
                self._summed, self._sums, self._summed_n = 0, np.empty((0, SUMS)), np.empty(0)
            self._model_seq, self.model = seq, model

    @property
    def changes(self) -> int:
        """See `is_same`."""
        return self._said.changes

    def is_same(self, changes: int, first: int, end: int) -> bool:
        """Are keyframes first .. end - 1 those of when there were so many `changes`?"""
        return self._said.is_same(changes, first, end)

    def unchanged_before(self, changes: int) -> int:
        """Keyframes before this sample are those of when there were so many `changes`."""
        return self._said.unchanged_before(changes)

    @property
    def keyframes(self) -> KeyframeTable:
        """All of them; the same table until one is added."""
        said, known = self._said, self._table.rows
        if said.changes == self._table_changes:
            return self._table
        # most often something came at the end, and all before it is as it was
        changed = said.unchanged_before(self._table_changes)
        same = int(np.searchsorted(known[:, 0], changed))
        rows = np.concatenate([known[:same], said.between(changed, NEVER)])
        # a segment never comes back, so each is one block of rows whatever its robot says
        tail = max(same - 1, 0)
        rows[tail:, 1] = np.maximum.accumulate(rows[tail:, 1])
        self._table, self._table_changes = KeyframeTable(rows), said.changes
        self._summed = min(self._summed, _as_long(known[:, 0], rows[:, 0]))
        return self._table

    @property
    def sums(self) -> Array:
        """(k, 13) `noise.growth` along the chain; only differences within a segment count."""
        rows, known = self.keyframes.rows, self._sums
        if self._summed == len(rows) == len(known):
            return known
        if self._summed:
            last = self._summed - 1
            grown = self._growth(rows[last:]) + known[last]
            sums = np.concatenate([known[:last], grown])
        else:
            sums = self._growth(rows)
            # what came late in front of the known rows, or was dropped there, moves no sum
            at, there = positions(rows[:, 0], self._summed_n)
            if there.any():
                first = int(np.argmax(there))
                sums += known[first] - sums[at[first]]
        self._sums, self._summed, self._summed_n = sums, len(rows), rows[:, 0]
        return sums

    def _growth(self, rows: Array) -> Array:
        """Along rows of `KeyframeTable`."""
        gyro = self.model.noise.gyro
        return growth(rows[:, 2:], None if gyro is None else gyro.seconds(rows[:, 0], rows[:, 2:]))


def _as_long(one: Array, other: Array) -> int:
    """How many numbers two arrays share from their beginnings on: a chapter says keyframes again a
    millimetre away, and how the way to them grew is known better without it."""
    both = min(len(one), len(other))
    differ = np.flatnonzero(one[:both] != other[:both])
    return int(differ[0]) if len(differ) else both
