"""Wheel samples a second."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.odometry_rate import odometry_rate


@pytest.mark.parametrize(("samples", "is_found"), [(0, False), (19, True), (20, False)])
def test_rare_samples_are_a_finding(samples: int, is_found: bool) -> None:
    case = Case()
    case.stop("wheels", "counters", "samples.accepted")
    case.grow("wheels", "counters", "samples.accepted", by=samples)
    assert bool(found(odometry_rate, case)) is is_found


def test_what_the_daemon_says_of_the_wheels_is_repeated() -> None:
    case = Case()
    case.say("wheels", "wheels: lost: /dev/x; check its power and the cable")
    assert found(odometry_rate, case) == ["wheels: lost: /dev/x; check its power and the cable"]
