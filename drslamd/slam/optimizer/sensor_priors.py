"""The constants of a team's sensors as unknowns of module 3, and what is believed of them before
anything is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE, BiasPrior, cauchy_curvature
from drslamd.slam.optimizer.mounting_prior import ANTENNA, TRACK
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class Calibration:
    """What an optimiser learned about the sensors.

    Attributes:
        bias: (pairs,) m; team_bias: (1,) what they have in common.
        scale, yaw: (robots,) fraction and rad/m.
        near_bias: (1,) m.
        turn: (robots,) by which fraction turns are longer than odometry says ...
        antenna: (robots, 2) ... and where the antenna is beside its place, m, where mountings are
            in doubt.
    """

    bias: Array
    scale: Array
    yaw: Array
    near_bias: Array
    team_bias: Array
    turn: Array
    antenna: Array

    @staticmethod
    def zero(pairs: int, robots: int) -> Calibration:
        shapes = (pairs, robots, robots, 1, 1, robots, (robots, 2))
        return Calibration(*(np.zeros(shape) for shape in shapes))

    def plus(self, step: Calibration) -> Calibration:
        return Calibration(
            bias=self.bias + step.bias,
            scale=self.scale + step.scale,
            yaw=self.yaw + step.yaw,
            near_bias=self.near_bias + step.near_bias,
            team_bias=self.team_bias + step.team_bias,
            turn=self.turn + step.turn,
            antenna=self.antenna + step.antenna,
        )


@dataclass(frozen=True)
class Priors:
    """What is believed of the sensors' constants before anything is measured.

    Attributes:
        bias: of the pairs' range biases.
        scale: (robots,) sigmas as configured, a fraction.
        scale_tails: the cost of a scale is Cauchy's, log(1 + (s / width)^2), with a width so many
            times narrower than that.
        yaw: (robots,) sigmas as configured, rad/m; the cost is Cauchy's with that half width, for
            a worn or flat tyre bends a way by many times as much.
        near_bias: m, for the whole team: its modules are of one kind, and the near-range bias
            follows the power that is received.
    """

    bias: BiasPrior
    scale: Array
    scale_tails: float
    yaw: Array
    near_bias: float

    @property
    def scale_width(self) -> Array:
        """(robots,) half widths of Cauchy's cost, a fraction."""
        return self.scale / self.scale_tails

    def scale_pull(self, scale: Array) -> Array:
        """(robots,) half the derivative of the cost by scales."""
        return np.asarray(scale / (self.scale_width**2 + scale**2))

    def scale_curvature(self, scale: Array, least: float = LEAST_CURVATURE) -> Array:
        """(robots,) half the second derivative, kept positive."""
        return cauchy_curvature(self.scale_width, scale, least)

    def yaw_pull(self, yaw: Array) -> Array:
        """(robots,) half the derivative of the cost by yaw rates."""
        return np.asarray(yaw / (self.yaw**2 + yaw**2))

    def yaw_curvature(self, yaw: Array, least: float = LEAST_CURVATURE) -> Array:
        """(robots,) half the second derivative of the cost by yaw rates, kept positive."""
        return cauchy_curvature(self.yaw, yaw, least)

    def yaw_claim(self, yaw: Array) -> Array:
        """(robots,) what may be claimed to be known of them: who is far off may be so elsewhere."""
        return np.asarray(1 / (self.yaw**2 + yaw**2))

    def cost(self, calibration: Calibration) -> float:
        """Of all that is learned of the sensors."""
        team = float(calibration.team_bias[0])
        scale = calibration.scale / self.scale_width
        yaw = calibration.yaw / self.yaw
        near_bias = calibration.near_bias / self.near_bias
        return (
            self.bias.cost(calibration.bias - team, team)
            + float(np.log1p(scale**2).sum() + np.log1p(yaw**2).sum())
            + float(near_bias @ near_bias)
            + TRACK.cost(calibration.turn[:, None])
            + ANTENNA.cost(calibration.antenna)
        )
