"""Who errs where wheels and gyro tell of different turns."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from drslamd.sensors.gyro.comparison import Comparison, GyroFault

UNKNOWN = math.radians(0.5)
Said = Callable[[int, float, float], tuple[float, float]]
"""Second, metres and true turn to what wheels and gyro say."""


def driven(seconds: int, start: int = 0) -> list[tuple[int, float, float]]:
    """Number, metres and turn of each second of a drive with curves, at 0.1 to 0.5 m/s."""
    return [
        (k, 0.3 + 0.2 * math.sin(k / 3), math.radians(15) * math.sin(k / 2))
        for k in range(start, start + seconds)
    ]


class Drive:
    def __init__(self, seed: int = 1) -> None:
        self.comparison = Comparison(math.radians(0.15), math.radians(0.5), 0.115)
        self._rng = np.random.default_rng(seed)

    def on(
        self, seconds: list[tuple[int, float, float]], said: Said, *, in_use: bool
    ) -> list[GyroFault | None]:
        faults = []
        for k, path, turn in seconds:
            wheels, gyro = said(k, path, turn)
            wheels += float(self._rng.normal()) * math.radians(0.5) * math.sqrt(path)
            assert self.comparison.add((k + 1) * 1_000_000, 1.0, path, wheels, gyro)
            look = self.comparison.watch if in_use else self.comparison.try_out
            faults.append(look(UNKNOWN))
        return faults


def right(k: int, path: float, turn: float) -> tuple[float, float]:
    return turn, turn


def test_a_second_is_compared_when_it_is_full() -> None:
    comparison = Comparison(0.1, 0.1, 0.1)
    said = [comparison.add(k * 400_000, 0.4, 0.1, 0.0, 0.0) for k in range(1, 7)]
    assert said == [False, False, True, False, False, True]
    assert comparison.since() == 0


def test_a_trial_is_passed_when_a_bias_would_have_shown() -> None:
    drive = Drive()
    passed = []
    for second in driven(16):
        assert drive.on([second], right, in_use=False) == [None]
        passed.append(drive.comparison.is_passed())
    assert passed.index(True) in range(6, 14)


def test_who_drives_straight_passes_no_trial() -> None:
    drive = Drive()
    straight = [(k, path, 0.005) for k, path, _ in driven(30)]
    assert not any(drive.on(straight, right, in_use=False))
    assert not drive.comparison.is_passed()


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (GyroFault.INVERTED, lambda k, path, turn: (turn, -turn)),
        (GyroFault.BIASED, lambda k, path, turn: (turn, turn + math.radians(1))),
        (GyroFault.BIASED, lambda k, path, turn: (turn, turn - math.radians(1))),
        (GyroFault.SCALED, lambda k, path, turn: (turn, turn / 3)),
    ],
)
@pytest.mark.parametrize("seed", range(5))
def test_a_gyro_that_is_wrong_is_named_on_trial_within_ten_seconds(
    fault: GyroFault, said: Said, seed: int
) -> None:
    found = Drive(seed).on(driven(10), said, in_use=False)
    assert next(filter(None, found)) is fault


@pytest.mark.parametrize("degrees", [1.0, -1.0, 10.0])
@pytest.mark.parametrize("seed", range(5))
def test_a_bias_that_comes_in_use_is_named_within_ten_seconds(degrees: float, seed: int) -> None:
    drive = Drive(seed)
    assert not any(drive.on(driven(60), right, in_use=True))
    found = drive.on(
        driven(10, 60), lambda k, path, turn: (turn, turn + math.radians(degrees)), in_use=True
    )
    assert GyroFault.BIASED in found


@pytest.mark.parametrize("seed", range(5))
def test_a_wheel_that_slips_is_counted_and_the_gyro_is_not_blamed(seed: int) -> None:
    """A fifth too much on the right, over 0.23 m: 10 to 25 degrees a second."""
    drive = Drive(seed)
    drive.on(driven(60), right, in_use=True)
    assert drive.comparison.slips == 0

    def slipping(k: int, path: float, turn: float) -> tuple[float, float]:
        return turn + 0.2 * (path + turn * 0.115) / 0.23, turn

    assert not any(drive.on(driven(10, 60), slipping, in_use=True))
    assert drive.comparison.slips == 10
    assert drive.comparison.last_slip == 69_000_000
    drive.on(driven(20, 70), right, in_use=True)
    assert drive.comparison.slips == 10


def test_a_wheel_that_slips_while_the_robot_turns_nearly_on_the_spot_is_no_bias() -> None:
    """7 deg/s for five seconds, ahead or not: the right wheel goes as far."""
    drive = Drive()
    drive.on(driven(60), right, in_use=True)
    slow = [(60, 0.18, 0.0), (61, 0.12, 0.4), *((k, 0.07, 0.66) for k in range(62, 68))]

    def slipping(k: int, path: float, turn: float) -> tuple[float, float]:
        return turn + 0.2 * (path + turn * 0.115) / 0.23, turn

    assert not any(drive.on(slow, slipping, in_use=True))
    assert drive.comparison.slips == 8


@pytest.mark.parametrize("ratio", [0.6, 1.5])
def test_a_track_that_is_wrong_is_learned_and_is_no_slip(ratio: float) -> None:
    drive = Drive()

    def tracked(k: int, path: float, turn: float) -> tuple[float, float]:
        return ratio * turn, turn

    assert not any(drive.on(driven(30), tracked, in_use=False))
    assert drive.comparison.is_passed()
    assert drive.comparison.known.ratio == pytest.approx(ratio, rel=0.02)
    assert not any(drive.on(driven(30, 30), tracked, in_use=True))
    assert drive.comparison.slips == 0


def test_what_is_forgotten_counts_no_more() -> None:
    drive = Drive()
    drive.on(driven(20), right, in_use=False)
    drive.comparison.forget()
    assert drive.comparison.known.ratio == 1.0
    assert not drive.comparison.is_passed()


def test_a_gyro_that_makes_no_sense_for_long_is_let_go() -> None:
    """Neither always by as much nor as much as a wheel drives."""
    rng = np.random.default_rng(2)
    drive = Drive()
    drive.on(driven(60), right, in_use=True)

    def wild(k: int, path: float, turn: float) -> tuple[float, float]:
        return turn, turn + float(rng.choice([-0.5, 0.5])) * float(rng.uniform(0.5, 1))

    found = drive.on(driven(40, 60), wild, in_use=True)
    first = next(k for k, fault in enumerate(found) if fault)
    assert found[first] is GyroFault.SCALED
    assert first in range(24, 32)


def test_an_encoder_that_is_dead_for_long_is_the_wheels() -> None:
    """The left wheel stands; the right one tells a turn of what it drives."""
    drive = Drive()
    drive.on(driven(60), right, in_use=True)

    def dead(k: int, path: float, turn: float) -> tuple[float, float]:
        return (path + turn * 0.115) / 0.23, turn

    assert not any(drive.on(driven(60, 60), dead, in_use=True))
    assert drive.comparison.slips > 50
