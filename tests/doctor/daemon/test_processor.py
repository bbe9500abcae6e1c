"""The computer under the daemon."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.processor import processor


@pytest.mark.parametrize(("cpu_s", "is_found"), [(1.6, False), (1.7, True)])
def test_most_of_a_core_is_a_finding(cpu_s: float, is_found: bool) -> None:
    case = Case()
    case.stop("cpu_s")
    case.grow("cpu_s", by=cpu_s)
    assert bool(found(processor, case)) is is_found


@pytest.mark.parametrize(("late", "is_found"), [(100.0, False), (101.0, True)])
def test_so_is_a_loop_that_is_woken_late(late: float, is_found: bool) -> None:
    case = Case()
    case.now["loop_lag_ms"]["p99"] = late
    assert bool(found(processor, case)) is is_found


def test_modules_that_run_too_rarely_are_told() -> None:
    case = Case()
    case.say("load", "optimizer runs every 4 s")
    assert found(processor, case) == ["optimizer runs every 4 s"]
