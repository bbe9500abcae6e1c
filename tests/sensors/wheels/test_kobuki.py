"""Kobuki packets: wheel counters with the time of the base."""

from __future__ import annotations

import math
import random
import struct

import pytest
from frames import KOBUKI_REST, SECOND_US, cut, kobuki_core, kobuki_packet
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.frame_scanner import FrameScanner
from drslamd.sensors.samples import GyroAngle, GyroRate, WheelCounts, WheelSample
from drslamd.sensors.wheels.kobuki import KobukiDriver, KobukiFormat, sub_payloads
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

MS = 1000
T0 = 100 * SECOND_US


def packets(count: int, start_ms: int = 61840, start_count: int = 11245) -> list[bytes]:
    """Full packets every 20 ms; the left wheel goes 8 counts forward, the right 7 backward."""
    return [
        kobuki_packet(
            kobuki_core(start_ms + 20 * k, start_count + 8 * k, start_count - 7 * k) + KOBUKI_REST
        )
        for k in range(count)
    ]


def counts(samples: list[WheelSample]) -> list[WheelCounts]:
    return [sample for sample in samples if isinstance(sample, WheelCounts)]


def fed(reads: list[bytes]) -> tuple[list[WheelSample], object]:
    driver = KobukiDriver()
    return [s for read in reads for s in driver.feed(read, T0)], driver.tally


def test_the_first_packet_waits_for_the_second() -> None:
    driver = KobukiDriver()
    samples = [driver.feed(packet, T0 + 20 * k * MS) for k, packet in enumerate(packets(3))]
    assert [counts(found) for found in samples] == [
        [],
        [WheelCounts(T0, 11245, 11245, 16), WheelCounts(T0 + 20 * MS, 11253, 11238, 16)],
        [WheelCounts(T0 + 40 * MS, 11261, 11231, 16)],
    ]
    assert driver.tally.accepted == driver.tally.received == 3


def test_a_first_packet_that_none_continues_is_no_sample() -> None:
    """The base was switched off and on again after it."""
    driver = KobukiDriver()
    stream = [*packets(1, 40_000, 7), *packets(3)]
    samples = [s for k, one in enumerate(stream) for s in driver.feed(one, T0 + 20 * k * MS)]
    assert [s.left for s in counts(samples)] == [11245, 11253, 11261]
    assert counts(samples)[0].utime == T0 + 20 * MS
    assert driver.tally.refused == {WheelRefusal.TIME: 1}


def test_a_base_that_was_restarted_costs_one_packet() -> None:
    driver = KobukiDriver()
    stream = [*packets(3), *packets(3, 30_000, 0)]
    samples = [s for k, one in enumerate(stream) for s in driver.feed(one, T0 + 20 * k * MS)]
    assert [s.left for s in counts(samples)] == [11245, 11253, 11261, 8, 16]
    assert driver.tally.refused == {WheelRefusal.TIME: 1}


def test_samples_carry_the_time_of_the_base_not_that_of_the_read() -> None:
    driver = KobukiDriver()
    first, second, *batch = packets(6)
    driver.feed(first, T0)
    driver.feed(second, T0 + 20 * MS)
    samples = counts(driver.feed(b"".join(batch), T0 + 100 * MS))
    assert [s.utime for s in samples] == [T0 + k * 20 * MS for k in range(2, 6)]


def test_time_and_counters_wrap_at_16_bits() -> None:
    driver = KobukiDriver()
    samples = []
    for k, packet in enumerate(packets(5, 65500, 65520)):
        samples += driver.feed(packet, T0 + 20 * k * MS)
    assert [s.utime for s in counts(samples)] == [T0 + k * 20 * MS for k in range(5)]
    assert samples[-1] == WheelCounts(T0 + 80 * MS, 16, 65492, 16)


@pytest.mark.parametrize("seed", range(5))
def test_whole_and_byte_by_byte_and_random_reads_give_the_same(seed: int) -> None:
    draw = random.Random(seed)
    parts = [*packets(30), kobuki_packet(KOBUKI_REST), *(draw.randbytes(20) for _ in range(10))]
    parts += [b"\xaa", b"\xaa\x55", b"\xaa\x55\xff"] * 3
    draw.shuffle(parts)
    stream = b"".join(parts)
    whole = fed([stream])
    assert fed([stream[i : i + 1] for i in range(len(stream))]) == whole
    assert fed(list(cut(stream, seed))) == whole


def test_one_poisoned_byte_costs_no_packet() -> None:
    for value in range(256):
        stream = [*packets(1), bytes([value]), *packets(2, 61860)]
        assert len(counts(fed([b"".join(stream)])[0])) == 3, value


def test_unknown_sub_payloads_are_skipped_by_their_length() -> None:
    payload = bytes([99, 2, 1, 15]) + kobuki_core(1, 2, 3) + bytes([98, 0])
    parts = sub_payloads(kobuki_packet(payload))
    assert parts is not None
    assert set(parts) == {99, 1, 98}


@pytest.mark.parametrize(
    "payload",
    [
        bytes([1, 14]) + bytes(14),  # core data are 15 bytes
        bytes([4, 8]) + bytes(8),
        bytes([13, 15]) + bytes(15),
        kobuki_core(1, 2, 3) + bytes([99, 3, 0, 0]),  # passes the end
        kobuki_core(1, 2, 3) + b"\x00",  # a byte is left over
    ],
)
def test_sub_payloads_that_do_not_fit_spoil_the_packet(payload: bytes) -> None:
    driver = KobukiDriver()
    assert driver.feed(kobuki_packet(payload), T0) == []
    assert driver.tally.refused[WheelRefusal.MALFORMED] == 1


@pytest.mark.parametrize("length", [14, 20])
def test_gyro_data_have_either_of_two_lengths(length: int) -> None:
    assert sub_payloads(kobuki_packet(bytes([13, length]) + bytes(length))) is not None


def test_an_empty_payload_is_no_packet() -> None:
    (good,) = packets(1)
    assert FrameScanner(KobukiFormat()).feed(b"\xaa\x55\x00\x00" + good, 0) == [good]


def test_every_packet_ends_in_exactly_one_count() -> None:
    driver = KobukiDriver()
    good, other = packets(10), kobuki_packet(KOBUKI_REST)
    damaged = bytes([*good[3][:-1], good[3][-1] ^ 4])
    broken = kobuki_packet(bytes([1, 14]) + bytes(14))
    for k, packet in enumerate([*good[:3], damaged, *good[4:], other, broken]):
        driver.feed(packet, T0 + 20 * k * MS)
    assert (driver.tally.accepted, driver.tally.ignored) == (9, 1)
    assert driver.tally.refused == {WheelRefusal.CHECKSUM: 1, WheelRefusal.MALFORMED: 1}
    assert driver.tally.received == 12


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.binary(max_size=255))
def test_no_payload_makes_the_driver_raise(payload: bytes) -> None:
    KobukiDriver().feed(kobuki_packet(payload), T0)


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.integers(0, 1 << 20), st.integers(0, 1 << 20))
def test_bit_flips_never_raise_and_good_packets_go_on(a: int, b: int) -> None:
    driver = KobukiDriver()
    first, damaged, *good = packets(9)
    flipped = bytearray(damaged)
    for flip in (a, b):
        flipped[flip // 8 % len(damaged)] ^= 1 << flip % 8
    samples = driver.feed(first, T0) + driver.feed(bytes(flipped), T0 + 20 * MS)
    for k, packet in enumerate(good):
        samples += driver.feed(packet, T0 + (2 + k) * 20 * MS)
    assert samples[-1] == WheelCounts(T0 + 8 * 20 * MS, 11245 + 64, 11245 - 56, 16)


def after_a_first(rest: bytes) -> list[WheelSample]:
    """Samples of a packet with sub-payloads `rest`, behind two with none."""
    driver = KobukiDriver()
    driver.feed(kobuki_packet(kobuki_core(980, 0, 0)), T0 - 20 * MS)
    driver.feed(kobuki_packet(kobuki_core(1000, 0, 0)), T0)
    return driver.feed(kobuki_packet(kobuki_core(1020, 1, 2) + rest), T0 + 20 * MS)


RAW = bytes([13, 14, 1, 6]) + struct.pack("<6h", 9, 9, 100, -9, 9, -300)


@pytest.mark.parametrize("degrees", [74.84, -180.0, 179.99])
def test_the_angle_of_the_gyro_comes_before_the_counters(degrees: float) -> None:
    inertia = bytes([4, 7]) + struct.pack("<2h3x", round(100 * degrees), 33)
    gyro, wheels = after_a_first(inertia + RAW)
    assert isinstance(gyro, GyroAngle)
    assert math.degrees(gyro.angle_rad) == pytest.approx(degrees)
    assert gyro.utime == wheels.utime == T0 + 20 * MS
    assert wheels == WheelCounts(T0 + 20 * MS, 1, 2, 16)


def test_without_an_angle_it_is_the_mean_of_its_raw_rates_about_the_vertical() -> None:
    """100 and -300 digits of 0.00875 deg/s."""
    gyro, _ = after_a_first(RAW)
    assert isinstance(gyro, GyroRate)
    assert math.degrees(gyro.radps) == pytest.approx(-0.875)


def test_a_base_that_says_nothing_of_its_gyro_gives_counters_only() -> None:
    assert after_a_first(b"") == [WheelCounts(T0 + 20 * MS, 1, 2, 16)]
