"""Wheels that change their speed at once: has the robot done so too?

A robot has mass, its counters have none. Where they stop, stick or spin from one moment to the next
the robot may have gone on as before, and until ranges say which of the two it did both must be
feared. Who always drives so is believed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.se2 import Array

JUMP_MPS = 0.35
"""Within two tenths of a second: 1.7 m/s^2 is what robots are driven with, a wheel that sticks at
walking pace makes twice that."""
AT_ONCE = 2
"""Samples."""
STILL_MPS, STILL_RADPS = 0.05, 0.1
"""Wheels that stand; once they turn again they count again."""
FEARED = 10 * GRID_HZ
"""Samples for which a jump is feared; by then ranges have said what it was."""
LOOK_BACK = 600 * GRID_HZ
"""Samples, ten minutes of them ..."""
HABIT = 8
"""... in which so many jumps are a way to drive."""


class Jump(NamedTuple):
    """The last one.

    Attributes:
        n: sample of the track at which it began; until: at which it was over, or the last one.
        way: (2,) by how much farther the wheels went since than at the speed before, m along the
            axes of odometry.
    """

    n: int
    way: Array
    until: int

    def beside(self, track: Track) -> list[int]:
        """Samples between which wheels changed their speed at once: two of its beginning, and two
        of its end."""
        ends = [n for n in (self.n, self.until) if n + AT_ONCE < track.end]
        return [n + after for n in ends for after in (0, AT_ONCE)]


def feared(track: Track) -> Jump | None:
    """The jump that must be feared now; None where there is none."""
    count = min(track.end - max(track.n0, track.segment_start), LOOK_BACK)
    if count < 4 or not _jumps(_speeds(track, min(count, FEARED + 4))[0]):
        return None
    first = track.end - count
    speed, axis, turning = _speeds(track, count)
    jumps = _jumps(speed)
    if not jumps or len(jumps) > HABIT:
        return None
    is_still = (np.abs(speed) < STILL_MPS) & (turning < STILL_RADPS)
    over, begun, end = _over(jumps, speed, is_still)
    if len(speed) - begun > FEARED:
        return None
    way = (over[begun:, None] * axis[begun:]).sum(axis=0) / GRID_HZ
    return Jump(first + begun, way, first + end)


def _speeds(track: Track, count: int) -> tuple[Array, Array, Array]:
    """Of the last so many samples: (k,) m/s, the axes (k, 2) along which that is, (k,) rad/s."""
    poses = track.steps(track.end - count, count) * RESOLUTION
    step, heading = np.diff(poses[:, :2], axis=0), poses[:-1, 2]
    axis = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return (step * axis).sum(axis=1) * GRID_HZ, axis, np.abs(np.diff(poses[:, 2])) * GRID_HZ


def _jumps(speed: Array) -> list[int]:
    """The steps before which wheels begin to go much faster or slower than before."""
    hits = np.flatnonzero(np.abs(speed[2:] - speed[:-2]) > JUMP_MPS)
    if not len(hits):
        return []
    runs = np.split(hits, np.flatnonzero(np.diff(hits) > 2) + 1)
    # what is as before a moment later is a glitch of one sample
    return [
        int(run[0]) + 1 for run in runs if abs(speed[run[-1] + 2] - speed[run[0]]) > JUMP_MPS / 2
    ]


def _over(jumps: list[int], speed: Array, is_still: NDArray[np.bool_]) -> tuple[Array, int, int]:
    """(k,) m/s that wheels go faster than before the last jump that counts, and the steps before
    which it began and ended."""
    over, begun, end = np.zeros(len(speed)), jumps[0], 0
    by = [float(speed[min(at + 1, len(speed) - 1)] - speed[at - 1]) for at in jumps]
    for k, at in enumerate(jumps):
        if at <= end:
            # the end of what is feared already
            continue
        after = min(at + 1, len(speed) - 1)
        if is_still[after]:
            ends = after + np.flatnonzero(~is_still[after:])
        else:
            ends = np.array([j for j, b in zip(jumps, by, strict=True) if j > at and b * by[k] < 0])
        begun, end = at, min([*ends[:1].tolist(), at + FEARED, len(speed)])
        over[:] = 0.0
        over[at:end] = by[k]
    return over, begun, end
