"""Which samples of our odometry become keyframes of the pose graph: one a second while we move.

A robot that turns otherwise than its wheels say has some between as well, as soon as that is known,
also of the way that it drove before. For module 3 makes other turns of a link to first order, and a
link does not say when it was turned within it: where all turns are twice or two thirds of what they
seem, a second's way ends 9 mm aside, which is more than the noise of odometry. Half a second has an
eighth of that.

Where its wheels change their speed at once there are two beside that, so that everybody sees it: a
robot has mass, and may have done something else (`odometry.jumps`).
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

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
AT_ONCE = 30
"""Of so many keyframes those before them are said at once, the newest first."""
LATELY = 64 + 3 * AT_ONCE
"""Keyframes, of more than the ten seconds for which a jump is feared, and finer ones before."""


class KeyframeSelector:
    """Of one robot."""

    def __init__(self) -> None:
        self._coarse: deque[tuple[int, Keyframe]] = deque(maxlen=RECENT_S)
        """Keyframes with no finer ones before, and the one before each; older ones are thinned."""
        self._lately: deque[int] = deque(maxlen=LATELY)
        """Samples that are keyframes."""
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
        made = self._of(track, n)
        if self._last is not None:
            last = self._last
            moved = np.array([made.x - last.x, made.y - last.y, made.theta - last.theta])
            moved = moved * RESOLUTION
            is_still = np.hypot(moved[0], moved[1]) < KEYFRAME_M and abs(moved[2]) < KEYFRAME_RAD
            if is_still and (n == last.n or not is_doubted):
                return None
        if self._last is not None:
            self._coarse.append((self._last.n, made))
        self._last = made
        self._lately.append(n)
        return made

    def made(self, track: Track, is_doubted: bool = False, is_odd: bool = False) -> list[Keyframe]:
        """The next one, if there is one.

        Args:
            is_doubted: see `next`; is_odd: and finer ones, because turns are not what they seem?
        """
        found = self.next(track, is_doubted)
        between = [*(self.finer(track) if is_odd else []), *self._beside_jumps(track)]
        self._lately.extend(made.n for made in between)
        return [*between, *([found] if found else [])]

    def _beside_jumps(self, track: Track) -> list[Keyframe]:
        """Those beside the last jump of our wheels."""
        jump = jumps.feared(track)
        beside = jump.beside(track) if jump else []
        return [self._of(track, n) for n in beside if n not in self._lately]

    def _of(self, track: Track, n: int) -> Keyframe:
        x, y, theta = (int(v) for v in track.steps(n, 1)[0])
        return Keyframe(n, self._segment, x, y, theta)

    def finer(self, track: Track) -> list[Keyframe]:
        """Some that lie between those that were made, and were not made yet."""
        out = []
        for _ in range(min(AT_ONCE, len(self._coarse))):
            before, made = self._coarse.pop()
            for n in range(made.n - FINER, max(before, made.n - DRIVEN), -FINER):
                if track.covers(n, made.n) and n not in self._lately:
                    out.append(replace(self._of(track, n), segment=made.segment))
        return out
