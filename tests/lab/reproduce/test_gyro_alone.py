"""A robot and its gyro without a team: which windows count, and when a row is reached."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.reproduce.experiment import SCENE, trial
from lab.reproduce.gyro import alone
from lab.reproduce.gyro.alone import Drive
from lab.reproduce.gyro.gyro_rows import CASES

BY_NAME = {case.name: case for case in CASES}


def test_windows_that_begin_or_end_while_nobody_knew_do_not_count() -> None:
    """The heading is off by 1 between the fault at 100 s and its name at 105 s, and is given back
    within two seconds; from 120 s on it is off by 0.5."""
    seconds = np.arange(1.0, 201.0)
    off = np.where((seconds >= 100) & (seconds < 106), 1.0, 0.0)
    off[seconds >= 120] = 0.5
    errors = alone.windows(Drive(off, 5.0), 100.0, 5.0)
    # ends from 108 to 200 s, without those whose window began from 100 to 107 s
    assert len(errors) == 93 - 8
    assert set(errors.tolist()) == {0.0, 0.5}
    assert np.sum(errors == 0.5) == 40 - 8


@pytest.mark.parametrize(
    ("named_s", "size", "is_reached"),
    [(10.0, 1.0, True), (10.1, 1.0, False), (np.inf, 1.0, False), (10.0, 1.01, False)],
)
def test_a_fault_is_reached_when_it_is_named_in_time_and_costs_nothing(
    named_s: float, size: float, is_reached: bool
) -> None:
    seconds = np.arange(1.0, 301.0)
    without = [Drive(0.01 * seconds, np.inf)]
    drives = [Drive(0.01 * size * seconds, named_s)]
    text, reached = alone.line(BY_NAME["stuck"], drives, without)
    assert reached is is_reached
    assert f"| {np.degrees(0.4 * size):.2f} | {size:.2f} |" in text


def test_a_stuck_gyro_of_one_robot_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = replace(SCENE, seconds=140.0)
    monkeypatch.setattr(alone, "trial", lambda seed: trial(seed, scene))
    found = alone.drive(BY_NAME["stuck"], 1)
    assert 4.0 < found.named_s < 10.0
    assert len(found.off) == 138
    # before it stuck the heading was that of the gyro, but for the trial at the beginning
    assert np.ptp(found.off[60:118]) < np.radians(1.0)
