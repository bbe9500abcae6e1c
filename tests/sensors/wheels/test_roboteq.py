"""Roboteq controllers, which are asked and answer in lines."""

from __future__ import annotations

import random

import pytest
from frames import SECOND_US, cut
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.samples import WheelCounts
from drslamd.sensors.wheels.roboteq import RoboteqDriver
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

MS = 1000
T0 = 100 * SECOND_US


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


def test_a_poisoned_byte_costs_roboteq_one_line_at_most() -> None:
    for value in range(256):
        driver = roboteq()
        samples = driver.feed(bytes([value]) + b"C=1:2\rC=3:4\r", T0)
        assert samples[-1] == WheelCounts(T0, 3, 4, 32), value
        assert samples[:-1] in ([], [WheelCounts(T0, 1, 2, 32)]), value


def test_every_line_ends_in_exactly_one_count() -> None:
    driver = roboteq()
    driver.feed(b"C=1:2\r?C\rC=5\r" + b"x" * 500 + b"\rC=3:4\r", T0)
    assert (driver.tally.accepted, driver.tally.ignored) == (2, 1)
    assert driver.tally.refused == {WheelRefusal.MALFORMED: 1, WheelRefusal.OVERLONG: 1}
    assert driver.tally.received == 5


def outcome(reads: list[bytes]) -> tuple[object, object]:
    driver = roboteq()
    return [s for read in reads for s in driver.feed(read, T0)], driver.tally


@pytest.mark.parametrize("seed", range(5))
def test_whole_and_byte_by_byte_and_random_reads_give_the_same(seed: int) -> None:
    draw = random.Random(seed)
    parts = [b"C=%d:%d\r" % (k, -k) for k in range(40)]
    parts += [draw.randbytes(draw.randint(1, 200)) for _ in range(20)]
    draw.shuffle(parts)
    stream = b"".join(parts)
    whole = outcome([stream])
    assert outcome([stream[i : i + 1] for i in range(len(stream))]) == whole
    assert outcome(list(cut(stream, seed))) == whole


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.binary(max_size=300))
def test_no_bytes_make_the_driver_raise(data: bytes) -> None:
    for stream in (data, b"C=" + data + b"\r"):
        roboteq().feed(stream, T0)


# counters that are none


def zeros(driver: RoboteqDriver, seconds: int, also: bytes = b"") -> bytes:
    """All that is asked while every answer is 0:0 (and `also`)."""
    asked = b""
    for k in range(seconds * 25 + 1):
        asked += driver.poll(T0 + k * 40 * MS)
        driver.feed(b"C=0:0\r" + also, T0 + k * 40 * MS)
    return asked


def test_hall_sensors_that_count_beside_encoders_at_zero_are_named() -> None:
    driver = roboteq()
    asked = zeros(driver, 2)
    assert asked.count(b"?CB\r") == 2
    assert driver.fault() is None
    driver.feed(b"CB=512:-77\r", T0 + 3 * SECOND_US)
    said = driver.fault()
    assert said is not None
    assert 'wheels.counter = "hall"' in said


@pytest.mark.parametrize(("seconds", "is_said"), [(9, False), (10, True)])
def test_counters_that_stay_at_zero_are_worth_a_word(seconds: int, is_said: bool) -> None:
    driver = roboteq()
    zeros(driver, seconds)
    assert (driver.fault() is not None) == is_said
    driver.feed(b"C=1:0\r", T0 + 20 * SECOND_US)
    assert driver.fault() is None


def test_a_base_that_has_not_moved_by_any_counter_is_no_fault() -> None:
    driver = roboteq()
    zeros(driver, 20, also=b"CB=0:0\r")
    assert driver.fault() is None


def test_hall_counters_are_asked_for_and_read() -> None:
    driver = RoboteqDriver(25.0, swap_channels=False, counter="hall")
    assert driver.poll(T0) == b"^ECHOF 1\r?CB\r"
    assert driver.feed(b"CB=5:-6\rC=1:1\r", T0) == [WheelCounts(T0, 5, -6, 32)]
    assert driver.expects == "answers CB=<left>:<right> to the query ?CB"


def test_a_refusal_has_its_own_sentence() -> None:
    driver = roboteq()
    assert driver.why_no_sample(T0) is None
    driver.feed(b"-\r", T0)
    said = driver.why_no_sample(T0 + SECOND_US)
    assert said is not None
    assert "refuses the query ?C" in said
    assert driver.why_no_sample(T0 + 2 * SECOND_US) is None
