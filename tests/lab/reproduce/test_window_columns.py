"""Module 1 by itself, both columns on the same windows."""

from __future__ import annotations

from lab.reproduce import experiment, window_columns


def test_windows_are_answered_by_every_way_and_by_both_columns() -> None:
    tally = window_columns.table1(experiment.trial(0), 332, 332)
    for tau in window_columns.TAUS:
        for way in ("nls", "coarse", "both"):
            assert tally[f"table1/{tau}/{way}/m"].n == 6
        assert tally[f"table1/{tau}/drslamd/unique"].n == 6
