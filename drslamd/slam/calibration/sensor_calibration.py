"""The constants of one robot's sensors, as one start learns them and the next begins with them.

A kept constant is taken out where its sensor comes in, so everything that follows, here and at the
peers, sees better odometry and better ranges, and the priors of all robots stay equal:

    distance' = (1 - scale) distance     turn' = (1 + longer) turn - yaw |distance|
    r' = r - bias

Its sigma comes back wider, because tyres, loads and antennas change between two starts; module 3
then learns what is left. Scale, yaw rate and turns are those of our own odometry, the antenna is
ours, biases are those of the pairs that we own, by the id of the peer.
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
from drslamd.slam.robot_model import RobotModel

CHANGED_BIAS_M = 0.15
"""Modules and antennas are swapped, and recorded pairs differ by some decimetres."""
CHANGED_SCALE = 0.03
"""Worn or newly inflated tyres, another floor."""
CHANGED_YAW = math.radians(0.1)
"""rad/m, for the same reasons on one side only."""
MOST_BIAS_M = 5.0
"""What a configuration could allow for; beyond it a value is no calibration."""
CHANGED_TURN = 0.05
"""Skid steering turns otherwise on another floor."""
CHANGED_ANTENNA_M = 0.03
"""A mast that was bent, or put back elsewhere."""
MOST_SCALE_ERROR = 1.5
"""Odometry that counts half of the way has -1."""
MOST_TURN = 1.5
"""Likewise."""
MOST_ANTENNA_M = 2.0
"""No configuration is off by more."""
MOST_YAW_RATE = math.radians(20)
"""What a configuration could allow for, rad/m."""
MAX_BIASES = MAX_ROBOT_ID
"""As many peers as there are ids."""

NOTHING = Learned()


@dataclass(frozen=True)
class SensorCalibration:
    """Constants, of which nothing is known until something is.

    Attributes:
        scale: a fraction; yaw: rad/m.
        bias: by peer, m.
        turn: by which fraction turns are longer.
        antenna_x, antenna_y: where our antenna is beside its place, m.
    """

    scale: Learned = NOTHING
    yaw: Learned = NOTHING
    bias: Mapping[int, Learned] = field(default_factory=dict)
    turn: Learned = NOTHING
    antenna_x: Learned = NOTHING
    antenna_y: Learned = NOTHING

    def bias_to(self, peer: int) -> Learned:
        return self.bias.get(peer, NOTHING)

    def state(self) -> dict[str, Any]:
        """As it is kept in a file; what was never measured is left out."""
        named = {name: getattr(self, field_name) for name, (field_name, _) in NAMED.items()}
        return {
            **{name: list(value) for name, value in named.items() if math.isfinite(value.sigma)},
            "bias_m": {str(peer): list(value) for peer, value in self.bias.items()},
        }

    @staticmethod
    def of_state(state: Mapping[str, Any]) -> SensorCalibration:
        """What `state` gave, after `is_sound`."""
        biases = {int(peer): Learned(*value) for peer, value in state.get("bias_m", {}).items()}
        found = {
            field_name: Learned(*state.get(name, ())) for name, (field_name, _) in NAMED.items()
        }
        return SensorCalibration(bias=biases, **found)

    def corrected(self, motion: Motion) -> Motion:
        """Odometry without its known errors."""
        scale, longer, yaw = self.scale.value, self.turn.value, self.yaw.value
        if scale == longer == yaw == 0:
            return motion
        distance, turn = motion.distance_m, motion.turn_rad
        if motion.gyro is not None:
            return replace(motion, distance_m=(1 - scale) * distance)
        return replace(
            motion,
            distance_m=(1 - scale) * distance,
            turn_rad=(1 + longer) * turn - yaw * abs(distance),
        )

    def mounted(self, model: RobotModel) -> RobotModel:
        """Our antenna where it is."""
        return replace(
            model,
            antenna_x_m=model.antenna_x_m + self.antenna_x.value,
            antenna_y_m=model.antenna_y_m + self.antenna_y.value,
        )

    def narrowed(self, noise: OdometryNoise) -> OdometryNoise:
        """What is left of the noise of our odometry."""
        return replace(
            noise,
            scale=remaining(self.scale, noise.scale, CHANGED_SCALE),
            yaw_rad_per_m=remaining(self.yaw, noise.yaw_rad_per_m, CHANGED_YAW),
        )

    def bias_sigma(self, peer: int, before: float) -> float:
        """What is left of the bias of a pair, one sigma, m."""
        return remaining(self.bias_to(peer), before, CHANGED_BIAS_M)


NAMED = {
    "scale": ("scale", MOST_SCALE_ERROR),
    "yaw_rad_per_m": ("yaw", MOST_YAW_RATE),
    "turn": ("turn", MOST_TURN),
    "antenna_x_m": ("antenna_x", MOST_ANTENNA_M),
    "antenna_y_m": ("antenna_y", MOST_ANTENNA_M),
}
"""What the file calls each constant, and its bound."""

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
        and all(
            name not in state or is_value(state[name], most) for name, (_, most) in NAMED.items()
        )
    )


def is_value(pair: object, most: float) -> bool:
    """Is it a learned value and its sigma, neither beyond `most`?"""
    if not isinstance(pair, (list, tuple)) or len(pair) != 2:
        return False
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in pair):
        return False
    value, sigma = pair
    return bool(abs(value) <= most and 0 < sigma <= most)
