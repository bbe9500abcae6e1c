"""Scores as a table."""

from __future__ import annotations

from lab.score import table


def test_who_was_never_localised_has_a_row_that_says_so() -> None:
    errors = {"ate_rmse_m": 0.25, "rot_mean_deg": 3.5}
    given = {"robots": {"0": errors, "1": errors}, "team": errors}
    lines = table.lines({"odometry": given, "robots": {"1": errors}, "team": None})
    assert lines[2].split() == ["robot", "0", "0.250", "3.50", "not", "localised"]
    assert lines[3].split() == ["robot", "1", "0.250", "3.50", "0.250", "3.50"]
    assert lines[4].split()[-2:] == ["not", "localised"]
