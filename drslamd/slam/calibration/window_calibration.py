"""Self-calibration: what module 3 learned of the sensors serves module 1.

A window alone hardly tells a range bias from distance, or a wheel's scale from speed; hours of
driving do. Module 3 carries the bias of each pair, the near-range bias of the team and the scale of
each robot's odometry as unknowns. Here a window is rid of what is known of them, and its noise says
what is still unknown:

    r' = r - bias - near_bias exp(-r' / L)     p' = (1 - scale) p
    theta' = (1 + turn) theta - yaw |p|
    sigma'^2 = sigma_measured^2 + least^2

Module 3's sigmas are those of all that it knows, its priors included. Nothing falls below what no
constant can describe, nor rises above what was believed before.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.graph.estimate import LEAST_SCALE, Learned, TeamEstimate
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.mounting import CORRECTED, Repair
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.mistakes.what_if import Case
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.se2 import Array

ODD_YAW = math.radians(0.6)
"""rad/m. Wheels of unlike size; what is usual is noise of a long way."""


class EndCalibration(NamedTuple):
    """What is known of the sensors of one robot of a pair.

    Attributes:
        scale: of its odometry, a fraction; turn: by which fraction turns are longer; yaw: which
            turn is not there, rad/m, where it is unusual.
        antenna: (2,) of its antenna beside its place, m.
    """

    scale: Learned = Learned()
    turn: float = 0.0
    antenna: tuple[float, float] = (0.0, 0.0)
    yaw: float = 0.0

    @staticmethod
    def of(estimate: TeamEstimate, robot: int) -> EndCalibration:
        yaw = estimate.yaw.get(robot, Learned()).value
        x, y = estimate.antenna_m.get(robot, (Learned(), Learned()))
        return EndCalibration(
            estimate.scale.get(robot, Learned()),
            estimate.turn.get(robot, Learned()).value,
            (x.value, y.value),
            yaw if abs(yaw) > ODD_YAW else 0.0,
        )

    @staticmethod
    def repaired(repair: Repair) -> EndCalibration:
        """Where a search for mistakes has found one that is taken out."""
        if repair.fault not in CORRECTED:
            return EndCalibration()
        return EndCalibration(Learned(1 - repair.way), repair.turn - 1)

    @property
    def correction(self) -> Correction:
        """Of a long way, where wheels are not as configured; a usual scale is noise."""
        is_odd = self.turn or self.yaw
        return Correction(self.scale.value, self.yaw, self.turn) if is_odd else Correction()

    def path(self, poses: Array, before: int) -> Array:
        """(n, 3) poses of a window, seen from its reference time, as they should have been.

        Args:
            before: how many of them lie before the reference time.
        """
        whole = np.concatenate([poses[:before], np.zeros((1, 3)), poses[before:]])
        better = Correction(self.scale.value, self.yaw, self.turn).path(whole)
        seen = se2.between(better[before], better)
        return np.concatenate([seen[:before], seen[before + 1 :]])


class PairCalibration(NamedTuple):
    """What is known of one pair's sensors.

    Attributes:
        bias: of the pair, m; bias_sigma: how wrong that may be.
        a, b: of both robots.
        scatter: of the pair's ranges over the configured sigma, see `range_scatter`.
        near_bias: of the team, m at range 0, see `RangeModel.near_range_shape`.
    """

    bias: Learned = Learned()
    a: EndCalibration = EndCalibration()
    b: EndCalibration = EndCalibration()
    scatter: float = 1.0
    near_bias: Learned = Learned()
    bias_sigma: float = 0.0

    @staticmethod
    def of(
        estimate: TeamEstimate | None, a: int, b: int, found: Case | None = None
    ) -> PairCalibration:
        """Of robots a and b, as the team's last solution has them, if it is one.

        Args:
            found: what a search for mistakes found; it serves until module 3 has learned more.
        """
        if found is not None and not has_learned(estimate, (a, b), found):
            a_end, b_end = (EndCalibration.repaired(repair) for repair in found)
            return PairCalibration(a=a_end, b=b_end)
        if estimate is None or not estimate.converged:
            return PairCalibration()
        pair = (min(a, b), max(a, b))
        return PairCalibration(
            estimate.bias_m.get(pair, Learned()),
            EndCalibration.of(estimate, a),
            EndCalibration.of(estimate, b),
            estimate.scatter.get(pair, 1.0),
            estimate.near_bias_m,
            estimate.bias_sigma_m.get(pair, 0.0),
        )


def has_learned(estimate: TeamEstimate | None, robots: tuple[int, int], found: Case) -> bool:
    """Has module 3 gone most of the way to what was found?"""
    if estimate is None or not estimate.converged:
        return False
    for robot, repair in zip(robots, found, strict=True):
        start = EndCalibration.repaired(repair)
        scale = estimate.scale.get(robot, Learned()).value
        turn = estimate.turn.get(robot, Learned()).value
        if abs(start.scale.value - scale) > abs(scale) or abs(start.turn - turn) > abs(turn):
            return False
    return True


def remaining(learned: Learned, before: float, least: float) -> float:
    """Sigma of what is left of a constant when its learned value is taken out.

    Args:
        before: its sigma before anything was measured.
        least: what no constant can describe.
    """
    return float(min(before, np.hypot(learned.sigma, least)))


def calibrated_window(
    window: Window, noise: PairNoise, known: PairCalibration
) -> tuple[Window, PairNoise]:
    """The window without its known errors, and the noise that is left."""
    model = noise.model
    plain = window.ranges - known.bias.value
    better = replace(
        window,
        ranges=plain - model.near_range_bias(plain, known.near_bias.value),
        a_poses=known.a.path(window.a_poses, window.before),
        b_poses=known.b.path(window.b_poses, window.before),
        a_antenna=window.a_antenna + known.a.antenna,
        b_antenna=window.b_antenna + known.b.antenna,
    )
    before, least = noise.ranges.bias_sigma, model.least_bias_m
    bias = remaining(known.bias, before, least)
    wrong = remaining(Learned(sigma=known.bias_sigma), before, least)
    beyond = math.sqrt(max(wrong**2 - bias**2, 0.0))
    return better, PairNoise(
        RangeNoise(noise.ranges.sigma, bias, known.scatter, beyond),
        _narrowed(noise.a, known.a.scale),
        _narrowed(noise.b, known.b.scale),
        model,
    )


def _narrowed(noise: OdometryNoise, scale: Learned) -> OdometryNoise:
    return replace(noise, scale=remaining(scale, noise.scale, LEAST_SCALE))
