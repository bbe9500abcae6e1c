"""The rows of tools/benchmark that need a whole team, on small inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.benchmark import curves, growth, traffic
from lab.benchmark.rows import Row


def test_time_by_hours_is_a_row_for_each_mark_and_their_ratio(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(growth, "HOURS", {"1 min": 60, "2 min": 120, "1 h": 120})
    monkeypatch.setattr(growth, "AT_A_MARK", 2)
    rows = list(growth.by_hours(quick=True))
    assert [row.unit for row in rows] == ["ms", "ms", "ms", "ratio"]
    assert "186 keyframes" in rows[0].work
    assert rows[-1].value == pytest.approx(rows[2].value / rows[0].value)


def test_in_a_crowd_nobody_measures_beyond_the_reach_of_the_radio(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(growth, "TEAM_S", 5.0)
    monkeypatch.setattr(growth, "RANGE_M", 6.0)
    recording = growth.crowd(6)
    assert recording.ranges[:, 3].max() < 6.0
    ends = np.array([trail.truth[0, :2] for trail in recording.trails.values()])
    assert np.abs(ends).max() < growth.SQUARE_M * np.sqrt(6)


def test_traffic_is_counted_by_kind_and_is_what_the_robots_sent() -> None:
    kinds, _ = traffic.sent(1, 60.0)
    assert set(kinds) == {"graph", "odometry", "pose", "status"}
    # a heartbeat a second or two of three robots, with the framing of LCM
    assert 3 * 20 * 100 < kinds["status"] < 3 * 65 * 300


def test_rows_with_a_place_on_a_curve_are_drawn(tmp_path: Path) -> None:
    rows = [Row(3, f"{x}", 10.0 * x, "ms", curve=("hours", x)) for x in (2.0, 1.0, 8.0)]
    curves.draw([*rows, Row(1, "no curve", 1.0, "ms")], tmp_path / "deep" / "growth.svg")
    drawn = (tmp_path / "deep" / "growth.svg").read_text()
    assert drawn.startswith("<?xml")
    curves.draw([Row(1, "no curve", 1.0, "ms")], tmp_path / "none.svg")
    assert not (tmp_path / "none.svg").exists()
