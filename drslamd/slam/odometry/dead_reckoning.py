"""Dead reckoning: motions in, samples of a track out."""

from __future__ import annotations

import math

from drslamd.conventions import grid_index, grid_utime
from drslamd.sensors.samples import Motion
from drslamd.slam.odometry.track import OWN_TRACK_SAMPLES, RESOLUTION, Track

_RESOLUTION = tuple(RESOLUTION.tolist())


class DeadReckoning:
    """Adds up motions and puts a sample on the track at every tenth of a second.

    Attributes:
        pose: x, y, theta of o_T_a after the last motion; theta counts on.
    """

    def __init__(self) -> None:
        self.track = Track(OWN_TRACK_SAMPLES)
        self.path_m = 0.0
        self.pose = (0.0, 0.0, 0.0)
        self._utime: int | None = None
        self._not_before = 0

    @property
    def utime(self) -> int | None:
        """Of the last motion, us."""
        return self._utime

    def add(self, motion: Motion) -> None:
        """Take one motion; motions must come in the order of their time."""
        since, before = self._utime, self.pose
        if since is not None and motion.utime <= since:
            return
        x, y, theta = before
        half, distance = motion.turn_rad / 2, motion.distance_m
        # the chord of the arc that both wheels drew, seen from half the turn
        chord = distance * math.sin(half) / half if half else distance
        middle = theta + half
        self.pose = (
            x + chord * math.cos(middle),
            y + chord * math.sin(middle),
            theta + motion.turn_rad,
        )
        self._utime = motion.utime
        self.path_m += abs(distance)
        if since is None or motion.gap:
            # nothing is known of the time before; one sample at least stays empty, however short
            # the silence was, because the way across it is lost
            self._not_before = self.track.end + 1 if len(self.track) else grid_index(motion.utime)
            since = motion.utime - 1
        first = max(grid_index(since) + 1, self._not_before)
        if first <= grid_index(motion.utime):
            self._sample(first, since, before)

    def interrupt(self) -> None:
        """Of the way to the next motion nothing is known."""
        self._utime = None

    def _sample(self, first: int, since: int, before: tuple[float, float, float]) -> None:
        """Put on the track what lies on the grid from `first` on; `since` then we were `before`."""
        assert self._utime is not None
        for n in range(first, grid_index(self._utime) + 1):
            share = (grid_utime(n) - since) / (self._utime - since)
            pose = [a + share * (b - a) for a, b in zip(before, self.pose, strict=True)]
            steps = [value / step for value, step in zip(pose, _RESOLUTION, strict=True)]
            self.track.append(n, [float(round(step)) for step in steps])
