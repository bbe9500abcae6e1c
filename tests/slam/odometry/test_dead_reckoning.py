"""Motions of the wheels as a trajectory on the 10 Hz grid."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drslamd.conventions import GRID_US
from drslamd.sensors.samples import Motion
from drslamd.slam.odometry.dead_reckoning import DeadReckoning
from drslamd.slam.odometry.track import RESOLUTION

START = 5_000_000


def driven(motions: list[Motion]) -> DeadReckoning:
    reckoning = DeadReckoning()
    for motion in motions:
        reckoning.add(motion)
    return reckoning


def start(utime: int = START) -> Motion:
    return Motion(utime, 0.0, 0.0, gap=True)


def arc(radius: float, speed: float, seconds: float, hz: int = 50) -> list[Motion]:
    """A circle to the left, driven evenly."""
    count = round(seconds * hz)
    way = speed / hz
    return [start()] + [
        Motion(START + (k + 1) * 1_000_000 // hz, way, way / radius) for k in range(count)
    ]


def test_a_circle_is_a_circle_however_coarse_the_motions() -> None:
    radius, speed = 2.0, 0.5
    for hz in (50, 10, 5):
        track = driven(arc(radius, speed, 30.0, hz)).track
        t = (np.arange(track.n0, track.end) * GRID_US - START) / 1e6
        on_motion = np.abs(t * hz - np.round(t * hz)) < 1e-9
        turn = speed * t / radius
        true = np.stack([radius * np.sin(turn), radius * (1 - np.cos(turn)), turn], axis=-1)
        off = np.abs(track.poses - true)
        assert off[on_motion].max() < 0.51e-4
        # between motions a straight line: off by the height of the arc over one motion
        height = (speed / hz) ** 2 / (8 * radius)
        assert off[:, :2].max() < height + 1e-4


def test_a_turn_on_the_spot_goes_nowhere_and_counts_on() -> None:
    track = driven([start()] + [Motion(START + k * 20_000, 0.0, 0.05) for k in range(1, 301)]).track
    assert np.abs(track.poses[:, :2]).max() == 0
    assert track.poses[-1, 2] == pytest.approx(15.0)


def test_every_tenth_of_a_second_has_its_sample_at_its_time() -> None:
    """At 1 m/s the place tells the time."""
    motions = [start(START - 30_000)]
    motions += [Motion(START - 30_000 + k * 37_000, 0.037, 0.0) for k in range(1, 60)]
    track = driven(motions).track
    n = np.arange(track.n0, track.end)
    assert track.n0 == START // GRID_US
    assert np.allclose(track.poses[:, 0], n * 0.1 - (START - 30_000) / 1e6, atol=0.51e-4)


def test_a_motion_that_ends_on_the_grid_gives_its_end() -> None:
    track = driven([start(), Motion(START + GRID_US, 0.1, 0.0)]).track
    assert np.allclose(track.poses[:, 0], [0.0, 0.1])


def test_one_that_ends_just_before_gives_nothing_yet() -> None:
    track = driven([start(), Motion(START + GRID_US - 1, 0.1, 0.0)]).track
    assert len(track) == 1


def test_the_first_motion_is_a_sample_only_on_the_grid() -> None:
    assert len(driven([start(START)]).track) == 1
    assert len(driven([start(START + 1)]).track) == 0
    assert driven([start(START + 1), Motion(START + GRID_US, 0, 0)]).track.n0 == 51


def test_samples_are_whole_steps_and_errors_do_not_add_up() -> None:
    """A third of a step at a time: what is rounded is the sum."""
    motions = [start()] + [Motion(START + k * GRID_US, 1e-4 / 3, 1e-4 / 3) for k in range(1, 3001)]
    track = driven(motions).track
    steps = track.steps(track.n0, len(track))
    assert np.array_equal(steps, np.round(steps))
    assert track.poses[-1, 0] == pytest.approx(math.sin(0.1), abs=0.6e-4)
    assert track.poses[-1, 2] == pytest.approx(0.1, abs=0.51e-4)


def test_a_silence_leaves_a_hole_and_begins_a_segment() -> None:
    motions = [start()] + [Motion(START + k * GRID_US, 0.1, 0.0) for k in range(1, 4)]
    later = START + 10 * GRID_US
    motions += [Motion(later, 0.0, 0.0, gap=True), Motion(later + GRID_US, 0.1, 0.0)]
    track = driven(motions).track
    assert track.end - track.n0 == 12
    assert np.isnan(track.poses[4:10]).all()
    assert np.allclose(track.poses[[0, 1, 2, 3, 10, 11], 0], [0, 0.1, 0.2, 0.3, 0.3, 0.4])
    assert track.segment_start == track.n0 + 10
    assert not track.covers(track.n0, track.end - 1)


@pytest.mark.parametrize("silence_us", [10_000, 50_000, 100_000, 150_000])
def test_a_link_that_is_lost_in_no_time_still_begins_a_segment(silence_us: int) -> None:
    """Counters that were reset between two messages."""
    motions = [start()] + [Motion(START + k * 10_000, 0.01, 0.0) for k in range(1, 31)]
    again = motions[-1].utime + silence_us
    motions.append(Motion(again, 0.0, 0.0, gap=True))
    motions += [Motion(again + k * 10_000, 0.01, 0.0) for k in range(1, 41)]
    track = driven(motions).track
    holes = np.flatnonzero(np.isnan(track.poses[:, 0]))
    assert 1 <= len(holes) <= 2
    assert track.segment_start == track.n0 + holes[-1] + 1
    # what was measured on either side is at its place
    t = (np.arange(track.n0, track.end) * GRID_US - START) / 1e6
    after = t >= (again - START) / 1e6
    assert np.allclose(track.poses[after, 0][1:], (t[after] - silence_us / 1e6)[1:], atol=1e-4)


def test_two_breaks_in_one_tenth_are_one() -> None:
    motions = [start()] + [Motion(START + k * GRID_US, 0.1, 0.0) for k in range(1, 4)]
    motions += [
        Motion(START + 3 * GRID_US + 10_000, 0.0, 0.0, gap=True),
        Motion(START + 3 * GRID_US + 20_000, 0.0, 0.0, gap=True),
        Motion(START + 6 * GRID_US, 0.2, 0.0),
    ]
    track = driven(motions).track
    assert np.isnan(track.poses[:, 0]).tolist() == [False] * 4 + [True] + [False] * 2


def test_a_motion_from_the_past_is_left_out() -> None:
    motions = [start(), Motion(START + GRID_US, 0.1, 0.0)]
    reckoning = driven([*motions, Motion(START + GRID_US, 5.0, 0.0), Motion(START, 5.0, 0.0)])
    assert reckoning.path_m == pytest.approx(0.1)
    assert np.allclose(reckoning.track.poses[:, 0], [0.0, 0.1])


def test_the_path_counts_both_directions() -> None:
    reckoning = driven([start(), Motion(START + 1, 0.3, 0.1), Motion(START + 2, -0.2, 0.0)])
    assert reckoning.path_m == pytest.approx(0.5)
    assert np.array_equal(RESOLUTION, [1e-4, 1e-4, 1e-4])
