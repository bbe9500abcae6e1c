"""`drslamd status` for people: every line of a complete answer, and each other thing it may say."""

from __future__ import annotations

from typing import Any

import pytest
from made_up_answers import answer

from drslamd import report
from drslamd.config import parse
from drslamd.reports.status_text import lines
from drslamd.robot import Robot

CONFIG = """
robot.id = 3
team.insecure = true
uwb.port = "/dev/uwb"
wheels.source = "kobuki"
wheels.port = "/dev/wheels"
"""


def said(*path_and_value: Any) -> list[str]:
    """The lines of an answer of which one thing is different."""
    *path, last, value = path_and_value
    whole = answer()
    at = whole
    for key in path:
        at = at[key]
    assert last in at
    at[last] = value
    return lines(whole)


def news(*path_and_value: Any) -> list[str]:
    """Only the lines that are different then."""
    usual = lines(answer())
    return [line for line in said(*path_and_value) if line not in usual]


def test_a_complete_answer_is_these_lines() -> None:
    assert lines(answer()) == [
        "robot 3, epoch 17",
        "localised in the frame of robot 0: x 1.00 m, y -2.00 m, 90.0 deg (sigma 0.05 m, 1.5 deg)",
        "uwb port open, good 0.02 s ago",
        "  ranges to module 7 (robot 1): 9, 0.10 s ago",
        "wheels port open, good 0.01 s ago",
        "network up (239.255.76.67:7667 on lo), 10 bytes sent, 5 messages accepted",
        "peer 1: alive, heard 0.4 s ago, loss 25 %, clock -7200.5 ms +- 1.5 (messages), same graph",
        "pair with 1: connected, closures 4 kept of 5 (5 unique, 4 ambiguous)",
        "group [1, 3]",
    ]


def test_the_made_up_answer_has_no_field_that_a_real_one_lacks() -> None:
    real = report.status(Robot(parse(CONFIG), bytes(32), 17, {}), 1_000_000)
    made_up = answer()
    assert made_up.keys() <= real.keys()
    for part in ("network", "graph", "uwb", "wheels"):
        assert made_up[part].keys() <= real[part].keys() | {"detail"}
    assert lines(real)[:2] == ["robot 3, epoch 17", INSECURE]


INSECURE = "INSECURE: no team key, anybody on the network can forge messages"


def test_what_is_wrong_stands_first() -> None:
    whole = answer()
    whole |= {"insecure": True, "problems": ["the sky falls", "uwb: missing: /dev/uwb"]}
    assert lines(whole)[:4] == [
        "robot 3, epoch 17",
        INSECURE,
        "! the sky falls",
        "! uwb: missing: /dev/uwb",
    ]
    assert lines(whole)[4].startswith("localised")


def test_why_a_robot_is_not_localised_is_said_once_and_by_the_problems() -> None:
    reason = "not localised: no other robot is heard; is drslamd running on them?"
    whole = answer()
    whole |= {"problems": [reason], "pose": {"state": "not localised"}, "peers": {}, "pairs": {}}
    assert [line for line in lines(whole) if "localised" in line] == [
        f"! {reason}",
        "not localised",
    ]


@pytest.mark.parametrize("state", ["stale", "doubtful"])
def test_a_pose_that_is_not_sure_is_called_so_here_and_at_the_peers(state: str) -> None:
    (line,) = news("pose", "state", state)
    assert line.startswith(f"{state} in the frame of robot 0: x 1.00 m, y -2.00 m")
    (line,) = news("peers", "1", "pose", state)
    assert line.startswith(f"peer 1: alive, its pose is {state}, heard 0.4 s ago")


@pytest.mark.parametrize("state", ["localised", "not localised", None])
def test_of_other_poses_of_peers_nothing_is_said(state: str | None) -> None:
    assert news("peers", "1", "pose", state) == []


def test_without_a_reason_none_is_made_up() -> None:
    assert news("pose", {"state": "not localised"}) == ["not localised"]


@pytest.mark.parametrize(
    ("path_and_value", "line"),
    [
        (("uwb", "port", "missing"), "uwb port missing, good 0.02 s ago"),
        (("wheels", "detail", "/dev/wheels"), "wheels port open /dev/wheels, good 0.01 s ago"),
        (("wheels", "age_s", None), "wheels port open, good never"),
        (("uwb", "counters", {"frames.refused.VOLTAGE": 4}), "  4 frames.refused.VOLTAGE"),
        (("wheels", "counters", {"samples.refused.JUMP": 2}), "  2 samples.refused.JUMP"),
        (
            ("uwb", "ranges", "7", "robot", None),
            "  ranges to module 7 (no robot says it is its): 9, 0.10 s ago",
        ),
        (
            ("uwb", "ranges", "7", "robot", 0),
            "  ranges to module 7 (robot 0): 9, 0.10 s ago",
        ),
        (
            ("network", "up", False),
            "network DOWN (239.255.76.67:7667 on lo), 10 bytes sent, 5 messages accepted",
        ),
        (("network", "refused", {"tag does not fit": 2}), "  refused 2: tag does not fit"),
        (("graph", "group", []), "group none"),
        (
            ("pairs", "1", "connected", False),
            "pair with 1: not connected yet, closures 4 kept of 5 (5 unique, 4 ambiguous)",
        ),
    ],
)
def test_each_other_thing_has_its_line(path_and_value: tuple[Any, ...], line: str) -> None:
    assert news(*path_and_value) == [line]


@pytest.mark.parametrize(
    ("key", "value", "words", "instead_of"),
    [
        ("alive", False, "SILENT, ", "alive, "),
        ("hears_us", False, "alive, does not hear us, ", "alive, "),
        ("clock_offset_ms", None, "clock unknown, ", "clock -7200.5 ms +- 1.5 (messages), "),
        ("clock_offset_ms", 3.04, "clock +3.0 ms ", "clock -7200.5 ms "),
    ],
)
def test_each_other_thing_about_a_peer_has_its_words(
    key: str, value: Any, words: str, instead_of: str
) -> None:
    (usual,) = (line for line in lines(answer()) if line.startswith("peer 1"))
    assert news("peers", "1", key, value) == [usual.replace(instead_of, words)]


def test_a_robot_that_records_says_how_much_and_where() -> None:
    recording = {"folder": "/var/rec", "file": "robot-003-x.lcmlog", "bytes": 1_234_567}
    whole = {**answer(), "recording": recording}
    assert lines(whole)[-1] == "recorded 1.2 MB in /var/rec, now robot-003-x.lcmlog"
    assert lines({**whole, "recording": None}) == lines(answer())


def test_a_peer_with_another_graph_is_told_what_is_lacking() -> None:
    whole = answer()
    whole["peers"]["1"] |= {"same_graph": False, "log_entries_lacking": 3}
    (line,) = (line for line in lines(whole) if line.startswith("peer 1"))
    assert line.endswith("(messages), lacking 3 entries")


def test_without_peers_and_pairs_there_is_no_line_of_them() -> None:
    whole = answer()
    whole |= {"peers": {}, "pairs": {}}
    assert not [line for line in lines(whole) if line.startswith(("peer", "pair"))]


def test_where_a_peer_may_be_is_one_sentence() -> None:
    whole = answer()
    whole["hypotheses"] = [{"robot": 1, "what": "robot 1 is at one of 2 places"}]
    assert "? robot 1 is at one of 2 places" in lines(whole)
