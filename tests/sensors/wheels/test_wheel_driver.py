"""What becomes of one packet, line or frame: it is counted, and its samples are handed on."""

from __future__ import annotations

import pytest

from drslamd.sensors.samples import WheelCounts, WheelSample
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.agilex import AgilexDriver
from drslamd.sensors.wheels.ascii_odometry import AsciiDriver
from drslamd.sensors.wheels.kobuki import KobukiDriver
from drslamd.sensors.wheels.odrive import OdriveDriver
from drslamd.sensors.wheels.roboteq import RoboteqDriver
from drslamd.sensors.wheels.wheel_driver import (
    CanDriver,
    Outcome,
    PolledDriver,
    SerialDriver,
    WheelDriver,
    WheelRefusal,
    tallied,
)

SAMPLE = WheelCounts(7, 1, 2, 32)


@pytest.mark.parametrize(
    ("outcome", "samples", "counts"),
    [
        ([SAMPLE], [SAMPLE], (1, 0, {})),
        # a frame may be in order and complete no sample
        ([], [], (1, 0, {})),
        (None, [], (0, 1, {})),
        (WheelRefusal.SHORT, [], (0, 0, {WheelRefusal.SHORT: 1})),
    ],
)
def test_an_outcome_is_accepted_ignored_or_refused(
    outcome: Outcome, samples: list[WheelSample], counts: tuple[int, int, dict[WheelRefusal, int]]
) -> None:
    tally: Tally[WheelRefusal] = Tally()
    assert tallied(tally, outcome) == samples
    assert (tally.accepted, tally.ignored, dict(tally.refused)) == counts


@pytest.mark.parametrize(
    ("driver", "is_serial", "is_polled", "is_can"),
    [
        (KobukiDriver(), True, False, False),
        (AsciiDriver(), True, False, False),
        (RoboteqDriver(25.0, False), True, True, False),
        (OdriveDriver(0, 1), False, False, True),
        (AgilexDriver(), False, False, True),
    ],
)
def test_a_driver_is_told_by_what_it_can_do(
    driver: WheelDriver, is_serial: bool, is_polled: bool, is_can: bool
) -> None:
    assert isinstance(driver, SerialDriver) == is_serial
    assert isinstance(driver, PolledDriver) == is_polled
    assert isinstance(driver, CanDriver) == is_can


def test_a_base_that_reports_nothing_has_no_fault_and_loses_nothing() -> None:
    assert KobukiDriver().fault() is None
    assert KobukiDriver().unpaired() == 0
