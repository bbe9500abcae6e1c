"""The day with churn: a world that goes on from block to block, and rows of it."""

from __future__ import annotations

import numpy as np
import pytest
from lab.soak import churn
from lab.soak.churn import BLOCK_S, DRIVEN_S, Day


def test_robots_go_on_where_the_last_block_left_them_and_rest_after_they_drove() -> None:
    day = Day(1)
    one, other = day.block(0), day.block(1)
    for robot, trail in one.trails.items():
        assert np.allclose(trail.truth[-1], other.trails[robot].truth[0])
        assert np.array_equal(day.truth(robot, BLOCK_S - 1.0), trail.truth[-1])
        resting = trail.truth[trail.t > DRIVEN_S]
        assert np.ptp(resting, axis=0).max() == 0
        assert np.ptp(trail.truth[:, 0]) > 1.0


@pytest.mark.row("O7")
@pytest.mark.row("O8")
@pytest.mark.slow
def test_two_minutes_of_the_day_keep_every_promise() -> None:
    seen: list[float] = []
    (row,) = churn.hours(1, 0.03, seen.append)
    assert row.hour == 1
    assert row.descriptors > 0
    assert row.rss_mb > 10
    assert seen[-1] == 110
