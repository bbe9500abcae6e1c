"""Distances for the graph: what they say of themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pair_scenes import LAST, moving_end, weak_paths

from drslamd.conventions import GRID_US, Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry.track import Track
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.range_sampler import STANDING_US, RangeSampler


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
    found = RangeSampler(0.1).sample(
        weak_paths(gap_db, share), moving_end(0), moving_end(1), Chain(1, 1)
    )
    assert found is not None
    assert found.range_m == metres
    assert found.sigma_m == pytest.approx(sigma, abs=0.006)


def turning_end(robot: int, turn: float) -> PairEnd:
    """A robot that turns on the spot by so much each sample, with one keyframe near its end."""
    track, data = Track(1000), ChainData(Chain(robot, 1))
    for n in range(LAST + 1):
        track.append(n, np.array([0.0, 0.0, round(1e4 * turn * n)]))
    data.add(Keyframe(LAST - 12, 0, 0, 0, round(1e4 * turn * (LAST - 12))))
    return PairEnd(track, data)


def test_a_range_says_how_both_robots_stood_turned_against_their_keyframes() -> None:
    """The middle of its second is the fourth or fifth sample before the last: seven or eight after
    the keyframe; and nobody is turned by more than half a turn."""
    found = RangeSampler(0.1).sample(
        weak_paths(0.0, 0.0), turning_end(0, 0.05), turning_end(1, -0.5), Chain(1, 1)
    )
    assert found is not None
    samples = found.turn_a / 0.05
    assert samples == pytest.approx(7.5, abs=0.51)
    assert found.turn_b == pytest.approx(math.remainder(-0.5 * samples, 2 * math.pi), abs=1e-3)


@pytest.mark.row("O12")
@pytest.mark.parametrize("turn", [0.5, -0.5])
def test_neither_robot_is_turned_by_more_than_half_a_turn(turn: float) -> None:
    """Both turn by 3.75 rad since their keyframes."""
    found = RangeSampler(0.1).sample(
        weak_paths(0.0, 0.0), turning_end(0, turn), turning_end(1, turn), Chain(1, 1)
    )
    assert found is not None
    assert found.turn_a == found.turn_b
    assert 2 < abs(found.turn_a) < math.pi
    assert np.sign(found.turn_a) == -np.sign(turn)


def standing_end(robot: int) -> PairEnd:
    return turning_end(robot, 0.0)


@pytest.mark.parametrize(
    ("later_us", "is_doubted", "is_said"),
    [
        (STANDING_US - GRID_US, False, False),
        (STANDING_US, False, True),
        (STANDING_US - GRID_US, True, True),
        (GRID_US * 10, True, True),
        (GRID_US * 8, True, False),
    ],
)
def test_who_stands_is_ranged_now_and_then_and_each_second_where_that_is_doubted(
    later_us: int, is_doubted: bool, is_said: bool
) -> None:
    sampler, ranges = RangeSampler(0.1), RangeBuffer()
    first = LAST * GRID_US - later_us
    for n in range(LAST + 1):
        if n * GRID_US <= first:
            ranges.add(n * GRID_US, 5.0)
    ends = standing_end(0), standing_end(1)
    assert sampler.sample(ranges, *ends, Chain(1, 1)) is not None
    for n in range(LAST + 1):
        if n * GRID_US > first:
            ranges.add(n * GRID_US, 5.0)
    found = sampler.sample(ranges, *ends, Chain(1, 1), is_doubted=is_doubted)
    assert (found is not None) is is_said
