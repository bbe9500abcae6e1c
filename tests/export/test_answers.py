"""Tables of an answer as arrays."""

from __future__ import annotations

from typing import Any

import pytest

from drslamd.export.answers import columns, edges, keyframe_times, seconds

WALL = {"utc_minus_clock_us": 1_000_000_000_000, "uncertainty_us": 0}


def answer() -> dict[str, Any]:
    """Two robots; nobody knows the clock of the second."""
    pose = [0.0] * 6
    return {
        "wall": WALL,
        "clocks": {
            "4": {"source": "messages", "readings": [[0, 500, 10]]},
            "9": {"source": "unknown", "readings": []},
        },
        "keyframes": {
            "columns": [
                *("key", "robot", "utime", "x_m", "y_m", "theta_rad"),
                *("odometry_x_m", "odometry_y_m", "odometry_theta_rad"),
            ],
            "rows": [[7, 4, 1_000, *pose], [8, 9, 2_000, *pose], [9, 4, 3_000, *pose]],
        },
        "odometry": {
            "columns": ["i", "j", "x_m", "y_m", "theta_rad", *(f"c{k}" for k in range(6))],
            "rows": [
                [6, 7, 1, 2, 3, 11, 12, 13, 22, 23, 33],
                [7, 9, 1, 2, 3, 11, 12, 13, 22, 23, 33],
            ],
        },
    }


def test_columns_have_the_names_that_were_told() -> None:
    assert columns(answer(), "keyframes")["key"].tolist() == [7, 8, 9]
    assert columns({}, "keyframes") == {}


def test_keyframes_have_the_time_of_their_robots_clock() -> None:
    assert keyframe_times(answer()) == {7: 1_000_000_000_500, 9: 1_000_000_002_500}
    assert keyframe_times({"wall": WALL, "clocks": {}}) == {}


def test_edges_to_keyframes_that_were_left_out_are_left_out() -> None:
    ends, measured, covariances = edges(answer(), "odometry")
    assert ends.tolist() == [[7, 9]]
    assert measured.tolist() == [[1, 2, 3]]
    assert covariances.tolist() == [[[11, 12, 13], [12, 22, 23], [13, 23, 33]]]
    assert [len(part) for part in edges({}, "closures")] == [0, 0, 0]


@pytest.mark.parametrize(
    ("us", "text"),
    [(1_790_000_000_123_457, "1790000000.123457"), (5, "0.000005"), (-100_000, "-0.100000")],
)
def test_seconds_keep_their_microseconds(us: int, text: str) -> None:
    assert seconds(us) == text
