"""The turn that is believed, of a robot with wheels and a gyro."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from drslamd.sensors.gyro.comparison import GyroFault
from drslamd.sensors.gyro.gyro_heading import GyroHeading
from drslamd.sensors.samples import GyroAngle, GyroRate, GyroSigmas, Motion

SIGMAS = GyroSigmas(math.radians(0.01), math.radians(10 / 3600))
WHEELS = math.radians(0.15), math.radians(0.5)
T0 = 1_000_000_000
HZ = 10
Angle = Callable[[float, float], "float | None"]
"""Time s and true heading rad to what the gyro says."""


def honest(t: float, heading: float) -> float | None:
    return heading


@dataclass
class Drive:
    """Ten motions a second, with curves, at 0.1 to 0.5 m/s; noise as configured."""

    gyro: GyroHeading = field(default_factory=lambda: GyroHeading(SIGMAS, WHEELS, 0.115))
    says: Angle = honest
    seed: int = 1
    motions: list[Motion] = field(default_factory=list)
    stands: Callable[[float], bool] = lambda t: False
    slip: Callable[[float], float] = lambda t: 0.0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self.k, self.truth = 0, 0.0
        self.named: dict[GyroFault, float] = {}

    def on(self, seconds: float) -> Drive:
        for _ in range(round(seconds * HZ)):
            self._step()
        return self

    def _step(self) -> None:
        self.k += 1
        t = self.k / HZ
        path, turn = (0.3 + 0.2 * math.sin(t / 3)) / HZ, math.radians(20) * math.sin(t / 2) / HZ
        if self.stands(t):
            path = turn = wheels = 0.0
        else:
            noise = float(self._rng.normal()) * WHEELS[1] * math.sqrt(path)
            wheels = turn + noise + self.slip(t) * path
        self.truth += turn
        utime = T0 + round(t * 1e6)
        said = self.says(t, self.truth)
        if said is not None:
            wrapped = math.remainder(said, 2 * math.pi)
            self.gyro.add(GyroAngle(utime, math.radians(round(math.degrees(wrapped), 2))))
        motion = Motion(utime, path, wheels, gap=self.k == 1)
        self.motions.append(self.gyro.turned(motion))
        fault = self.gyro.fault(utime)
        if fault is not None:
            self.named.setdefault(fault, t)

    def error_deg(self) -> float:
        return math.degrees(sum(m.turn_rad for m in self.motions) - self.truth)


def wheels_alone(drive: Drive) -> float:
    """Degrees that the same wheels are off without a gyro."""
    return Drive(says=lambda t, a: None, seed=drive.seed).on(drive.k / HZ).error_deg()


def test_without_a_gyro_motions_are_what_they_were() -> None:
    gyro = GyroHeading(SIGMAS, WHEELS, 0.115)
    assert not gyro.is_there
    assert gyro.turned(Motion(T0, 0.1, 0.2)) == Motion(T0, 0.1, 0.2)
    assert gyro.turned(Motion(T0 + 1, 0.1, 0.2)) == Motion(T0 + 1, 0.1, 0.2)
    assert gyro.fault(T0 + 100_000_000) is None


def test_after_a_trial_the_heading_is_that_of_the_gyro_and_says_how_wrong_it_is() -> None:
    drive = Drive().on(20)
    at = drive.error_deg()
    drive.on(100)
    assert drive.gyro.is_in_use
    assert drive.motions[0].gyro is None
    assert drive.motions[-1].gyro == SIGMAS
    assert drive.error_deg() - at == pytest.approx(0.0, abs=0.05)
    assert not drive.named
    assert drive.gyro.comparison.slips == 0


@pytest.mark.parametrize("seed", range(3))
def test_wheels_that_slip_cost_no_heading_and_are_counted(seed: int) -> None:
    """By 0.8 rad/m: a fifth of the way of a wheel that is 0.25 m from the other one."""
    drive = Drive(seed=seed, slip=lambda t: 0.8 if 60 < t <= 70 else 0.0).on(60)
    at = drive.error_deg()
    drive.on(10)
    assert drive.gyro.slips(drive.motions[-1].utime)
    drive.on(20)
    assert not drive.gyro.slips(drive.motions[-1].utime)
    assert drive.gyro.comparison.slips in range(8, 12)
    assert drive.error_deg() - at == pytest.approx(0.0, abs=0.05)
    assert not drive.named


def heading_at(t: float) -> float:
    """The true one of a `Drive` that does not stand, to a degree."""
    return math.radians(20) * 2 * (1 - math.cos(t / 2))


FAULTS: list[tuple[GyroFault, float, Angle]] = [
    (GyroFault.ABSENT, 60, lambda t, a: a if t < 60 else None),
    (GyroFault.STUCK, 60, lambda t, a: a if t < 60 else heading_at(60)),
    (GyroFault.BIASED, 60, lambda t, a: a + math.radians(max(0.0, t - 60))),
    (GyroFault.BIASED, 0, lambda t, a: a + math.radians(t)),
    (GyroFault.INVERTED, 0, lambda t, a: -a),
    (GyroFault.SCALED, 0, lambda t, a: a / 3),
]


@pytest.mark.parametrize(("fault", "since", "says"), FAULTS)
@pytest.mark.parametrize("seed", range(2))
def test_a_gyro_that_is_wrong_is_named_within_ten_seconds_and_costs_no_heading(
    fault: GyroFault, since: float, says: Angle, seed: int
) -> None:
    """Of what it turned wrongly nothing stays but the seconds in which a robot found it out."""
    drive = Drive(says=says, seed=seed).on(90)
    assert drive.named[fault] <= since + 10
    assert not drive.gyro.is_in_use
    assert drive.motions[-1].gyro is None
    most = max(1.0, abs(wheels_alone(drive)))
    assert abs(drive.error_deg()) < 1.2 * most + 0.5
    assert drive.gyro.faults[fault] in range(1, 12)


def test_a_motion_says_since_when_a_gyro_was_wrong() -> None:
    drive = Drive(says=FAULTS[2][2]).on(90)
    (when,) = [m for m in drive.motions if m.gyro_wrong_since is not None]
    assert when.gyro_wrong_since is not None
    assert 55e6 <= when.gyro_wrong_since - T0 <= 62e6
    assert when.gyro is None


def test_a_gyro_that_comes_back_is_on_trial_again() -> None:
    drive = Drive(says=lambda t, a: None if 60 < t < 70 else a).on(65)
    assert not drive.gyro.is_in_use
    assert drive.gyro.fault(drive.motions[-1].utime) is GyroFault.ABSENT
    drive.on(40)
    assert drive.gyro.is_in_use
    assert drive.gyro.fault(drive.motions[-1].utime) is None


def test_a_robot_that_stands_holds_its_heading_and_learns_the_bias() -> None:
    bias = math.radians(0.3)
    drive = Drive(says=lambda t, a: a + bias * t, stands=lambda t: t < 5).on(5)
    assert drive.error_deg() == pytest.approx(0.0, abs=0.1)
    assert drive.gyro.rest.bias_radps == pytest.approx(bias, abs=math.radians(0.02))
    drive.on(60)
    assert drive.gyro.is_in_use
    assert drive.error_deg() == pytest.approx(0.0, abs=2.0)


def test_a_large_bias_is_named_though_it_is_taken_out() -> None:
    drive = Drive(says=lambda t, a: a + math.radians(t), stands=lambda t: t < 5).on(40)
    assert drive.gyro.is_in_use
    assert drive.gyro.fault(drive.motions[-1].utime) is GyroFault.BIASED


def test_a_gyro_that_is_mounted_upside_down_may_be_said_to_be_so() -> None:
    gyro = GyroHeading(SIGMAS, WHEELS, 0.115, is_reversed=True)
    drive = Drive(gyro, says=lambda t, a: -a).on(30)
    assert drive.gyro.is_in_use
    assert not drive.named


def test_what_happens_is_counted_by_name() -> None:
    drive = Drive(says=lambda t, a: -a, slip=lambda t: 0.0).on(20)
    drive.gyro.add(GyroRate(0, 0.1))
    assert drive.gyro.counters() == {
        "gyro.refused": 1,
        "gyro.broken": 1,
        "gyro.slips": 0,
        "gyro.faults.INVERTED": 1,
    }


def test_over_a_gap_nothing_is_turned() -> None:
    drive = Drive().on(30)
    utime = drive.motions[-1].utime + 100_000
    drive.gyro.add(GyroAngle(utime, 1.0))
    gap = Motion(utime, 0.0, 0.0, gap=True)
    assert drive.gyro.turned(gap) == gap
    assert drive.gyro.is_in_use


def test_a_bias_that_comes_after_a_rest_is_not_believed_to_be_a_wheel() -> None:
    """At one speed a bias looks like a worn wheel; what was seen at rest says nothing any more."""
    drive = Drive(
        says=lambda t, a: a + math.radians(max(0.0, t - 60)), stands=lambda t: 20 < t < 25
    ).on(140)
    assert not drive.gyro.is_in_use
    assert abs(drive.error_deg()) < 8


@pytest.mark.parametrize("sign", [1, -1])
def test_what_a_wheel_spun_is_taken_out_of_the_way(sign: int) -> None:
    """The right wheel goes a fifth too far for ten seconds, ahead or back."""
    gyro = GyroHeading(SIGMAS, WHEELS, 0.115)
    went, heading, said = 0.0, 0.0, []
    for k in range(1, 90 * HZ):
        t = k / HZ
        path, turn = sign * 0.3 / HZ, math.radians(20) * math.sin(t / 2) / HZ
        spun = 0.2 * (path + turn * 0.115) if 60 < t <= 70 else 0.0
        went, heading, utime = went + path, heading + turn, T0 + round(t * 1e6)
        gyro.add(GyroAngle(utime, heading))
        said.append(gyro.turned(Motion(utime, path + spun / 2, turn + spun / 0.23, gap=k == 1)))
    # without that it would be 0.3 m
    assert sum(m.distance_m for m in said) == pytest.approx(went, abs=0.05)


def test_a_wheel_that_stands_is_not_taken_for_one_that_spins() -> None:
    """Its encoder is dead: half of the way is lost, and no more."""
    gyro = GyroHeading(SIGMAS, WHEELS, 0.115)
    heading, said = 0.0, []
    for k in range(1, 70 * HZ):
        t = k / HZ
        path, turn = 0.3 / HZ, math.radians(20) * math.sin(t / 2) / HZ
        heading, utime = heading + turn, T0 + round(t * 1e6)
        right = path + turn * 0.115
        wheels = (right / 2, right / 0.23) if t > 60 else (path, turn)
        gyro.add(GyroAngle(utime, heading))
        said.append(gyro.turned(Motion(utime, *wheels, gap=k == 1)))
    assert sum(m.distance_m for m in said[-5 * HZ :]) == pytest.approx(0.75, abs=0.1)
