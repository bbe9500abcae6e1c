"""Dead reckoning: motions in, samples of a track out."""

from __future__ import annotations

import math

import numpy as np

from drslamd.conventions import grid_index, grid_utime
from drslamd.sensors.samples import Motion
from drslamd.slam.odometry.track import OWN_TRACK_SAMPLES, RESOLUTION, Track
from drslamd.slam.se2 import Array


class DeadReckoning:
    """Adds up motions and puts a sample on the track at every tenth of a second."""

    def __init__(self) -> None:
        self.track = Track(OWN_TRACK_SAMPLES)
        self.path_m = 0.0
        self._utime: int | None = None
        self._pose = np.zeros(3)
        self._not_before = 0

    @property
    def utime(self) -> int | None:
        """Of the last motion, us."""
        return self._utime

    @property
    def pose(self) -> Array:
        """(3,) o_T_a after it; theta counts on."""
        return self._pose

    def add(self, motion: Motion) -> None:
        """Take one motion; motions must come in the order of their time."""
        since, before = self._utime, self._pose
        if since is not None and motion.utime <= since:
            return
        turn, distance = motion.turn_rad, motion.distance_m
        # the chord of the arc that both wheels drew, seen from half the turn
        chord = distance * float(np.sinc(turn / (2 * np.pi)))
        middle = before[2] + turn / 2
        self._pose = before + [chord * math.cos(middle), chord * math.sin(middle), turn]
        self._utime = motion.utime
        self.path_m += abs(distance)
        if since is None or motion.gap:
            # nothing is known of the time before; one sample at least stays empty, however short
            # the silence was, because the way across it is lost
            self._not_before = self.track.end + 1 if len(self.track) else grid_index(motion.utime)
            since = motion.utime - 1
        self._sample(since, before)

    def interrupt(self) -> None:
        """Of the way to the next motion nothing is known."""
        self._utime = None

    def _sample(self, since: int, before: Array) -> None:
        """Put on the track what lies on the grid after `since`, where we were at `before`."""
        assert self._utime is not None
        step = self._pose - before
        for n in range(max(grid_index(since) + 1, self._not_before), grid_index(self._utime) + 1):
            share = (grid_utime(n) - since) / (self._utime - since)
            self.track.append(n, np.round((before + share * step) / RESOLUTION))
