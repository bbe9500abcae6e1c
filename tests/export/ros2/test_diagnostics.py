"""Health as diagnostics of ROS."""

from __future__ import annotations

from typing import Any

import pytest

from drslamd.export.ros2.diagnostics import ERROR, OK, STALE, WARN, diagnostics


def status(state: str, problems: list[str], **peer: Any) -> dict[str, Any]:
    about = {"alive": True, "pose": "localised", "loss": 0.25, "uwb_id": None, **peer}
    return {
        "robot": 3,
        "problems": problems,
        "pose": {"state": state, "x_m": 1.5},
        "peers": {"7": about},
    }


@pytest.mark.parametrize(
    ("state", "problems", "level", "said"),
    [
        ("localised", [], OK, "localised"),
        ("localised", ["one", "two"], WARN, "one; two"),
        ("doubtful", [], WARN, "doubtful"),
        ("stale", ["no odometry"], STALE, "no odometry"),
        ("not localised", ["not enough motion"], ERROR, "not enough motion"),
    ],
)
def test_the_robot_that_was_asked_says_its_problems(
    state: str, problems: list[str], level: int, said: str
) -> None:
    own = diagnostics(status(state, problems), 5_000_000)["status"][0]
    assert (own["level"], own["message"]) == (level, said)
    assert (own["name"], own["hardware_id"]) == ("drslamd: robot 3", "robot_3")
    assert {v["key"]: v["value"] for v in own["values"]} == {"state": state, "x_m": "1.5"}


@pytest.mark.parametrize(
    ("peer", "level", "said"),
    [
        ({}, OK, "localised"),
        ({"pose": "doubtful"}, WARN, "doubtful"),
        ({"pose": None}, STALE, "not heard yet"),
        ({"alive": False}, STALE, "silent"),
    ],
)
def test_a_peer_is_as_it_is_seen(peer: dict[str, Any], level: int, said: str) -> None:
    found = diagnostics(status("localised", [], **peer), 0)["status"][1]
    assert (found["level"], found["message"], found["hardware_id"]) == (level, said, "robot_7")
    assert {"key": "uwb_id", "value": ""} in found["values"]
