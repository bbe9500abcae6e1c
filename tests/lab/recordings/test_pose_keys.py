"""Whose pose a key names, and which one."""

from __future__ import annotations

import pytest
from lab.recordings.pose_keys import order_of, robot_of


@pytest.mark.parametrize(
    ("key", "robot", "order"),
    [
        ("A12", "A", 12),
        ("robot1_12", "robot1", 12),
        ("r1:12", "r1", 12),
        ("front-7", "front", 7),
        ("x1.5", "x1", 5),
        ("1_5", "1", 5),
        ("L", "L", 0),
        ("12", "", 12),
        (str((1 << 56) - 1), "", (1 << 56) - 1),
        (str((ord("b") << 56) + 12), "b", 12),
        ("_5", "_5", 0),
        ("", "", 0),
    ],
)
def test_a_key_is_a_robot_and_a_number(key: str, robot: str, order: int) -> None:
    assert (robot_of(key), order_of(key)) == (robot, order)


def test_a_number_of_any_length_ends() -> None:
    assert order_of("A" + "9" * 5_000) == 999_999_999_999_999_999
