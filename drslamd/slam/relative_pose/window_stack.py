"""Windows of several pairs as one: what numpy does for the ranges of one window takes it less time
than to be asked, so one question is asked for all of them.

Shorter windows are filled up to the longest. What fills them is nowhere looked at, or weighs
nothing. What is computed for several poses of each window, all in one row, is told apart by
`Groups`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.relative_pose.window import Window
from drslamd.slam.se2 import Array, Index


class Groups:
    """Rows of several windows, those of one window beside each other.

    Attributes:
        of: (k,) the window of each row, ascending.
        starts: (g,) the first row of each window that has any.
    """

    def __init__(self, of: Index) -> None:
        self.of = of
        if len(of) and of[0] == of[-1]:
            self.starts, self._group = np.zeros(1, dtype=np.int64), np.zeros_like(of)
            return
        is_first = np.ones(len(of), dtype=bool)
        np.not_equal(of[1:], of[:-1], out=is_first[1:])
        self.starts, self._group = is_first.nonzero()[0], is_first.cumsum() - 1

    def least(self, values: Array) -> Array:
        """(k,) for each row the least of values (k,) of its window."""
        return np.asarray(np.minimum.reduceat(values, self.starts)[self._group])

    def where_all(self, flags: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(k,) for each row whether flags (k,) hold for all of its window."""
        return np.asarray(np.logical_and.reduceat(flags, self.starts)[self._group])

    def in_order(self, values: Array) -> Index:
        """Places of the rows, those of each window with the least of values (k,) first."""
        if len(self.starts) == 1:
            return np.argsort(values, kind="stable")
        return np.lexsort((values, self.of))

    def slices(self) -> list[tuple[int, slice]]:
        """Each window that has rows, and where they are."""
        ends = [*self.starts[1:].tolist(), len(self.of)]
        spans = map(slice, self.starts.tolist(), ends)
        return list(zip(self.of[self.starts].tolist(), spans, strict=True))


@dataclass(frozen=True)
class WindowStack:
    """w windows, filled up to n measurements.

    Attributes:
        t: (w, n) seconds after the reference time.
        ranges: (w, n) metres.
        poses: (2, w, n, 3) of both robots, each seen from itself at the reference time.
        points: (2, w, n) their antennas, x + iy; 0 where there is no measurement.
        counts: (w,) measurements of each window.
        before: (w,) of them before the reference time, or at it.
        held: (w, n) which places hold a measurement; None where all do.
        gyros: (2, w, 2) seconds after it from when and until when a gyro gave the heading.
    """

    t: Array
    ranges: Array
    poses: Array
    points: Array
    counts: Index
    before: Index
    held: NDArray[np.bool_] | None
    gyros: Array

    @staticmethod
    def of(windows: Sequence[Window]) -> WindowStack:
        counts = np.array([len(window.t) for window in windows])
        n = int(counts.max())
        held = None if (counts == n).all() else np.arange(n) < counts[:, None]
        t, ranges, a, b = (
            _filled([getattr(window, name) for window in windows], n, held)
            for name in ("t", "ranges", "a_poses", "b_poses")
        )
        poses = np.array((a, b))
        antennas = [[complex(*w.a_antenna), complex(*w.b_antenna)] for w in windows]
        points = np.exp(1j * poses[..., 2])
        points *= np.array(antennas).T[..., None]
        points.real += poses[..., 0]
        points.imag += poses[..., 1]
        if held is not None:
            points *= held
        before = np.array([window.before for window in windows])
        gyros = np.array([[w.a_gyro for w in windows], [w.b_gyro for w in windows]])
        return WindowStack(t, ranges, poses, points, counts, before, held, gyros)

    @property
    def latest_ranges(self) -> Array:
        """(w,) the middle of the three ranges of each window that are nearest to its reference
        time; of the two, or the only one, where there are no three."""
        since = np.abs(self.t) if self.held is None else np.where(self.held, np.abs(self.t), np.inf)
        nearest = since.argsort(axis=1, kind="stable")[:, :3]
        return middle(self.ranges[np.arange(len(since))[:, None], nearest], self.counts)

    @property
    def least_ranges(self) -> Array:
        """(w,) the shortest of each window."""
        if self.held is None:
            return np.asarray(self.ranges.min(axis=1))
        return np.asarray(np.where(self.held, self.ranges, np.inf).min(axis=1))


def _filled(rows: Sequence[Array], n: int, held: NDArray[np.bool_] | None) -> Array:
    """(w, n, ...) zeros where there is nothing."""
    if held is None:
        return np.array(rows)
    filled = np.zeros((len(rows), n, *rows[0].shape[1:]))
    for place, row in zip(filled, rows, strict=True):
        place[: len(row)] = row
    return filled


def middle(values: Array, counts: Index) -> Array:
    """(k,) medians of the first `counts` (k,) of values (k, n), or of all if there are no more."""
    n = values.shape[1]
    if (counts >= n).all():
        ordered = np.sort(values, axis=1)
        return np.asarray((ordered[:, (n - 1) // 2] + ordered[:, n // 2]) / 2)
    ordered = np.sort(np.where(np.arange(n) < counts[:, None], values, np.inf), axis=1)
    rows = np.arange(len(values))
    return np.asarray((ordered[rows, (counts - 1) // 2] + ordered[rows, counts // 2]) / 2)
