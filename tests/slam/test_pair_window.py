"""From ranges and tracks to a window: its reference time."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import config

from drslamd.conventions import GRID_US, Chain
from drslamd.slam.items import Keyframe
from drslamd.slam.odometry import Track
from drslamd.slam.pair_window import CONFIRM_US, Request, Side, request
from drslamd.slam.pose_graph import ChainItems
from drslamd.slam.range_buffer import RangeBuffer

LAST = 200


def side(robot: int) -> Side:
    """A robot that drives along x at 0.1 m a sample, with a keyframe a second."""
    track, items = Track(1000), ChainItems(Chain(robot, 1))
    for n in range(LAST + 1):
        track.append(n, np.array([1000.0 * n, 0.0, 0.0]))
        if n % 10 == 0:
            items.add(Keyframe(n, 0, 1000 * n, 0, 0))
    return Side(track, items)


def made(algorithm: str) -> Request:
    ranges = RangeBuffer()
    for n in range(LAST + 1):
        ranges.add(n * GRID_US, 5.0)
    section = config(extra=f'[relative_pose]\nalgorithm = "{algorithm}"\n').relative_pose
    found = request(ranges, side(0), side(1), section)
    assert isinstance(found, Request)
    return found


@pytest.mark.parametrize(("algorithm", "back_us"), [("drslamd", CONFIRM_US), ("paper", 0)])
def test_the_pose_asked_for_is_two_seconds_old_and_in_the_paper_the_latest(
    algorithm: str, back_us: int
) -> None:
    found = made(algorithm)
    assert found.utime == LAST * GRID_US - back_us
    assert found.window.t[-1] * 1e6 == pytest.approx(back_us, abs=4 * GRID_US)
    # 0.1 m a sample, seen from the reference time
    assert found.window.a_poses[:, 0] == pytest.approx(found.window.t * 1.0, abs=1e-3)
    assert found.window.before == np.count_nonzero(found.window.t <= 0)
