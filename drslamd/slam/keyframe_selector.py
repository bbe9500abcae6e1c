"""Which samples of our odometry become keyframes of the pose graph: one a second while we move."""

from __future__ import annotations

import numpy as np

from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry.track import RESOLUTION, Track

KEYFRAME_M = 0.05
"""A robot that moved less than this since its last keyframe, and turned less than `KEYFRAME_RAD`,
makes no new one."""
KEYFRAME_RAD = 0.05
"""See `KEYFRAME_M`."""


class KeyframeSelector:
    """Of one robot."""

    def __init__(self) -> None:
        self._segment = 0
        self._segment_start: int | None = None
        self._last: Keyframe | None = None

    def next(self, track: Track, is_doubted: bool = False) -> Keyframe | None:
        """The latest sample of our odometry, if we moved since the last keyframe; the first sample
        of a segment.

        Args:
            is_doubted: who may move though its wheels say nothing has a place of its own each time.
        """
        if not len(track):
            return None
        if self._segment_start is not None and track.segment_start > self._segment_start:
            self._segment += 1
            self._last = None
        self._segment_start = track.segment_start
        # the frame of a segment begins where its odometry does: what is driven until the first look
        # is a link like any other, with its noise and with whatever is learned of the wheels
        n = track.end - 1 if self._last is not None else max(track.n0, track.segment_start)
        x, y, theta = (int(v) for v in track.steps(n, 1)[0])
        if self._last is not None:
            last = self._last
            moved = np.array([x - last.x, y - last.y, theta - last.theta]) * RESOLUTION
            is_still = np.hypot(moved[0], moved[1]) < KEYFRAME_M and abs(moved[2]) < KEYFRAME_RAD
            if is_still and (n == last.n or not is_doubted):
                return None
        self._last = Keyframe(n, self._segment, x, y, theta)
        return self._last
