"""The day with churn: a world that goes on from block to block, and rows of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.soak import churn
from lab.soak.churn import BLOCK_S, DRIVEN_S, Day
from lab.soak.put_aside import put_aside, taken_up


def test_robots_go_on_where_the_last_block_left_them_and_rest_after_they_drove() -> None:
    day = Day(1)
    one, other = day.block(0), day.block(1)
    for robot, trail in one.trails.items():
        assert np.allclose(trail.truth[-1], other.trails[robot].truth[0])
        assert np.array_equal(day.truth(robot, BLOCK_S - 1.0), trail.truth[-1])
        resting = trail.truth[trail.t > DRIVEN_S]
        assert np.ptp(resting, axis=0).max() == 0
        assert np.ptp(trail.truth[:, 0]) > 1.0


class _Ended(Exception):
    """Somebody needs the computer for something else."""


@pytest.mark.row("O7")
@pytest.mark.row("O8")
@pytest.mark.slow
def test_a_day_that_was_put_aside_goes_on_as_if_nobody_had(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(churn, "RESTART_S", 20)
    aside = (tmp_path / "results.day", "a commit")
    seen: list[float] = []
    (unbroken,) = churn.hours(1, 0.014, seen.append)
    assert (seen[-1], unbroken.hour, unbroken.sitting) == (50, 1, 1)
    assert unbroken.descriptors > 0
    assert unbroken.rss_mb > 10
    assert unbroken.entries > 0

    def end(second: float) -> None:
        if second == 40:
            raise _Ended

    with pytest.raises(_Ended):
        list(churn.hours(1, 0.014, end, aside))
    again: list[float] = []
    (row,) = churn.hours(1, 0.014, again.append, aside)
    assert again == [30, 40, 50]
    assert (row.entries, row.pair_rms_m) == (unbroken.entries, unbroken.pair_rms_m)
    assert row.sitting == 2
    assert not aside[0].exists()


def test_only_the_play_that_is_asked_for_is_taken_up(tmp_path: Path) -> None:
    path = tmp_path / "results.day"
    assert taken_up(path, 1) is None
    put_aside(path, {"second": 5, "act": lambda: 7}, ("a commit", 1))
    assert taken_up(path, ("another commit", 1)) is None
    found = taken_up(path, ("a commit", 1))
    assert found is not None
    assert (found["second"], found["act"]()) == (5, 7)
