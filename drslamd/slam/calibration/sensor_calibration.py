"""The constants of one robot's sensors, as one start learns them and the next begins with them.

A kept constant is taken out where its sensor comes in, so everything that follows, here and at the
peers, sees better odometry and better ranges, and the priors of all robots stay equal:

    distance' = (1 - scale) distance     turn' = turn - yaw |distance|     r' = r - bias

Its sigma comes back wider, because tyres, loads and antennas change between two starts; module 3
then learns what is left. Scale and yaw rate are those of our own odometry, biases those of the
pairs that we own, by the id of the peer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from drslamd.conventions import MAX_ROBOT_ID, ROBOT_NAMES
from drslamd.sensors.samples import Motion
from drslamd.slam.calibration.window_calibration import remaining
from drslamd.slam.graph.estimate import Learned
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import LINKTRACK

CHANGED_BIAS_M = 0.15
"""Modules and antennas are swapped, and recorded pairs differ by some decimetres."""
CHANGED_SCALE = 0.03
"""Worn or newly inflated tyres, another floor."""
CHANGED_YAW = math.radians(0.1)
"""rad/m, for the same reasons on one side only."""
MOST_BIAS_M = 5.0
"""What a configuration could allow for; beyond it a value is no calibration."""
MOST_SCALE_ERROR = 0.5
"""Likewise."""
MOST_YAW_RATE = math.radians(20)
"""Likewise, rad/m."""
MAX_BIASES = MAX_ROBOT_ID
"""As many peers as there are ids."""
WIDENED = LINKTRACK.shared
"""Learned sigmas count every range as if it were independent."""

NOTHING = Learned()


@dataclass(frozen=True)
class SensorCalibration:
    """Scale, yaw rate (rad/m) and biases (m) by peer."""

    scale: Learned = NOTHING
    yaw: Learned = NOTHING
    bias: Mapping[int, Learned] = field(default_factory=dict)

    def bias_to(self, peer: int) -> Learned:
        return self.bias.get(peer, NOTHING)

    def state(self) -> dict[str, Any]:
        """As it is kept in a file; what was never measured is left out."""
        named = {"scale": self.scale, "yaw_rad_per_m": self.yaw}
        return {
            **{name: list(value) for name, value in named.items() if math.isfinite(value.sigma)},
            "bias_m": {str(peer): list(value) for peer, value in self.bias.items()},
        }

    @staticmethod
    def of_state(state: Mapping[str, Any]) -> SensorCalibration:
        """What `state` gave, after `is_sound`."""
        return SensorCalibration(
            Learned(*state.get("scale", ())),
            Learned(*state.get("yaw_rad_per_m", ())),
            {int(peer): Learned(*value) for peer, value in state.get("bias_m", {}).items()},
        )

    def corrected(self, motion: Motion) -> Motion:
        """Odometry without its known errors."""
        distance, turn = motion.distance_m, motion.turn_rad
        return replace(
            motion,
            distance_m=(1 - self.scale.value) * distance,
            turn_rad=turn - self.yaw.value * abs(distance),
        )

    def narrowed(self, noise: OdometryNoise) -> OdometryNoise:
        """What is left of the noise of our odometry."""
        return replace(
            noise,
            scale=remaining(self.scale, noise.scale, CHANGED_SCALE, WIDENED),
            yaw_rad_per_m=remaining(self.yaw, noise.yaw_rad_per_m, CHANGED_YAW, WIDENED),
        )

    def bias_sigma(self, peer: int, before: float) -> float:
        """What is left of the bias of a pair, one sigma, m."""
        return remaining(self.bias_to(peer), before, CHANGED_BIAS_M, WIDENED)


UNLEARNED = SensorCalibration()


def is_sound(state: object) -> bool:
    """Could `SensorCalibration.state` have written this? Anything may be given."""
    if not isinstance(state, dict):
        return False
    biases = state.get("bias_m", {})
    return (
        isinstance(biases, dict)
        and len(biases) <= MAX_BIASES
        and biases.keys() <= ROBOT_NAMES
        and all(is_value(value, MOST_BIAS_M) for value in biases.values())
        and ("scale" not in state or is_value(state["scale"], MOST_SCALE_ERROR))
        and ("yaw_rad_per_m" not in state or is_value(state["yaw_rad_per_m"], MOST_YAW_RATE))
    )


def is_value(pair: object, most: float) -> bool:
    """Is it a learned value and its sigma, neither beyond `most`?"""
    if not isinstance(pair, (list, tuple)) or len(pair) != 2:
        return False
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in pair):
        return False
    value, sigma = pair
    return bool(abs(value) <= most and 0 < sigma <= most)
