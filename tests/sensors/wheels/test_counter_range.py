"""Counters that end before their bits do, as a DBC file says or does not mean it."""

from __future__ import annotations

import struct
from typing import Any

import pytest

from drslamd.config_wheels import DbcSection
from drslamd.events import CanFrame
from drslamd.sensors.wheels.wheel_driver import WheelRefusal
from drslamd.sensors.wheels.wheel_input import WheelInput

MS = 1_000
FILE = """VERSION ""
NS_ :
BS_:
BU_: A
BO_ 528 W: 8 A
 SG_ L : 0|{bits}@1{sign} ({factor},{offset}) [{low}|{high}] "" A
 SG_ R : 16|{bits}@1{sign} ({factor},{offset}) [{low}|{high}] "" A
"""


def base(low: float, high: float, counter_bits: int | None = None, **file: Any) -> WheelInput:
    """Of 1,000 counts a metre; 3 m/s are 300 of them in a tenth of a second."""
    how = {"bits": 16, "sign": "+", "factor": 1, "offset": 0, **file}
    section = DbcSection(
        source="dbc", track_m=0.5, dbc_file="x.dbc", measures="counts", left="W.L", right="W.R",
        counts_per_metre=1000.0, counter_bits=counter_bits,
    )  # fmt: skip
    return WheelInput(section, FILE.format(low=low, high=high, **how))


def driven(wheels: WheelInput, counts: list[int], first: int = 0) -> float:
    """How far, m, by these readings, one each 50 ms."""
    way = 0.0
    for k, count in enumerate(counts):
        data = struct.pack("<HH4x", count % 65_536, count % 65_536)
        frame = CanFrame((first + k) * 50 * MS, 528, False, data)
        way += sum(motion.distance_m for motion in wheels.on_frame(frame))
    return way


def turning(values: int, step: int, times: int = 400, begin: int = 0) -> list[int]:
    return [(begin + step * k) % values for k in range(times)]


@pytest.mark.row("D10")
@pytest.mark.parametrize("step", [49, -49, 1])
@pytest.mark.parametrize("values", [1_000, 1_001, 50_000, 65_000])
def test_a_counter_goes_around_where_the_file_says_that_it_ends(values: int, step: int) -> None:
    wheels = base(0, values - 1)
    begin = 30 if step > 0 else values - 30
    assert driven(wheels, turning(values, step, begin=begin)) == pytest.approx(0.399 * step)
    assert wheels.base.gaps.total() == 1


@pytest.mark.parametrize(
    ("low", "high", "file"),
    [
        (0, 99.9, {"factor": 0.1}),
        (-5, 994, {"offset": -5}),
        (-999, 0, {"factor": -1}),
    ],
)
def test_the_ends_are_those_of_the_number_that_is_sent(
    low: float, high: float, file: dict[str, Any]
) -> None:
    sign = -1 if file.get("factor") == -1 else 1
    assert driven(base(low, high, **file), turning(1_000, 49)) == pytest.approx(sign * 19.551)


@pytest.mark.row("D10")
@pytest.mark.parametrize("step", [49, -49, 131])
def test_a_counter_that_goes_on_beyond_has_all_its_bits(step: int) -> None:
    wheels = base(0, 999)
    assert driven(wheels, turning(65_536, step, 2_000)) == pytest.approx(1.999 * step)
    assert wheels.base.gaps.total() == 1
    assert wheels.driver.tally.refused == {WheelRefusal.NOT_AVAILABLE: 1}


def test_one_reading_beyond_is_none_and_changes_nothing() -> None:
    wheels, counts = base(0, 64_255), turning(64_256, 50, 3_000)
    counts[700] = counts[1_500] = 0xFE01
    assert driven(wheels, counts) == pytest.approx(149.95)
    assert wheels.driver.tally.refused == {WheelRefusal.NOT_AVAILABLE: 2}


@pytest.mark.parametrize(
    ("low", "high"), [(0, 0), (0, 1), (0, 499), (0, 999.5), (0, 65_533), (5, 5), (0, 1e300)]
)
def test_a_range_that_cannot_be_one_of_a_counter_is_not_believed(low: float, high: float) -> None:
    """Too short for what 3 m/s bring in one sample, no whole number, or full but for marks."""
    wheels = base(low, high)
    assert driven(wheels, [0] * 50) == 0.0
    assert wheels.base.gaps.total() == 1
    assert driven(wheels, turning(65_536, 49, 1_500), 50) == pytest.approx(1.499 * 49, abs=0.06)
    assert wheels.driver.tally.refused == {}


def test_what_the_configuration_says_counts_instead() -> None:
    wheels = base(0, 999, counter_bits=16)
    assert driven(wheels, turning(65_536, 49, 1_500)) == pytest.approx(1.499 * 49)
    assert wheels.driver.tally.refused == {}
