"""Of a robot that is not localised everything is said that it knows about it."""

from __future__ import annotations

from typing import Any

from lab.score import reasons


def status(**pose: Any) -> dict[str, Any]:
    return {
        "pose": {"state": "not localised", **pose},
        "problems": ["not localised: ambiguous (with robot 2); drive curves"],
        "pairs": {
            "2": {
                "connected": False,
                "windows": {"unique": 1, "ambiguous": 40},
                "closures_kept": 0,
                "closures_seen": 41,
            }
        },
        "uwb": {"counters": {"ranges.refused.LIMITS": 7, "ranges.accepted": 90}},
        "wheels": {"counters": {"samples.refused.SAME_STAMP": 9, "samples.refused.JUMP": 0}},
        "network": {"refused": {"tag does not fit the team key": 8}},
    }


def test_a_lost_robot_says_why_and_what_was_refused_the_most_first() -> None:
    assert reasons.lines({1: status()}) == [
        "robot 1 is not localised",
        "  not localised: ambiguous (with robot 2); drive curves",
        "  with robot 2: not connected; windows: 40 ambiguous, 1 unique; closures: 0 kept of 41",
        "  9 samples refused: SAME_STAMP",
        "  8 messages refused: tag does not fit the team key",
        "  7 ranges refused: LIMITS",
    ]


def test_of_one_that_is_localised_nothing_is_said() -> None:
    assert reasons.lines({1: status(frame=1)}) == []
    assert reasons.lines({}) == []


def test_only_the_most_frequent_are_named() -> None:
    said = status()
    said["network"]["refused"] = {str(n): n for n in range(1, 20)}
    named = [line for line in reasons.lines({1: said}) if "messages refused" in line]
    assert named[0] == "  19 messages refused: 19"
    assert len(named) == reasons.MOST


def test_a_robot_alone_has_no_windows() -> None:
    said = status()
    said["pairs"]["2"]["windows"] = {}
    assert "windows: none;" in reasons.lines({1: said})[2]


def test_what_lasted_is_said_instead_of_the_end_where_it_was_counted() -> None:
    lasted = {1: [(k, f"complaint {k}") for k in range(20, 0, -1)], 2: [(9, "of another one")]}
    said = reasons.lines({1: status()}, lasted)
    assert said[1 : 1 + reasons.MOST] == [f"  for {k} s: complaint {k}" for k in range(20, 14, -1)]
    assert said[1 + reasons.MOST].startswith("  with robot 2")
    assert reasons.lines({3: status()}, lasted)[1].startswith("  with robot 2")
