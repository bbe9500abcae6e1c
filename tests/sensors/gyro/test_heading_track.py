"""Readings of a gyro as one angle."""

from __future__ import annotations

import math

import pytest

from drslamd.sensors.gyro.heading_track import HeadingTrack
from drslamd.sensors.samples import GyroAngle, GyroRate

MS = 1000
T0 = 100_000_000


def angles(*degrees: float, every_ms: int = 20) -> HeadingTrack:
    track = HeadingTrack()
    for k, angle in enumerate(degrees):
        track.add(GyroAngle(T0 + k * every_ms * MS, math.radians(angle)))
    return track


def turned_deg(track: HeadingTrack, ms: float) -> float:
    found = track.at(T0 + round(ms * MS))
    assert found is not None
    return math.degrees(found[1])


def test_an_angle_that_wraps_counts_on() -> None:
    assert turned_deg(angles(179, -179.5, -178), 40) == pytest.approx(3.0)
    assert turned_deg(angles(-179, 179.5, 178), 40) == pytest.approx(-3.0)


def test_between_and_after_readings_it_goes_on_at_the_same_rate() -> None:
    track = angles(10, 11, 12)
    assert turned_deg(track, 50) == pytest.approx(2.5)
    assert turned_deg(track, 30) == pytest.approx(1.5)


def test_rates_are_added_up_over_the_time_between_them() -> None:
    """0, 10, 20 deg/s at 0, 0.1, 0.2 s: 0.5 and 1.5 degrees."""
    track = HeadingTrack()
    for k in range(3):
        track.add(GyroRate(T0 + 100 * k * MS, math.radians(10 * k)))
    assert turned_deg(track, 200) == pytest.approx(2.0)


def test_of_a_gyro_that_is_upside_down_turns_count_the_other_way() -> None:
    track = HeadingTrack(sign=-1.0)
    for k in range(3):
        track.add(GyroAngle(T0 + 20 * k * MS, math.radians(k)))
    assert turned_deg(track, 40) == pytest.approx(-2.0)


@pytest.mark.parametrize(("ms", "breaks"), [(300, 1), (301, 2)])
def test_a_pause_of_over_300_ms_loses_the_angle(ms: int, breaks: int) -> None:
    track = angles(0, 1, every_ms=ms)
    assert track.broken == breaks
    found = track.at(T0 + ms * MS)
    assert found is not None
    assert found[0] == breaks


@pytest.mark.parametrize(("ms", "is_known"), [(20 + 300, True), (20 + 301, False)])
def test_after_300_ms_without_a_reading_nothing_is_known(ms: int, is_known: bool) -> None:
    assert (angles(0, 1).at(T0 + ms * MS) is not None) is is_known


def test_before_the_first_reading_nothing_is_known() -> None:
    assert HeadingTrack().at(T0) is None


@pytest.mark.parametrize(
    ("sample", "is_refused"),
    [
        (GyroRate(T0 + 20 * MS, 12.5), False),
        (GyroRate(T0 + 20 * MS, 12.6), True),
        (GyroRate(T0 + 20 * MS, math.nan), True),
        (GyroRate(T0, 0.1), True),
        (GyroRate(T0 - 1, 0.1), True),
    ],
)
def test_what_no_robot_does_and_what_is_old_is_refused_and_counted(
    sample: GyroRate, is_refused: bool
) -> None:
    track = HeadingTrack()
    track.add(GyroRate(T0, 0.0))
    track.add(sample)
    assert track.refused == is_refused


def test_an_angle_that_is_no_number_is_refused() -> None:
    assert angles(0, math.inf, 2).refused == 1


def test_another_kind_of_reading_begins_anew() -> None:
    track = angles(0, 1)
    track.add(GyroRate(T0 + 40 * MS, 0.1))
    assert track.broken == 2


def test_readings_that_say_the_same_turn_are_counted_from_the_first() -> None:
    track = angles(0, 1, 2, 3, 4)
    assert (track.equal, track.equal_since) == (3, T0)
    track.add(GyroAngle(T0 + 100 * MS, math.radians(5.01)))
    assert track.equal == 0


@pytest.mark.parametrize(("degrees", "breaks"), [(14.3, 1), (-14.3, 1), (14.5, 2), (-14.5, 2)])
def test_an_angle_that_jumps_begins_anew(degrees: float, breaks: int) -> None:
    """In 20 ms nothing turns by more than 14.4 degrees."""
    assert angles(0, degrees).broken == breaks
