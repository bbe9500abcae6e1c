"""Wheels that change their speed at once, and for how long that is feared."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drslamd.conventions import GRID_HZ
from drslamd.slam.odometry.jumps import FEARED, HABIT, JUMP_MPS, Jump, feared
from drslamd.slam.odometry.track import RESOLUTION, Track

FIRST = 7_000
"""Sample with which tracks begin."""
HEADING = 0.6


def driven(*speeds_mps: float, heading: float = HEADING, turning: float = 0.0) -> Track:
    """Wheels that say to go straight at these speeds, each for a tenth of a second."""
    track, way = Track(100_000), 0.0
    for k, speed in enumerate([0.0, *speeds_mps]):
        way += speed / GRID_HZ
        pose = [way * math.cos(heading), way * math.sin(heading), heading + turning * k / GRID_HZ]
        track.append(FIRST + k, np.round(np.array(pose) / RESOLUTION))
    return track


def along(jump: Jump | None) -> float:
    """Metres of its way, which is along the heading."""
    assert jump is not None
    assert jump.way == pytest.approx(
        np.hypot(*jump.way)
        * np.sign(jump.way[0])
        * np.array([math.cos(HEADING), math.sin(HEADING)]),
        abs=2e-3,
    )
    return float(np.hypot(*jump.way) * np.sign(jump.way[0]))


def steady(speed: float, seconds: float) -> list[float]:
    return [speed] * round(seconds * GRID_HZ)


def test_who_drives_steadily_or_brakes_as_robots_do_is_believed() -> None:
    assert feared(driven(*steady(0.5, 30))) is None
    braking = np.linspace(0.5, 0.0, 5).tolist()
    assert feared(driven(*steady(0.5, 5), *braking, *steady(0.0, 5))) is None
    assert feared(driven(0.5)) is None


@pytest.mark.parametrize(("times", "is_feared"), [(0.98, False), (1.02, True)])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_jump_is_a_change_that_no_robot_makes(times: float, is_feared: bool, sign: int) -> None:
    track = driven(*steady(0.6, 5), *steady(0.6 + sign * times * JUMP_MPS, 3))
    assert (feared(track) is not None) is is_feared


def test_a_robot_whose_counters_stand_may_have_gone_on() -> None:
    for seconds in (1.0, 2.0, 5.0):
        jump = feared(driven(*steady(0.5, 10), *steady(0.0, seconds)))
        assert along(jump) == pytest.approx(-0.5 * seconds, abs=0.06)
        assert jump is not None
        assert abs(jump.n - (FIRST + 10 * GRID_HZ)) <= 1


def test_counters_that_go_on_say_where_it_is_from_then_on() -> None:
    """As slowly as may be, or turning on the spot."""
    stood = [*steady(0.5, 10), *steady(0.0, 3)]
    for later in (steady(0.1, 3), steady(0.5, 3)):
        assert along(feared(driven(*stood, *later))) == pytest.approx(-1.5, abs=0.06)


def test_wheels_that_spin_may_not_have_taken_it_along_until_they_slow_down_as_suddenly() -> None:
    spun = [*steady(0.4, 10), *steady(1.0, 2)]
    assert along(feared(driven(*spun))) == pytest.approx(1.2, abs=0.07)
    # its own speed changes meanwhile as robots drive
    assert along(feared(driven(*spun, *steady(0.8, 1)))) == pytest.approx(1.8, abs=0.07)
    assert along(feared(driven(*spun, *steady(0.4, 3)))) == pytest.approx(1.2, abs=0.07)


@pytest.mark.parametrize(("later", "is_feared"), [(-2, True), (2, False)])
def test_a_jump_is_feared_for_ten_seconds(later: int, is_feared: bool) -> None:
    since = (FEARED + later) / GRID_HZ
    track = driven(*steady(0.5, 10), *steady(0.0, 2), *steady(0.1, since - 2))
    assert (feared(track) is not None) is is_feared


def test_a_single_sample_that_is_off_is_no_jump() -> None:
    assert feared(driven(*steady(0.4, 5), 1.2, *steady(0.4, 3))) is None


@pytest.mark.parametrize(("count", "is_feared"), [(HABIT, True), (HABIT + 1, False)])
def test_who_always_drives_so_is_believed(count: int, is_feared: bool) -> None:
    speeds = [speed for k in range(count) for speed in steady(0.5 * (k % 2 == 0), 3)]
    assert (feared(driven(0.0, 0.0, 0.0, *speeds)) is not None) is is_feared


def test_what_was_before_a_hole_is_another_story() -> None:
    track = driven(*steady(0.5, 10), *steady(0.0, 1))
    assert feared(track) is not None
    last = track.steps(track.end - 1, 1)[0]
    for k in range(10):
        track.append(track.end + 5 * (k == 0), last)
    assert feared(track) is None


def test_samples_beside_a_jump_have_its_whole_change_between_them() -> None:
    """Wheels stop between samples 100 and 101, and go on between 150 and 151."""
    stood = [*steady(0.5, 10), *steady(0.0, 5)]
    track = driven(*stood)
    jump = feared(track)
    assert jump is not None
    begin = [n - FIRST for n in jump.beside(track)]
    assert begin == [99, 101]
    track = driven(*stood, *steady(0.5, 2))
    jump = feared(track)
    assert jump is not None
    assert [n - FIRST for n in jump.beside(track)] == [*begin, 150, 152]


@pytest.mark.parametrize(("more", "count"), [(0, 2), (1, 4)])
def test_the_end_of_a_jump_is_marked_once_it_is_over(more: int, count: int) -> None:
    stood = [*steady(0.5, 10), *steady(0.0, 5)]
    track = driven(*stood, *[0.5] * more, 0.5)
    jump = feared(track)
    assert jump is not None
    assert len(jump.beside(track)) == count
