"""A hole in the odometry as it is measured."""

from __future__ import annotations

import pytest
from lab.trust.holes import Hole, lines, play, row


def test_lines_count_only_who_was_localised_before() -> None:
    assert lines([Hole()]) == []
    found = [
        Hole(True, [(0.2, 0.5), (0.4, 4.0)], 1, 4.5, 0.1, 0.05, 0),
        Hole(True, [(0.3, 1.5)], 0, 6.0, 0.6, 0.02, 3),
        Hole(False, [(9.0, 99.0)], 7, 1.0, 9.0, 3.0, 9),
    ]
    said = "\n".join(lines(found))
    assert "2 of 3 runs" in said
    assert "0.30 m off (median), squared error by its covariance 2.00 (mean), 67%" in said
    assert "1 looks without a position" in said
    assert "within 5 s: 50%, within 10 s: 100%, after 5.2 s (median), 6.0 s (longest)" in said
    assert "at most 0.60 m and 2.9 degrees off; 1 of 2 over" in said
    assert said.endswith("wrong: 3")


@pytest.mark.slow
def test_one_hole_is_survived() -> None:
    hole = play("cable", 3)
    assert hole.was_localised
    assert hole.back_s <= 10
    assert hole.back_m < 0.5
    assert hole.wrong == 0


@pytest.mark.slow
def test_one_restart_is_survived() -> None:
    """What is known a second after it is back is vague, and says so."""
    hole = play("restart", 3, until_s=50.0)
    assert hole.was_localised
    assert hole.back_s <= 12
    assert hole.back_m < 1.0
    assert hole.wrong == 0


def test_a_row_says_how_one_run_went() -> None:
    assert row(4, Hole()) == "seed 4: was not localised before"
    assert row(4, Hole(True)) == "seed 4: never back"
    found = Hole(True, [], 0, 4.5, 0.123, 0.05, 2)
    assert row(4, found) == "seed 4: back after 4.5 s, 0.12 m and 2.9 degrees off, 2 wrong"
