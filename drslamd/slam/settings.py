"""Where the configuration ends: its sections become the numbers that the rooms work with."""

from __future__ import annotations

import math

import numpy as np

from drslamd.config import Config, OdometrySection, RelativePoseSection
from drslamd.config_wheels import AgilexSection, DbcSection, WheelSection
from drslamd.conventions import GRID_HZ, SECOND_US, Chain
from drslamd.slam.closure_method import ClosureMethod, drslamd_method, paper_method
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.optimizer.banded.banded_optimizer import BandedOptimizer
from drslamd.slam.optimizer.closures.closure_optimizer import ClosureOptimizer
from drslamd.slam.optimizer.contract import Optimizer
from drslamd.slam.optimizer.kept import kept_solver
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import RbcdOptimizer
from drslamd.slam.points.site import Survey
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.tuning import DEFAULTS, Tuning


def odometry_noise(section: OdometrySection) -> OdometryNoise:
    """Sigmas in radians."""
    return OdometryNoise(
        section.scale_sigma,
        math.radians(section.yaw_sigma_deg_per_m),
        section.random_translation_per_sqrt_m,
        math.radians(section.random_yaw_deg_per_sqrt_m),
    )


def robot_model(config: Config, noise: OdometryNoise) -> RobotModel:
    """
    Args:
        noise: of our odometry, as much of it as is not known.
    """
    uwb, wheels = config.uwb, config.wheels
    half_track_m = wheels.track_m / 2 if has_sides(wheels) else 0.0
    return RobotModel(noise, uwb.antenna_x_m, uwb.antenna_y_m, uwb.antenna_z_m, half_track_m)


def survey(config: Config) -> Survey | None:
    """Of `[[beacon]]`; None where there is none."""
    degrees = {b.uwb_id: (b.latitude_deg, b.longitude_deg) for b in config.beacon}
    if not degrees:
        return None
    if config.beacon[0].x_m is None:
        known = {k: (lat, lon) for k, (lat, lon) in degrees.items() if lat is not None}
        return Survey.of_degrees({k: (lat, lon or 0.0) for k, (lat, lon) in known.items()})
    return Survey({b.uwb_id: np.array([b.x_m, b.y_m], dtype=float) for b in config.beacon})


def has_sides(wheels: WheelSection) -> bool:
    """Do these wheels say how far each side went, or only what the whole robot did?"""
    is_twist = isinstance(wheels, DbcSection) and wheels.measures == "twist"
    return not (is_twist or isinstance(wheels, AgilexSection))


def closure_method(section: RelativePoseSection, tuning: Tuning = DEFAULTS) -> ClosureMethod:
    """Of `relative_pose.algorithm`."""
    if section.algorithm == "paper":
        return paper_method(section.tau, section.range_sigma_m, section.delta)
    longest_us = int(section.window_max_s * SECOND_US)
    return drslamd_method(longest_us, section.delta, section.self_calibration, tuning.confirm_us)


def optimizer(config: Config, own: Chain, tuning: Tuning = DEFAULTS) -> Optimizer:
    """Of `optimizer.algorithm`."""
    section = config.optimizer
    window_n = round(config.relative_pose.window_max_s * GRID_HZ)
    if section.algorithm == "rbcd":
        return RbcdOptimizer(own, section.rank, window_n)
    if section.algorithm == "closures":
        return ClosureOptimizer(tuning.believable, window_n)
    return banded_optimizer(config, tuning)


def banded_optimizer(config: Config, tuning: Tuning = DEFAULTS) -> BandedOptimizer:
    """The numbers of ranges and odometry, whatever solves them."""
    ranges = config.relative_pose
    return BandedOptimizer(
        bias_sigma=ranges.range_bias_sigma_m,
        range_sigma=ranges.range_sigma_m,
        model=tuning.ranges,
        scale_tails=tuning.scale_tails,
        solve=kept_solver.solve,
    )
