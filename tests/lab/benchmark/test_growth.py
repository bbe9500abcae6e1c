"""What grows, on small inputs."""

from __future__ import annotations

import numpy as np
import pytest
from lab.benchmark import growth

from drslamd.slam.optimizer import near_pairs


def test_time_by_hours_is_a_row_for_each_mark_their_ratio_and_what_it_takes_to_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(growth, "HOURS", {"1 min": 60, "2 min": 120, "1 h": 120})
    monkeypatch.setattr(growth, "AT_A_MARK", 2)
    monkeypatch.setattr(growth, "RENEWED_S", 4)
    rows = list(growth.by_hours(quick=True))
    assert [row.unit for row in rows] == ["ms", "ms", "ms", "ratio", "ms", "ms"]
    assert "186 keyframes" in rows[0].work
    assert "372 keyframes" in rows[2].work
    assert rows[3].value == pytest.approx(rows[2].value / rows[0].value)
    assert all(0 < row.value < 50 for row in rows[4:])


def test_in_a_crowd_nobody_measures_beyond_the_reach_of_the_radio(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(growth, "TEAM_S", 5.0)
    monkeypatch.setattr(growth, "RANGE_M", 6.0)
    recording = growth.crowd(6)
    assert recording.ranges[:, 3].max() < 6.0
    ends = np.array([trail.truth[0, :2] for trail in recording.trails.values()])
    assert np.abs(ends).max() < growth.SQUARE_M * np.sqrt(6)


def test_a_crowd_is_what_its_solutions_cost_and_how_many_pairs_there_is_no_room_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(growth, "CROWDS", (12,))
    monkeypatch.setattr(growth, "MINUTE_S", 12)
    monkeypatch.setattr(growth, "SECONDS", 2)
    monkeypatch.setattr(near_pairs, "MOST", 40)
    rows = list(growth.by_crowd(quick=False))
    assert [row.unit for row in rows] == ["ms", "ms", "MB"]
    left_out = int(rows[0].work.split(", ")[1].split()[0])
    assert 0 < left_out < 12 * 11 / 2 - 20
    assert rows[2].value > 30
    assert list(growth.by_crowd(quick=True)) == []
