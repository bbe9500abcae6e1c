"""The project's own $ODO line."""

from __future__ import annotations

import math
import random
from functools import reduce
from operator import xor

import pytest
from frames import SECOND_US, ascii_line, cut
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.samples import GyroAngle, WheelCounts
from drslamd.sensors.wheels.ascii_odometry import AsciiDriver
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

MS = 1000
T0 = 100 * SECOND_US


def begun() -> AsciiDriver:
    """That has heard two lines, at T0 - 20 ms and at T0."""
    driver = AsciiDriver()
    driver.feed(ascii_line(980, 0, 0), T0 - 20 * MS)
    driver.feed(ascii_line(1000, 0, 0), T0)
    return driver


def test_the_first_line_waits_for_the_second() -> None:
    driver = AsciiDriver()
    assert driver.feed(ascii_line(1000, 10, -20), T0) == []
    samples = driver.feed(ascii_line(1020, 15, -25), T0 + 20 * MS)
    assert samples == [WheelCounts(T0, 10, -20, 32), WheelCounts(T0 + 20 * MS, 15, -25, 32)]


@pytest.mark.parametrize(("after_ms", "count"), [(1_000, 2), (1_001, 1), (600_000, 1)])
def test_a_first_line_that_is_old_is_not_where_the_odometry_begins(
    after_ms: int, count: int
) -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(1000, 10, -20), T0)
    samples = driver.feed(ascii_line(1000 + after_ms, 15, -25), T0 + after_ms * MS)
    assert len(samples) == count
    assert samples[-1] == WheelCounts(T0 + after_ms * MS, 15, -25, 32)


def test_the_line_in_the_documentation_is_read() -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(123_436, 1500, -40), T0)
    *_, sample = driver.feed(b"$ODO,123456,1532,-48*4B\n", T0 + 20 * MS)
    assert sample == WheelCounts(T0 + 20 * MS, 1532, -48, 32)


def test_time_wraps_as_millis_does() -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line((1 << 32) - 10, 0, 0), T0)
    samples = driver.feed(ascii_line(10, 1, 1), T0 + 20 * MS)
    assert [sample.utime for sample in samples] == [T0, T0 + 20 * MS]


@pytest.mark.parametrize(("count", "fits"), [(1 << 32, False), ((1 << 32) - 1, True)])
def test_counters_may_be_unsigned(count: int, fits: bool) -> None:
    driver = begun()
    assert len(driver.feed(ascii_line(1020, count, 0), T0 + 20 * MS)) == fits


@pytest.mark.parametrize(("count", "fits"), [(-(1 << 31) - 1, False), (-(1 << 31), True)])
def test_counters_may_be_signed(count: int, fits: bool) -> None:
    driver = begun()
    assert len(driver.feed(ascii_line(1020, 0, count), T0 + 20 * MS)) == fits


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"$ODO,1,2,3*00", WheelRefusal.CHECKSUM),
        (b"$ODO,123456,1532,-48*4A", WheelRefusal.CHECKSUM),
        (b"$ODO,123456,1532,-48", WheelRefusal.MALFORMED),
        (b"$ODO,123456,1532*4B", WheelRefusal.MALFORMED),
        (b"$ODO,123456,1532,-48*4B,", WheelRefusal.MALFORMED),
        (b"$ODO,-5,1532,-48*4B", WheelRefusal.MALFORMED),
        (ascii_line(1 << 32, 1, 2).strip(), WheelRefusal.MALFORMED),
    ],
)
def test_a_damaged_line_is_refused_for_its_reason(line: bytes, reason: WheelRefusal) -> None:
    driver = AsciiDriver()
    assert driver.feed(line + b"\n", T0) == []
    assert driver.tally.refused == {reason: 1}


def test_a_time_that_does_not_go_on_is_refused() -> None:
    driver = begun()
    assert driver.feed(ascii_line(20_000, 1, 2), T0 + 20 * MS) == []
    assert driver.tally.refused == {WheelRefusal.TIME: 1}
    (sample,) = driver.feed(ascii_line(1040, 3, 4), T0 + 40 * MS)
    assert sample == WheelCounts(T0 + 40 * MS, 3, 4, 32)
    assert driver.tally.accepted == 3


def test_whatever_else_the_base_prints_is_ignored() -> None:
    driver = AsciiDriver()
    driver.feed(b"booting v1.2\r\nODO,1,2,3\r\n\xff\xfe\r\n", T0)
    assert (driver.tally.ignored, driver.tally.received) == (3, 3)


def test_a_line_behind_a_torn_one_is_read() -> None:
    driver = begun()
    assert len(driver.feed(b"$ODO,1020,1" + ascii_line(1040, 2, 2), T0 + 40 * MS)) == 1


def test_a_poisoned_byte_before_a_line_costs_nothing() -> None:
    for value in range(256):
        driver = begun()
        assert len(driver.feed(bytes([value]) + ascii_line(1020, 2, 2), T0 + 20 * MS)) == 1, value


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.integers(0, 20), st.integers(0, 7))
def test_no_single_bit_flip_in_an_odo_line_gives_a_sample(position: int, bit: int) -> None:
    driver = begun()
    line = bytearray(ascii_line(1020, 103, 205))
    line[position % (len(line) - 2)] ^= 1 << bit
    samples = driver.feed(bytes(line), T0 + 20 * MS)
    assert samples in ([], [WheelCounts(T0 + 20 * MS, 103, 205, 32)])  # the case of a hex digit


def outcome(reads: list[bytes]) -> tuple[object, object]:
    driver = AsciiDriver()
    return [s for read in reads for s in driver.feed(read, T0)], driver.tally


@pytest.mark.parametrize("seed", range(5))
def test_whole_and_byte_by_byte_and_random_reads_give_the_same(seed: int) -> None:
    draw = random.Random(seed)
    parts = [ascii_line(1000 + 20 * k, k, -k) for k in range(40)]
    parts += [draw.randbytes(draw.randint(1, 200)) for _ in range(20)]
    draw.shuffle(parts)
    stream = b"".join(parts)
    whole = outcome([stream])
    assert outcome([stream[i : i + 1] for i in range(len(stream))]) == whole
    assert outcome(list(cut(stream, seed))) == whole


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.binary(max_size=300))
def test_no_bytes_make_the_driver_raise(data: bytes) -> None:
    for stream in (data, b"$ODO," + data + b"\n"):
        AsciiDriver().feed(stream, T0)


def line(text: str) -> bytes:
    return f"${text}*{reduce(xor, text.encode()):02X}\n".encode()


@pytest.mark.parametrize(
    ("column", "degrees"),
    [("12.5", 12.5), ("-179.9999", -179.9999), ("1234567", 1_234_567.0), ("0", 0.0)],
)
def test_a_fourth_column_is_the_angle_of_a_gyro(column: str, degrees: float) -> None:
    driver = begun()
    gyro, counts = driver.feed(line(f"ODO,1020,5,7,{column}"), T0 + 20 * MS)
    assert gyro == GyroAngle(T0 + 20 * MS, math.radians(degrees))
    assert counts == WheelCounts(T0 + 20 * MS, 5, 7, 32)


@pytest.mark.parametrize("column", ["", "1.23456", "12345678", "1e3", "nan", "1,2", "."])
def test_a_column_that_is_no_angle_makes_the_line_malformed(column: str) -> None:
    driver = AsciiDriver()
    driver.feed(line("ODO,1000,0,0"), T0)
    assert driver.feed(line(f"ODO,1020,5,7,{column}"), T0 + 20 * MS) == []
    assert driver.tally.refused[WheelRefusal.MALFORMED] == 1
