"""A track: the dead-reckoned poses of one robot on a 10 Hz grid.

Poses are ``o_T_a`` in the odometry frame of one chain, already rounded to the resolution in which
they are sent: what a peer computes from our track is what we compute. A sample exists only where
the wheels spoke. A silence leaves a hole, and what follows it is a new segment, because the motion
across the hole is not known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from drslamd.conventions import GRID_HZ, ROTATION_STEP_RAD, TRANSLATION_STEP_M
from drslamd.slam.se2 import Array

RESOLUTION = np.array([TRANSLATION_STEP_M, TRANSLATION_STEP_M, ROTATION_STEP_RAD])
"""Of x, y and theta on a track, and in every message about it."""

OWN_TRACK_SAMPLES = 8 * 3600 * GRID_HZ
"""Eight hours of our own trajectory, for export: 7 MB."""
PEER_TRACK_SAMPLES = 180 * GRID_HZ
"""A peer's odometry is needed for one window and a little delay: 43 kB a peer."""


class Track:
    """Samples ``n0 .. n0 + len - 1`` of one chain; poses in steps, NaN where there is a hole."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._poses = np.empty((64, 3))
        self._length = 0
        self.n0 = 0
        self.segment_start = 0
        """First sample after the last hole."""

    def __len__(self) -> int:
        return self._length

    @property
    def end(self) -> int:
        """One past the last sample."""
        return self.n0 + self._length

    @property
    def poses(self) -> Array:
        """(len, 3) o_T_a in metres and radians; theta counts on."""
        return np.asarray(self._poses[: self._length] * RESOLUTION)

    def steps(self, n: int, count: int) -> Array:
        """Samples n .. n + count - 1 as whole numbers of steps (floats without fraction)."""
        return self._poses[n - self.n0 : n - self.n0 + count]

    def covers(self, first: int, last: int) -> bool:
        """Is every sample first .. last there, without a hole?"""
        return max(self.n0, self.segment_start) <= first and last < self.end

    def at(self, n: int) -> Array:
        """o_T_a at sample n, (3,)."""
        return np.asarray(self._poses[n - self.n0] * RESOLUTION)

    def between(self, first: int, last: int) -> Array:
        """o_T_a at samples first .. last, (k, 3); a long track is not made of metres for a few."""
        return np.asarray(self.steps(first, last - first + 1) * RESOLUTION)

    def at_time(self, n: Array) -> Array:
        """o_T_a at fractional samples n (k,), linear between neighbours, (k, 3)."""
        n = np.minimum(np.maximum(n, self.n0), self.end - 1)
        left = np.floor(n).astype(int)
        right = np.minimum(left + 1, self.end - 1)
        before, after = self._poses[left - self.n0], self._poses[right - self.n0]
        return np.asarray((before + (after - before) * (n - left)[:, None]) * RESOLUTION)

    def at_moment(self, n: float) -> Array:
        """The same at one fractional sample, (3,)."""
        n = min(max(n, self.n0), self.end - 1)
        left = math.floor(n)
        right = min(left + 1, self.end - 1)
        before, after = self._poses[left - self.n0], self._poses[right - self.n0]
        return np.asarray((before + (after - before) * (n - left)) * RESOLUTION)

    def append(self, n: int, steps: Array | Sequence[float]) -> None:
        """Add sample n; what lies between it and the last one is a hole.

        Args:
            n: after the last sample.
            steps: (3,) pose in whole steps.
        """
        if not self._length:
            self.n0 = self.segment_start = n
        hole = n - self.end
        if hole < 0:
            raise ValueError(f"sample {n} is before the end {self.end} of the track")
        if hole >= self._capacity:
            self._length, self.n0, self.segment_start, hole = 0, n, n, 0
        elif hole:
            self.segment_start = n
        self._reserve(hole + 1)
        self._poses[self._length : self._length + hole] = np.nan
        self._poses[self._length + hole] = steps
        self._length += hole + 1

    def _reserve(self, extra: int) -> None:
        if self._length + extra <= len(self._poses):
            return
        drop = max(0, self._length + extra - self._capacity)
        keep = self._poses[drop : self._length]
        room = min(self._capacity + self._capacity // 4 + extra, 2 * (len(keep) + extra) + 64)
        self._poses = np.empty((room, 3))
        self._poses[: len(keep)] = keep
        self._length = len(keep)
        self.n0 += drop
