"""A way between two stand-stills."""

from __future__ import annotations

import math

import pytest

from drslamd.sensors.samples import Motion
from drslamd.setup.way import Phase, WayWatch

TRACK_M = 0.4
STEP_US = 50_000


class Pushed:
    """A robot that is moved in steps of 50 ms."""

    def __init__(self, step_m: float = 0.0) -> None:
        self.watch = WayWatch(TRACK_M, step_m)
        self.utime = 1_000_000
        self.watch.add(Motion(self.utime, 0.0, 0.0, gap=True))

    def go(self, seconds: float, left_m: float = 0.0, right_m: float = 0.0) -> Phase:
        """Both wheels over these ways, evenly."""
        steps = round(seconds * 1e6 / STEP_US)
        for _ in range(steps):
            self.utime += STEP_US
            turn = (right_m - left_m) / TRACK_M / steps
            self.watch.add(Motion(self.utime, (left_m + right_m) / 2 / steps, turn))
        return self.watch.phase

    def lose(self) -> Phase:
        """A gap in what the wheels say."""
        self.utime += STEP_US
        self.watch.add(Motion(self.utime, 0.0, 0.0, gap=True))
        return self.watch.phase


def test_a_way_begins_with_the_wheels_and_ends_after_two_seconds_of_rest() -> None:
    robot = Pushed()
    assert robot.go(5.0) is Phase.STANDING
    assert robot.go(3.0, 1.02, 0.98) is Phase.MOVING
    assert robot.go(1.9) is Phase.MOVING
    assert robot.go(0.2) is Phase.ENDED
    way = robot.watch.way()
    assert way.left_m == pytest.approx(1.02)
    assert way.right_m == pytest.approx(0.98)
    assert way.turn_rad == pytest.approx(-0.04 / TRACK_M)
    # the chord of an arc of 1 m over 0.1 rad
    assert way.chord_m == pytest.approx(2 * 10 * math.sin(0.05))


def test_what_began_slowly_is_part_of_the_way() -> None:
    robot = Pushed()
    robot.go(3.0)
    robot.go(1.0, 0.015, 0.015)  # not yet a push
    assert robot.watch.phase is Phase.STANDING
    robot.go(3.0, 0.985, 0.985)
    robot.go(2.1)
    assert robot.watch.way().distance_m == pytest.approx(1.0)


@pytest.mark.parametrize(("nudge", "phase"), [(0.019, Phase.STANDING), (0.021, Phase.MOVING)])
def test_a_nudge_is_no_push(nudge: float, phase: Phase) -> None:
    robot = Pushed()
    robot.go(2.0)
    assert robot.go(1.0, nudge, nudge) is phase


@pytest.mark.parametrize(("creep", "phase"), [(0.0045, Phase.ENDED), (0.006, Phase.MOVING)])
def test_whoever_creeps_on_does_not_stand(creep: float, phase: Phase) -> None:
    robot = Pushed()
    robot.go(1.0, 0.5, 0.5)
    # the two seconds have room for one step more than forty
    assert robot.go(2.1, creep * 1.02, creep * 1.02) is phase


def test_coarse_counts_that_tremble_neither_begin_a_way_nor_keep_it_from_ending() -> None:
    robot = Pushed(step_m=0.02)
    for _ in range(40):
        robot.go(0.1, 0.02, 0.0)
        assert robot.go(0.1, -0.02, 0.0) is Phase.STANDING
    robot.go(2.0, 1.0, 1.0)
    for _ in range(12):
        robot.go(0.1, 0.02, 0.0)
        robot.go(0.1, -0.02, 0.0)
    assert robot.watch.phase is Phase.ENDED


def test_a_turn_on_the_spot_and_a_way_back_have_their_signs() -> None:
    robot = Pushed()
    robot.go(3.0, -0.2 * math.pi * 2, 0.2 * math.pi * 2)
    robot.go(2.1)
    assert robot.watch.way().turn_rad == pytest.approx(2 * math.pi)
    assert robot.watch.way().chord_m == pytest.approx(0.0, abs=1e-9)
    back = Pushed()
    back.go(3.0, -1.0, -1.0)
    assert back.watch.way().chord_m == pytest.approx(-1.0)


def test_a_gap_while_it_moves_breaks_the_way_and_one_before_does_not() -> None:
    robot = Pushed()
    robot.go(1.0)
    assert robot.lose() is Phase.STANDING
    assert robot.go(1.0, 0.5, 0.5) is Phase.MOVING
    assert robot.lose() is Phase.BROKEN
    assert robot.go(5.0) is Phase.BROKEN


def test_little_is_kept_however_fast_the_wheels_speak() -> None:
    watch = WayWatch(TRACK_M, 0.0)
    watch.add(Motion(1, 0.0, 0.0, gap=True))
    for k in range(20_000):
        watch.add(Motion(1 + 1000 * (k + 1), 0.0, 0.0))
    assert len(watch._lately) < 120
