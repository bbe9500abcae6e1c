"""Two robots side by side, with ranges and keyframes: what windows are cut from."""

from __future__ import annotations

import numpy as np

from drslamd.conventions import GRID_US, Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry.track import Track
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer

LAST = 200


def moving_end(robot: int) -> PairEnd:
    """A robot that drives along x at 0.1 m a sample, with a keyframe a second."""
    track, data = Track(1000), ChainData(Chain(robot, 1))
    for n in range(LAST + 1):
        track.append(n, np.array([1000.0 * n, 0.0, 0.0]))
        if n % 10 == 0:
            data.add(Keyframe(n, 0, 1000 * n, 0, 0))
    return PairEnd(track, data)


def weak_paths(gap_db: float, blocked_share: float) -> RangeBuffer:
    """5 m in sight; every so often a range that is 1 m too long and has this power gap."""
    ranges = RangeBuffer(nlos_db=10.0)
    period = 10
    for n in range(LAST + 1):
        wrong = n % period < blocked_share * period
        ranges.add(n * GRID_US, 6.0 if wrong else 5.0, gap_db if wrong else 3.0)
    return ranges
