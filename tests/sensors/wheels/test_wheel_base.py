"""From samples of the wheels to motions of the body; no motion is ever invented."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest
from frames import SECOND_US
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.sensors.samples import (
    Motion,
    Twist,
    WheelCounts,
    WheelReading,
    WheelSpeeds,
    WheelTurns,
)
from drslamd.sensors.wheels.wheel_base import (
    BRIDGE_PATH_M,
    MAX_BRIDGE_US,
    MAX_SILENCE_US,
    MAX_TURN_RADPS,
    MAX_TURNED_M,
    NEAR_ZERO_M,
    STAMP_JITTER_US,
    DriveGeometry,
    Gap,
    ReadingRefusal,
    WheelBase,
)

MS = 1000
T0 = 100 * SECOND_US
TRACK = 0.5
BASE = DriveGeometry(track_m=TRACK, max_speed_mps=3.0, per_metre=1000.0)


def counts(after_ms: float, left: int, right: int, bits: int = 32) -> WheelCounts:
    return WheelCounts(T0 + round(after_ms * MS), left, right, bits)


def motions(*samples: WheelReading, geometry: DriveGeometry = BASE) -> list[Motion]:
    base = WheelBase(geometry)
    return [motion for sample in samples if (motion := base.add(sample)) is not None]


def is_like(motion: Motion | None, after_ms: int, distance_m: float, turn_rad: float) -> bool:
    """Is it this motion, not a gap, up to rounding?"""
    assert motion is not None
    return (
        (motion.utime, motion.gap) == (T0 + after_ms * MS, False)
        and math.isclose(motion.distance_m, distance_m, abs_tol=1e-12)
        and math.isclose(motion.turn_rad, turn_rad, abs_tol=1e-12)
    )


def total(moved: list[Motion]) -> tuple[float, float]:
    return sum(m.distance_m for m in moved), sum(m.turn_rad for m in moved)


# counters


def test_the_first_sample_starts_a_track_without_a_motion() -> None:
    assert motions(counts(0, 5, 6)) == [Motion(T0, 0.0, 0.0, gap=True)]


def test_distance_is_the_mean_and_turn_the_difference_over_the_track() -> None:
    _, moved = motions(counts(0, 0, 0), counts(100, 10, 30))
    assert is_like(moved, 100, 0.02, 0.04)


def test_a_lost_sample_costs_nothing() -> None:
    samples = [counts(20 * k, 10 * k, 12 * k) for k in range(20)]
    some = [sample for k, sample in enumerate(samples) if k not in (3, 4, 5, 11)]
    assert total(motions(*some)) == pytest.approx(total(motions(*samples)))


@pytest.mark.parametrize(("left", "right"), [(True, False), (False, True), (True, True)])
def test_a_reversed_side_counts_backwards(left: bool, right: bool) -> None:
    geometry = replace(BASE, reverse_left=left, reverse_right=right)
    signed = counts(100, -10 if left else 10, -30 if right else 30)
    reversed_ = motions(counts(0, 0, 0), counts(100, 10, 30), geometry=geometry)
    assert reversed_ == motions(counts(0, 0, 0), signed)


@pytest.mark.row("D10")
@pytest.mark.parametrize("bits", [16, 32, 64])
def test_counters_go_on_over_their_wrap(bits: int) -> None:
    top = (1 << bits) - 10
    moved = motions(counts(0, top, 10, bits), counts(100, 10, top, bits))
    assert is_like(moved[1], 100, 0.0, -0.08)


def test_signed_counters_go_on_over_their_wrap() -> None:
    moved = motions(counts(0, (1 << 31) - 5, 0), counts(100, -(1 << 31) + 5, 0))
    assert moved[1].distance_m == pytest.approx(0.005)


def test_wide_counters_lose_no_count() -> None:
    far = (1 << 63) + 1
    moved = motions(counts(0, far, far, 64), counts(100, far + 1, far + 1, 64))
    assert moved[1].distance_m == 0.001


@settings(derandomize=True, max_examples=100, deadline=None)
@given(
    st.sampled_from([16, 32]),
    st.integers(0, 1 << 32),
    st.lists(st.tuples(st.integers(-60, 60), st.integers(-60, 60)), max_size=60),
)
def test_increments_are_the_same_wherever_a_counter_starts(
    bits: int, start: int, steps: list[tuple[int, int]]
) -> None:
    def run(first: int) -> list[Motion]:
        base, left, right = WheelBase(BASE), first, first
        base.add(counts(0, left % (1 << bits), right % (1 << bits), bits))
        out = []
        for k, (dl, dr) in enumerate(steps):
            left, right = left + dl, right + dr
            out.append(base.add(counts(20 * k + 20, left % (1 << bits), right % (1 << bits), bits)))
        return [motion for motion in out if motion is not None]

    assert run(start) == run(0)
    assert len(run(start)) == len(steps)


# counters that jump


JITTER_MS = STAMP_JITTER_US // MS


@pytest.mark.parametrize(("mm", "believed"), [(3 * (20 + JITTER_MS), True), (361, False)])
def test_a_counter_moves_no_faster_than_the_base(mm: int, believed: bool) -> None:
    base = WheelBase(BASE)
    base.add(counts(0, 0, 0))
    assert (base.add(counts(20, mm, 0)) is not None) == believed
    assert base.tally.refused[ReadingRefusal.JUMP] == (not believed)


def test_counters_that_go_on_from_elsewhere_are_a_gap_without_motion() -> None:
    base = WheelBase(BASE)
    base.add(counts(0, 50_000, 50_000))
    base.add(counts(20, 50_010, 50_010))
    assert base.add(counts(40, 3, 4)) is None
    assert base.add(counts(60, 6, 8)) == Motion(T0 + 60 * MS, 0.0, 0.0, gap=True)
    assert is_like(base.add(counts(80, 16, 18)), 80, 0.01, 0.0)
    assert base.gaps == {Gap.START: 1, Gap.JUMP: 1}


@pytest.mark.parametrize(("mm", "goes_on"), [(3 * (20 + JITTER_MS), True), (361, False)])
def test_from_elsewhere_counters_go_on_no_faster_than_the_base(mm: int, goes_on: bool) -> None:
    base = WheelBase(BASE)
    base.add(counts(0, 50_000, 50_000))
    assert base.add(counts(20, 3, 4)) is None
    assert (base.add(counts(40, 3 + mm, 4)) is not None) == goes_on
    assert base.gaps[Gap.JUMP] == goes_on


@pytest.mark.parametrize(("share", "believed"), [(0.99, True), (1.01, False)])
def test_a_turn_of_more_than_a_round_a_second_is_no_turn(share: float, believed: bool) -> None:
    """Both wheels well below their speed; the stamps may be off by their jitter."""
    elapsed_s = 0.1 + STAMP_JITTER_US / SECOND_US
    path_mm = share * MAX_TURN_RADPS * elapsed_s * TRACK / 2 * 1000
    base = WheelBase(replace(BASE, max_speed_mps=10.0))
    base.add(counts(0, 1000, 1000))
    motion = base.add(counts(100, round(1000 - path_mm), round(1000 + path_mm)))
    assert (motion is not None) == believed
    assert base.tally.refused[ReadingRefusal.JUMP] == (not believed)


def test_one_odd_reading_between_good_ones_loses_nothing() -> None:
    base = WheelBase(BASE)
    base.add(counts(0, 1000, 1000))
    assert base.add(counts(20, 91_000, 1010)) is None
    assert is_like(base.add(counts(40, 1020, 1020)), 40, 0.02, 0.0)
    assert base.gaps == {Gap.START: 1}


def test_the_same_odd_reading_with_a_good_one_between_loses_nothing() -> None:
    base = WheelBase(BASE)
    base.add(counts(0, 1000, 1000))
    assert base.add(counts(20, 91_000, 1010)) is None
    assert base.add(counts(40, 1020, 1020)) is not None
    assert base.add(counts(60, 91_010, 1030)) is None
    assert is_like(base.add(counts(80, 1040, 1040)), 80, 0.02, 0.0)


def test_odd_readings_in_a_row_that_do_not_agree_lose_nothing() -> None:
    base = WheelBase(BASE)
    base.add(counts(0, 1000, 1000))
    for k, odd in enumerate((91_000, 5_000_000, -70_000)):
        assert base.add(counts(20 + k, odd, odd)) is None
    assert is_like(base.add(counts(80, 1040, 1040)), 80, 0.04, 0.0)


@pytest.mark.row("D11")
@pytest.mark.parametrize(("silence_ms", "gap"), [(500, False), (501, True)])
def test_after_a_silence_counters_near_zero_have_restarted(silence_ms: int, gap: bool) -> None:
    base = WheelBase(BASE)
    base.add(counts(0, 900, 900))
    motion = base.add(counts(silence_ms, 10, -10))
    assert motion is not None
    assert motion.gap == gap
    assert base.gaps[Gap.RESTART] == gap


@pytest.mark.parametrize(("mm", "gap"), [(50, True), (51, False)])
def test_near_zero_is_five_centimetres(mm: int, gap: bool) -> None:
    assert NEAR_ZERO_M == 0.05
    for first, second in (((900, 900), (mm, mm)), ((900, 900), (mm, 900)), ((9, 900), (9, mm))):
        assert motions(counts(0, *first), counts(600, *second))[-1].gap == gap


def test_counters_that_always_were_near_zero_have_not_restarted() -> None:
    assert not motions(counts(0, 20, 20), counts(900, 25, 25))[-1].gap


@pytest.mark.parametrize(("silence_ms", "gap"), [(931, False), (932, True)])
def test_a_16_bit_counter_may_go_around_unseen(silence_ms: int, gap: bool) -> None:
    kobuki = replace(BASE, per_metre=11_724.4)  # half the range is 2.795 m, at 3 m/s 0.9316 s
    base = WheelBase(kobuki)
    base.add(counts(0, 30_000, 30_000, 16))
    motion = base.add(counts(silence_ms, 30_500, 30_500, 16))
    assert motion is not None
    assert motion.gap == gap
    assert base.gaps[Gap.WRAP] == gap


# silence


@pytest.mark.parametrize(
    ("silence_us", "path_mm", "gap"),
    [
        (MAX_BRIDGE_US, 501, False),
        (MAX_BRIDGE_US + MS, 501, True),
        (MAX_BRIDGE_US + MS, 500, False),
        (600 * SECOND_US, 0, False),
    ],
)
def test_a_long_silence_is_bridged_when_the_path_was_short(
    silence_us: int, path_mm: int, gap: bool
) -> None:
    assert BRIDGE_PATH_M == 0.5
    base = WheelBase(BASE)
    base.add(counts(0, 9000, 9000))
    motion = base.add(counts(silence_us / MS, 9000 + path_mm, 9000))
    assert motion is not None
    assert motion.gap == gap
    assert base.gaps[Gap.SILENCE] == gap


def speeds(after_us: int, left: float, right: float) -> WheelSpeeds:
    return WheelSpeeds(T0 + after_us, left, right)


@pytest.mark.parametrize(
    ("silence_us", "gap"), [(MAX_SILENCE_US, False), (MAX_SILENCE_US + 1, True)]
)
def test_speeds_are_not_integrated_over_a_silence(silence_us: int, gap: bool) -> None:
    motion = motions(speeds(0, 1.0, 1.0), speeds(silence_us, 1.0, 1.0))[-1]
    assert motion.gap == gap
    assert motion.distance_m == (0.0 if gap else 0.5)


# speeds, twist and turns


def test_speeds_are_integrated_as_trapezoids() -> None:
    motion = motions(speeds(0, 1.0, 1.0), speeds(100 * MS, 2.0, 1.5))[-1]
    assert motion.distance_m == pytest.approx((0.15 + 0.125) / 2)
    assert motion.turn_rad == pytest.approx((0.125 - 0.15) / TRACK)


def test_a_twist_is_integrated_as_it_is() -> None:
    geometry = replace(BASE, reverse_left=True)  # says nothing about a twist
    first, second = Twist(T0, 0.5, -0.25), Twist(T0 + 100 * MS, 0.7, -0.75)
    motion = motions(first, second, geometry=geometry)[-1]
    assert motion.distance_m == pytest.approx(0.06)
    assert motion.turn_rad == pytest.approx(-0.05)


def test_a_reversed_speed_runs_backwards() -> None:
    geometry = replace(BASE, reverse_right=True)
    motion = motions(speeds(0, 1.0, -1.0), speeds(100 * MS, 1.0, -1.0), geometry=geometry)[-1]
    assert is_like(motion, 100, 0.1, 0.0)


def test_turns_become_metres_by_wheel_and_gear() -> None:
    geometry = replace(BASE, per_metre=10 / (2 * math.pi * 0.1))  # gear 10, radius 0.1 m
    motion = motions(
        WheelTurns(T0, -3.5, 8.0), WheelTurns(T0 + SECOND_US, -1.0, 10.5), geometry=geometry
    )[-1]
    assert motion.distance_m == pytest.approx(0.25 * 2 * math.pi * 0.1)
    assert motion.turn_rad == pytest.approx(0.0)


@pytest.mark.parametrize(("speed", "believed"), [(3.0, True), (-3.0, True), (3.01, False)])
def test_a_speed_above_the_limit_is_refused(speed: float, believed: bool) -> None:
    base = WheelBase(BASE)
    assert (base.add(speeds(0, 0.0, speed)) is not None) == believed
    assert base.tally.refused[ReadingRefusal.TOO_FAST] == (not believed)


def test_another_kind_of_sample_starts_anew() -> None:
    base = WheelBase(BASE)
    base.add(speeds(0, 1.0, 1.0))
    assert base.add(counts(20, 70_000, 70_000)) == Motion(T0 + 20 * MS, 0.0, 0.0, gap=True)
    assert base.gaps[Gap.SOURCE] == 1


# time and values that make no sense


def test_of_counters_with_the_same_stamp_nothing_is_lost() -> None:
    base = WheelBase(BASE)
    samples = [counts(0, 0, 0), counts(20, 10, 10), counts(20, 20, 20), counts(40, 30, 30)]
    moved = [base.add(sample) for sample in samples]
    assert moved[2] is None
    assert is_like(moved[3], 40, 0.02, 0.0)
    assert base.tally.refused == {ReadingRefusal.SAME_STAMP: 1}


def test_of_speeds_with_the_same_stamp_the_last_counts() -> None:
    moved = motions(speeds(0, 1.0, 1.0), speeds(0, 2.0, 2.0), speeds(100 * MS, 2.0, 2.0))
    assert moved[-1].distance_m == pytest.approx(0.2)


def test_a_sample_older_than_the_last_is_refused() -> None:
    base = WheelBase(BASE)
    base.add(counts(20, 10, 10))
    assert base.add(counts(19, 0, 0)) is None
    assert base.tally.refused == {ReadingRefusal.OUT_OF_ORDER: 1}


@pytest.mark.row("M9")
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("kind", [WheelSpeeds, WheelTurns, Twist])
def test_values_that_are_not_finite_are_refused(kind: type, value: float) -> None:
    base = WheelBase(BASE)
    base.add(kind(T0, 0.0, 0.0))
    assert base.add(kind(T0 + MS, value, 0.0)) is None
    assert base.add(kind(T0 + MS, 0.0, value)) is None
    assert base.tally.refused == {ReadingRefusal.NOT_FINITE: 2}
    assert base.add(kind(T0 + 2 * MS, 0.0, 0.0)) == Motion(T0 + 2 * MS, 0.0, 0.0)


@pytest.mark.parametrize(("share", "believed"), [(1.0, True), (1.001, False), (1e30, False)])
@pytest.mark.parametrize("sides", [(1, 0), (0, 1), (-1, 0), (0, -1)])
def test_turns_have_an_end_where_floats_of_32_bits_become_coarse(
    sides: tuple[int, int], share: float, believed: bool
) -> None:
    assert round(MAX_TURNED_M) == 419_430
    base = WheelBase(BASE)
    left, right = (side * share * MAX_TURNED_M * BASE.per_metre for side in sides)
    assert (base.add(WheelTurns(T0, left, right)) is not None) == believed
    assert base.tally.refused[ReadingRefusal.TOO_FAR] == (not believed)


WILD = st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.9, 1e308, -1e308, math.nan, math.inf, 5e-324])


@settings(derandomize=True, max_examples=300, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["counts", "turns", "speeds", "twist"]),
            st.integers(-5 * MS, 3 * SECOND_US),
            WILD,
            WILD,
            st.integers(-(1 << 65), 1 << 65),
            st.sampled_from([8, 16, 32, 64]),
        ),
        max_size=25,
    )
)
def test_whatever_comes_motions_are_finite_and_in_order(
    events: list[tuple[str, int, float, float, int, int]],
) -> None:
    base, utime, last = WheelBase(BASE), T0, 0
    for kind, pause, left, right, count, bits in events:
        utime += pause
        samples: dict[str, WheelReading] = {
            "counts": WheelCounts(utime, count, -count, bits),
            "turns": WheelTurns(utime, left, right),
            "speeds": WheelSpeeds(utime, left, right),
            "twist": Twist(utime, left, right),
        }
        motion = base.add(samples[kind])
        if motion is not None:
            assert math.isfinite(motion.distance_m)
            assert math.isfinite(motion.turn_rad)
            assert motion.utime > last
            assert not motion.gap or motion.distance_m == motion.turn_rad == 0.0
            last = motion.utime
    assert base.tally.received == len(events)
    assert base.gaps.total() <= base.tally.accepted


def test_a_long_drive_adds_up() -> None:
    draw, base = random.Random(5), WheelBase(BASE)
    left = right = 0
    moved = []
    for k in range(5000):
        left, right = left + draw.randint(0, 40), right + draw.randint(0, 40)
        motion = base.add(counts(20 * k, left % (1 << 16), right % (1 << 16), 16))
        assert motion is not None
        moved.append(motion)
        if k == 0:
            start = (left, right)
    left_m, right_m = (left - start[0]) / 1000, (right - start[1]) / 1000
    assert left_m > 65.536  # the counter went round
    assert total(moved) == pytest.approx(((left_m + right_m) / 2, (right_m - left_m) / TRACK))
