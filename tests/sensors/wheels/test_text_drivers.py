"""Bases that speak in lines: Roboteq controllers and the project's own $ODO line."""

from __future__ import annotations

import random

import pytest
from frames import SECOND_US, ascii_line, cut
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.samples import WheelCounts
from drslamd.sensors.wheels.ascii_odometry import AsciiDriver
from drslamd.sensors.wheels.roboteq import RoboteqDriver
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

MS = 1000
T0 = 100 * SECOND_US


# ---- Roboteq -----------------------------------------------------------------------------------


def roboteq(swap_channels: bool = False) -> RoboteqDriver:
    return RoboteqDriver(25.0, swap_channels)


def test_a_reply_gives_both_counters_at_its_arrival() -> None:
    assert roboteq().feed(b"C=12345:-6789\r", T0) == [WheelCounts(T0, 12345, -6789, 32)]


def test_channels_may_be_swapped() -> None:
    assert roboteq(True).feed(b"C=12345:-6789\r", T0) == [WheelCounts(T0, -6789, 12345, 32)]


def test_the_first_poll_stops_echoes() -> None:
    driver = roboteq()
    assert driver.poll(T0) == b"^ECHOF 1\r?C\r"
    assert driver.poll(T0 + 40 * MS) == b"?C\r"


@pytest.mark.parametrize(("after", "due"), [(39_999, False), (40_000, True)])
def test_the_controller_is_asked_at_the_poll_rate(after: int, due: bool) -> None:
    driver = roboteq()
    driver.poll(T0)
    assert driver.poll(T0 + after) == (b"?C\r" if due else b"")


def test_late_polls_keep_the_rhythm() -> None:
    driver = roboteq()
    asked = [k for k in range(0, 1000, 13) if driver.poll(T0 + k * MS)]
    assert len(asked) == 25


def test_after_being_held_up_there_is_no_burst() -> None:
    driver = roboteq()
    driver.poll(T0)
    assert driver.poll(T0 + SECOND_US) == b"?C\r"
    assert driver.poll(T0 + SECOND_US + 39 * MS) == b""


def test_an_echo_is_dropped_and_stopped_again() -> None:
    driver = roboteq()
    driver.poll(T0)
    assert len(driver.feed(b"?C\rC=1:2\r", T0)) == 1
    assert driver.poll(T0 + 40 * MS) == b"^ECHOF 1\r?C\r"
    assert driver.poll(T0 + 80 * MS) == b"?C\r"


def test_lines_that_are_no_counters_are_ignored() -> None:
    driver = roboteq()
    assert driver.feed(b"+\r-\r^ECHOF 1\rV=135:246:4730\rCR=-17:22\rBSR=500\r", T0) == []
    assert driver.tally.ignored == 6
    assert driver.tally.refused.total() == 0


@pytest.mark.parametrize(
    "line",
    [
        b"C=",
        b"C=5",
        b"C=1:2:3",
        b"C=1:",
        b"C=:2",
        b"C=1:2x",
        b"C=1.5:2",
        b"C=--1:2",
        b"C=+1:2",
        b"C= 1:2",
        b"C=1:\xff2",
        b"C=2147483648:0",
        b"C=0:-2147483649",
        b"C=99999999999:0",
    ],
)
def test_a_reply_of_another_form_is_refused(line: bytes) -> None:
    driver = roboteq()
    assert driver.feed(line + b"\r", T0) == []
    assert driver.tally.refused == {WheelRefusal.MALFORMED: 1}


def test_counters_use_all_32_bits() -> None:
    (sample,) = roboteq().feed(b"C=-2147483648:2147483647\r", T0)
    assert sample == WheelCounts(T0, -(1 << 31), (1 << 31) - 1, 32)


@pytest.mark.parametrize("value", range(256))
def test_a_poisoned_byte_costs_roboteq_one_line_at_most(value: int) -> None:
    driver = roboteq()
    samples = driver.feed(bytes([value]) + b"C=1:2\rC=3:4\r", T0)
    assert samples[-1] == WheelCounts(T0, 3, 4, 32)
    assert samples[:-1] in ([], [WheelCounts(T0, 1, 2, 32)])


def test_every_line_ends_in_exactly_one_count() -> None:
    driver = roboteq()
    driver.feed(b"C=1:2\r?C\rC=5\r" + b"x" * 500 + b"\rC=3:4\r", T0)
    assert (driver.tally.accepted, driver.tally.ignored) == (2, 1)
    assert driver.tally.refused == {WheelRefusal.MALFORMED: 1, WheelRefusal.OVERLONG: 1}
    assert driver.tally.received == 5


# ---- $ODO --------------------------------------------------------------------------------------


def test_the_first_line_gives_nothing_the_others_counters() -> None:
    driver = AsciiDriver()
    assert driver.feed(ascii_line(1000, 10, -20), T0) == []
    samples = driver.feed(ascii_line(1020, 15, -25), T0 + 20 * MS)
    assert samples == [WheelCounts(T0 + 20 * MS, 15, -25, 32)]


def test_the_line_in_the_documentation_is_read() -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(123_436, 1500, -40), T0)
    (sample,) = driver.feed(b"$ODO,123456,1532,-48*4B\n", T0 + 20 * MS)
    assert sample == WheelCounts(T0 + 20 * MS, 1532, -48, 32)


def test_time_wraps_as_millis_does() -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line((1 << 32) - 10, 0, 0), T0)
    (sample,) = driver.feed(ascii_line(10, 1, 1), T0 + 20 * MS)
    assert sample.utime == T0 + 20 * MS


@pytest.mark.parametrize(("count", "fits"), [(1 << 32, False), ((1 << 32) - 1, True)])
def test_counters_may_be_unsigned(count: int, fits: bool) -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(1000, 0, 0), T0)
    assert len(driver.feed(ascii_line(1020, count, 0), T0 + 20 * MS)) == fits


@pytest.mark.parametrize(("count", "fits"), [(-(1 << 31) - 1, False), (-(1 << 31), True)])
def test_counters_may_be_signed(count: int, fits: bool) -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(1000, 0, 0), T0)
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
        (ascii_line(5, 1, 2).strip(), WheelRefusal.TIME),
    ],
)
def test_a_damaged_line_is_refused_for_its_reason(line: bytes, reason: WheelRefusal) -> None:
    driver = AsciiDriver()
    assert driver.feed(line + b"\n", T0) == []
    assert driver.tally.refused == {reason: 1}


def test_whatever_else_the_base_prints_is_ignored() -> None:
    driver = AsciiDriver()
    driver.feed(b"booting v1.2\r\nODO,1,2,3\r\n\xff\xfe\r\n", T0)
    assert (driver.tally.ignored, driver.tally.received) == (3, 3)


def test_a_line_behind_a_torn_one_is_read() -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(1000, 0, 0), T0)
    assert len(driver.feed(b"$ODO,1020,1" + ascii_line(1040, 2, 2), T0 + 40 * MS)) == 1


@pytest.mark.parametrize("value", range(256))
def test_a_poisoned_byte_before_a_line_costs_nothing(value: int) -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(1000, 0, 0), T0)
    assert len(driver.feed(bytes([value]) + ascii_line(1020, 2, 2), T0 + 20 * MS)) == 1


# ---- both --------------------------------------------------------------------------------------


def outcome(driver: AsciiDriver | RoboteqDriver, reads: list[bytes]) -> tuple[object, object]:
    return [s for read in reads for s in driver.feed(read, T0)], driver.tally


@pytest.mark.parametrize("seed", range(5))
def test_whole_and_byte_by_byte_and_random_reads_give_the_same(seed: int) -> None:
    draw = random.Random(seed)
    parts = [ascii_line(1000 + 20 * k, k, -k) for k in range(40)]
    parts += [b"C=%d:%d\r" % (k, -k) for k in range(40)]
    parts += [draw.randbytes(draw.randint(1, 200)) for _ in range(20)]
    draw.shuffle(parts)
    stream = b"".join(parts)
    for make in (AsciiDriver, roboteq):
        whole = outcome(make(), [stream])
        assert outcome(make(), [stream[i : i + 1] for i in range(len(stream))]) == whole
        assert outcome(make(), list(cut(stream, seed))) == whole


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.binary(max_size=300))
def test_no_bytes_make_a_driver_raise(data: bytes) -> None:
    for stream in (data, b"C=" + data + b"\r", b"$ODO," + data + b"\n"):
        roboteq().feed(stream, T0)
        AsciiDriver().feed(stream, T0)


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.integers(0, 20), st.integers(0, 7))
def test_no_single_bit_flip_in_an_odo_line_gives_a_sample(position: int, bit: int) -> None:
    driver = AsciiDriver()
    driver.feed(ascii_line(1000, 100, 200), T0)
    line = bytearray(ascii_line(1020, 103, 205))
    line[position % (len(line) - 2)] ^= 1 << bit
    samples = driver.feed(bytes(line), T0 + 20 * MS)
    assert samples in ([], [WheelCounts(T0 + 20 * MS, 103, 205, 32)])  # the case of a hex digit
