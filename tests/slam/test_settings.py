"""Sections of the configuration become the numbers that the rooms work with."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from slam_scenes import NOISE, config

from drslamd.conventions import Chain
from drslamd.slam.closure_method import AGREEMENT, CONFIRM_US, PAPER_AGREEMENT
from drslamd.slam.optimizer.banded.banded_optimizer import SCALE_TAILS, BandedOptimizer
from drslamd.slam.optimizer.closures.closure_optimizer import ClosureOptimizer
from drslamd.slam.optimizer.closures.gnc import BELIEVABLE
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import RbcdOptimizer
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.settings import closure_method, odometry_noise, optimizer, robot_model
from drslamd.slam.tuning import DEFAULTS, Tuning

OWN = Chain(3, 7)
OTHER_RANGES = RangeModel(near_reach_m=6.0)


def test_the_configuration_speaks_degrees_and_the_code_radians() -> None:
    text = (
        "[odometry]\nscale_sigma = 0.02\nyaw_sigma_deg_per_m = 1.8\n"
        "random_translation_per_sqrt_m = 0.03\nrandom_yaw_deg_per_sqrt_m = 3.6\n"
    )
    noise = odometry_noise(config(extra=text).odometry)
    expected = (0.02, math.pi / 100, 0.03, math.pi / 50)
    assert (
        noise.scale,
        noise.yaw_rad_per_m,
        noise.translation_per_sqrt_m,
        noise.yaw_rad_per_sqrt_m,
    ) == pytest.approx(expected)


def test_an_antenna_stands_where_the_configuration_puts_it() -> None:
    text = "antenna_x_m = 0.25\nantenna_y_m = -0.5\nantenna_z_m = 1.5\n"
    model = robot_model(config(uwb=text), NOISE)
    assert replace(model, half_track_m=0.0) == RobotModel(NOISE, 0.25, -0.5, 1.5)


DBC = 'source = "dbc"\ncan.channel = "can0"\ndbc_file = "/etc/base.dbc"\ntrack_m = 0.5\n'
SIDES = 'measures = "wheel_speeds"\nleft = "A.L"\nright = "A.R"\n'
TWIST = 'measures = "twist"\nlinear = "A.V"\nangular = "A.W"\n'


@pytest.mark.parametrize(
    ("wheels", "half_track_m"),
    [
        ('source = "kobuki"\nport = "/dev/wheels"\ntrack_m = 0.3\n', 0.15),
        ('source = "agilex"\ncan.channel = "can0"\ntrack_m = 0.5\n', 0.0),
        (DBC + SIDES, 0.25),
        (DBC + TWIST, 0.0),
    ],
)
def test_wheels_have_sides_where_they_say_how_far_each_side_went(
    wheels: str, half_track_m: float
) -> None:
    assert robot_model(config(wheels=wheels), NOISE).half_track_m == pytest.approx(half_track_m)


def test_windows_are_as_long_as_configured_and_confirmed_by_what_comes_after() -> None:
    method = closure_method(config(extra="[relative_pose]\nwindow_max_s = 30.5\n").relative_pose)
    assert method.rule.span_us == 30_500_000
    assert method.rule.confirm_us == CONFIRM_US
    assert method.rule.drops_blocked
    assert method.agreement == AGREEMENT
    assert method.uses_calibration
    tuned = closure_method(config().relative_pose, Tuning(confirm_us=5))
    assert tuned.rule.confirm_us == 5


def test_self_calibration_may_be_turned_off() -> None:
    section = config(extra="[relative_pose]\nself_calibration = false\n").relative_pose
    assert not closure_method(section).uses_calibration


def test_the_paper_has_windows_of_tau_samples_at_ten_hertz_and_no_calibration() -> None:
    text = '[relative_pose]\nalgorithm = "paper"\ntau = 35\nwindow_max_s = 100\n'
    method = closure_method(config(extra=text).relative_pose)
    assert (method.rule.span_us, method.rule.bin_us) == (3_500_000, 100_000)
    assert method.rule.confirm_us == 0
    assert not method.rule.drops_blocked
    assert method.agreement == PAPER_AGREEMENT
    assert not method.uses_calibration


def test_the_default_optimiser_gets_the_noise_of_ranges() -> None:
    text = "[relative_pose]\nrange_sigma_m = 0.2\nrange_bias_sigma_m = 0.7\n"
    made = optimizer(config(extra=text), OWN)
    assert isinstance(made, BandedOptimizer)
    assert made == BandedOptimizer(bias_sigma=0.7, range_sigma=0.2, solve=made.solve)
    assert (made.scale_tails, made.model) == (SCALE_TAILS, LINKTRACK)


@pytest.mark.parametrize(
    ("tuning", "changed"),
    [
        ({"ranges": OTHER_RANGES}, {"model": OTHER_RANGES}),
        ({"scale_tails": 1.0}, {"scale_tails": 1.0}),
    ],
)
def test_what_the_laboratory_tunes_reaches_the_optimiser(
    tuning: dict[str, object], changed: dict[str, object]
) -> None:
    plain = optimizer(config(), OWN)
    assert isinstance(plain, BandedOptimizer)
    tuned = optimizer(config(), OWN, replace(DEFAULTS, **tuning))  # type: ignore[arg-type]
    assert tuned == replace(plain, **changed)  # type: ignore[arg-type]


def test_closures_alone_are_solved_by_the_optimiser_of_closures() -> None:
    alone = config(extra='[optimizer]\nalgorithm = "closures"\n')
    assert optimizer(alone, OWN) == ClosureOptimizer(BELIEVABLE)
    assert optimizer(alone, OWN, Tuning(believable=0.5)) == ClosureOptimizer(0.5)


def test_the_optimiser_of_the_paper_knows_whose_block_is_ours_and_the_rank() -> None:
    made = optimizer(config(extra='[optimizer]\nalgorithm = "rbcd"\nrank = 7\n'), OWN)
    assert isinstance(made, RbcdOptimizer)
    assert (made._own, made._rank) == (OWN, 7)
