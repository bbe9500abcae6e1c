"""Which samples of our odometry become keyframes of the pose graph: one a second while we move.

A robot that turns otherwise than its wheels say has some between as well, as soon as that is known,
also of the way that it drove before. For module 3 makes other turns of a link to first order, and a
link does not say when it was turned within it: where all turns are twice or two thirds of what they
seem, a second's way ends 9 mm aside, which is more than the noise of odometry. Half a second has an
eighth of that.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.graph.thinning.time_cells import RECENT_S
from drslamd.slam.odometry import jumps
from drslamd.slam.odometry.track import RESOLUTION, Track

KEYFRAME_M = 0.05
"""A robot that moved less than this since its last keyframe, and turned less than `KEYFRAME_RAD`,
makes no new one."""
KEYFRAME_RAD = 0.05
"""See `KEYFRAME_M`."""
FINER = 5
"""Samples between finer keyframes."""
DRIVEN = 2 * 10
"""So long before a keyframe its robot may have begun to drive, in samples; before that it stood."""
MARKS = 4
"""Keyframes beside one jump."""
AT_ONCE = 30
"""Of so many keyframes those before them are said at once, the newest first."""


class KeyframeSelector:
    """Of one robot."""

    def __init__(self) -> None:
        self._coarse: deque[tuple[int, Keyframe]] = deque(maxlen=RECENT_S)
        """Keyframes with no finer ones before, and the one before each; older ones are thinned."""
        self._beside: deque[int] = deque(maxlen=MARKS)
        """Keyframes beside jumps."""
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
        made = Keyframe(n, self._segment, x, y, theta)
        if self._last is not None:
            self._coarse.append((self._last.n, made))
        self._last = made
        return made

    def made(self, track: Track, is_doubted: bool = False, is_odd: bool = False) -> list[Keyframe]:
        """The next one, if there is one.

        Args:
            is_doubted: see `next`; is_odd: and finer ones, because turns are not what they seem?
        """
        found = self.next(track, is_doubted)
        finer = self.finer(track) if is_odd else []
        return [*finer, *self._beside_jumps(track), *([found] if found else [])]

    def _beside_jumps(self, track: Track) -> list[Keyframe]:
        """Those beside the last jump of our wheels, as far as they were not made yet."""
        jump = jumps.feared(track)
        out = []
        for n in jump.beside(track) if jump else ():
            is_new = n not in self._beside and (self._last is None or n != self._last.n)
            if is_new and track.covers(n, track.end - 1):
                x, y, theta = (int(v) for v in track.steps(n, 1)[0])
                out.append(Keyframe(n, self._segment, x, y, theta))
                self._beside.append(n)
        return out

    def finer(self, track: Track) -> list[Keyframe]:
        """Some that lie between those that were made, and were not made yet."""
        out = []
        for _ in range(min(AT_ONCE, len(self._coarse))):
            before, made = self._coarse.pop()
            for n in range(made.n - FINER, max(before, made.n - DRIVEN), -FINER):
                if track.covers(n, made.n):
                    x, y, theta = (int(v) for v in track.steps(n, 1)[0])
                    out.append(Keyframe(n, made.segment, x, y, theta))
        return out
