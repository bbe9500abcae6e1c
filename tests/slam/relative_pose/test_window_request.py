"""From ranges and tracks to a window: its reference time."""

from __future__ import annotations

import numpy as np
import pytest
from pair_scenes import LAST, moving_end, weak_paths
from slam_scenes import config

from drslamd.conventions import GRID_US
from drslamd.slam.closure_method import CONFIRM_US
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.window_request import WindowRequest, request
from drslamd.slam.settings import closure_method


def made(algorithm: str) -> WindowRequest:
    ranges = RangeBuffer()
    for n in range(LAST + 1):
        ranges.add(n * GRID_US, 5.0)
    section = config(extra=f'[relative_pose]\nalgorithm = "{algorithm}"\n').relative_pose
    found = request(ranges, moving_end(0), moving_end(1), closure_method(section).rule)
    assert isinstance(found, WindowRequest)
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


@pytest.mark.parametrize(("gap_db", "longest"), [(10.0, 5.0), (9.5, 6.0)])
def test_what_is_surely_blocked_is_not_in_a_window(gap_db: float, longest: float) -> None:
    section = config().relative_pose
    found = request(
        weak_paths(gap_db, 0.4), moving_end(0), moving_end(1), closure_method(section).rule
    )
    assert isinstance(found, WindowRequest)
    assert found.window.ranges.max() == longest
    printed = section.model_copy(update={"algorithm": "paper"})
    found = request(
        weak_paths(gap_db, 0.4), moving_end(0), moving_end(1), closure_method(printed).rule
    )
    assert isinstance(found, WindowRequest)
    assert found.window.ranges.max() == 6.0
