"""The live table: what is wrong above everything, rates from two answers, and what fits."""

from __future__ import annotations

from copy import deepcopy

from made_up_answers import answer

from drslamd import report
from drslamd.config import parse
from drslamd.reports.status_table import columns, fitted, span, table
from drslamd.robot import Robot

CONFIG = """
robot.id = 3
team.insecure = true
uwb.port = "/dev/uwb"
wheels.source = "kobuki"
wheels.port = "/dev/wheels"
"""


def test_a_complete_table_is_these_lines() -> None:
    lines = table(answer())
    assert lines[0] == (
        "robot 3: localised in the frame of robot 0, x 1.00 m, y -2.00 m, 90.0 deg, sigma 0.05 m"
    )
    assert lines[1] == ""
    assert lines[-1] == "connected group: 1, 3"
    assert " ".join(lines[-3].split()) == (
        "1 0 s 25 % yes -7200.5 1.5 0 s ago 4 of 5 connected localised"
    )


def test_what_is_wrong_stands_above_the_rest_with_its_age() -> None:
    whole = answer()
    whole["conditions"] = [{"key": "uwb", "what": "uwb: lost", "since_s": 125}]
    whole["insecure"] = True
    assert table(whole)[1].startswith("! INSECURE")
    assert table(whole)[2] == "! uwb: lost (since 2 min)"


def test_rates_are_differences_of_two_answers() -> None:
    now, before = answer(), deepcopy(answer())
    now["uwb"]["counters"]["frames.accepted"] += 50
    now["network"]["bytes_sent"] += 1_000
    text = "\n".join(table(now, before, 2.0))
    assert "25/s frames" in text
    assert "500/s bytes" in text
    assert "25/s" not in "\n".join(table(now))


def test_a_robot_that_is_silent_or_deaf_is_seen_at_a_glance() -> None:
    whole = answer()
    whole["peers"]["1"] |= {"alive": False, "age_s": 7_300.0, "hears_us": False, "pose": None}
    whole["pairs"] = {}
    (row,) = (line for line in table(whole) if "SILENT" in line)
    assert row.split()[:2] == ["1", "SILENT"]
    assert "2 h" in row
    assert " NO " in row
    whole["peers"] = {}
    assert "no other robot is heard" in table(whole)


def test_a_real_answer_of_a_robot_that_has_just_begun_can_be_shown() -> None:
    real = report.status(Robot(parse(CONFIG), bytes(32), 17, {}), 1_000_000)
    lines = table(real, real, 0.0)
    assert lines[0] == "robot 3: not localised"
    assert lines[-1] == "connected group: none"


def test_what_does_not_fit_is_counted() -> None:
    lines = [f"line {k}" for k in range(10)]
    assert fitted(lines, 80, 10) == lines
    assert fitted(lines, 80, 9) == [*lines[:8], "... 2 more lines"]
    assert fitted(lines, 3, 4) == ["lin", "lin", "lin", "..."]
    assert len(fitted(lines, 80, 1)) == 4


def test_a_sentence_is_folded_so_that_what_to_do_is_seen_and_a_table_is_cut_off() -> None:
    said = "! not localised: not enough motion; drive curves, and not side by side"
    row = "    1    0 s   0 %       yes  -19310427.8"
    assert fitted([said, "", row], 40, 24) == [
        "! not localised: not enough motion;",
        "  drive curves, and not side by side",
        "",
        row[:40],
    ]
    assert fitted([said], len(said), 24) == [said]
    assert fitted([said], 19, 24) == [said[:19]]


def test_a_time_is_said_in_the_unit_that_one_would_say() -> None:
    spans = {0.4: "0 s", 119: "119 s", 120: "2 min", 7_199: "120 min", 7_200: "2 h"}
    assert {seconds: span(seconds) for seconds in spans} == spans
    assert span(3 * 86_400) == "3 d"


def test_columns_are_as_wide_as_their_widest_cell() -> None:
    assert columns([("a", "bb"), ("ccc", "d")]) == ["  a  bb", "ccc   d"]


def test_where_a_peer_may_be_is_one_sentence() -> None:
    whole = answer()
    whole["hypotheses"] = [{"robot": 1, "what": "robot 1 is at one of 2 places"}]
    assert "? robot 1 is at one of 2 places" in table(whole)
