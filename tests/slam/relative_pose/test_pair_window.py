"""From ranges and tracks to a window: its reference time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import NOISE, config, traits_of

from drslamd.conventions import GRID_US, Chain
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.graph.pose_graph import ChainData
from drslamd.slam.odometry.track import Track
from drslamd.slam.relative_pose.pair_window import (
    CONFIRM_US,
    PairEnd,
    RangeSampler,
    Request,
    level,
    request,
)
from drslamd.slam.relative_pose.range_buffer import RangeBuffer

LAST = 200


def side(robot: int) -> PairEnd:
    """A robot that drives along x at 0.1 m a sample, with a keyframe a second."""
    track, items = Track(1000), ChainData(Chain(robot, 1))
    for n in range(LAST + 1):
        track.append(n, np.array([1000.0 * n, 0.0, 0.0]))
        if n % 10 == 0:
            items.add(Keyframe(n, 0, 1000 * n, 0, 0))
    return PairEnd(track, items)


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


def measured(gap_db: float, blocked_share: float) -> RangeBuffer:
    """5 m in sight; every so often a range that is 1 m too long and has this power gap."""
    ranges = RangeBuffer(nlos_db=10.0)
    period = 10
    for n in range(LAST + 1):
        wrong = n % period < blocked_share * period
        ranges.add(n * GRID_US, 6.0 if wrong else 5.0, gap_db if wrong else 3.0)
    return ranges


@pytest.mark.parametrize(("gap_db", "longest"), [(10.0, 5.0), (9.5, 6.0)])
def test_what_is_surely_blocked_is_not_in_a_window(gap_db: float, longest: float) -> None:
    section = config().relative_pose
    found = request(measured(gap_db, 0.4), side(0), side(1), section)
    assert isinstance(found, Request)
    assert found.window.ranges.max() == longest
    printed = section.model_copy(update={"algorithm": "paper"})
    found = request(measured(gap_db, 0.4), side(0), side(1), printed)
    assert isinstance(found, Request)
    assert found.window.ranges.max() == 6.0


@pytest.mark.parametrize(
    ("gap_db", "share", "metres", "sigma"),
    [
        (10.0, 0.4, 5.0, 0.1),
        (10.0, 1.0, 6.0, math.hypot(0.1, 0.5)),
        (8.0, 1.0, 6.0, math.hypot(0.1, 0.25)),
        (6.0, 1.0, 6.0, 0.1),
    ],
)
def test_a_range_for_the_graph_says_how_much_it_is_worth(
    gap_db: float, share: float, metres: float, sigma: float
) -> None:
    item = RangeSampler(0.1).next(measured(gap_db, share), side(0), side(1), Chain(1, 1))
    assert item is not None
    assert item.range_m == metres
    assert item.sigma_m == pytest.approx(sigma, abs=0.006)


@pytest.mark.parametrize(
    ("measured", "from_above"),
    [(5.0, 4.0), (3.0001, math.sqrt(3.0001**2 - 9)), (2.9, 2.9), (-0.3, -0.3)],
)
def test_ranges_between_antennas_of_different_heights_are_seen_from_above(
    measured: float, from_above: float
) -> None:
    low, high = ChainData(Chain(0, 1)), ChainData(Chain(1, 1))
    low.take_traits(0, traits_of(NOISE, height=0.5))
    high.take_traits(0, traits_of(NOISE, height=3.5))
    a, b = PairEnd(Track(10), low), PairEnd(Track(10), high)
    assert level(np.array([measured]), a, b)[0] == pytest.approx(from_above)
    assert level(np.array([measured]), a, a)[0] == pytest.approx(measured)
