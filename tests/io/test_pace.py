"""How long computations took of late, and how late the loop was."""

from __future__ import annotations

import pytest

from drslamd.io.pace import KEPT, Pace


def test_nothing_is_known_before_anything_was_computed() -> None:
    assert Pace().milliseconds() == {}
    assert Pace().lag() == {"median": 0.0, "p99": 0.0}


def test_every_module_has_its_own_durations() -> None:
    pace = Pace()
    for ms in (1.0, 2.0, 9.00049):
        pace.took("optimizer", ms)
    pace.took("consistency", 0.25)
    found = pace.milliseconds()
    assert set(found) == {"optimizer", "consistency"}
    assert found["optimizer"]["all"] == [1.0, 2.0, 9.0]
    assert found["optimizer"]["median"] == 2.0
    assert found["optimizer"]["p99"] == pytest.approx(9.0, abs=0.2)
    assert found["consistency"] == {"median": 0.25, "p99": 0.25, "all": [0.25]}


def test_one_slow_run_of_a_hundred_is_in_the_p99_and_not_in_the_median() -> None:
    pace = Pace()
    for ms in [1.0] * 98 + [50.0, 50.0]:
        pace.lags.append(ms)
    assert pace.lag() == {"median": 1.0, "p99": 50.0}


def test_only_the_latest_are_kept() -> None:
    pace = Pace()
    for k in range(KEPT + 5):
        pace.took("optimizer", float(k))
        pace.lags.append(float(k))
    kept = pace.milliseconds()["optimizer"]["all"]
    assert (len(kept), kept[0], kept[-1]) == (KEPT, 5.0, KEPT + 4.0)
    assert len(pace.lags) == KEPT == 1_000
