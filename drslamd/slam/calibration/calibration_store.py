"""Self-calibration over restarts: the next start begins with what this one learned.

A kept constant is taken out where its sensor comes in, so everything that follows, here and at the
peers, sees better odometry and better ranges, and the priors of all robots stay equal:

    distance' = (1 - scale) distance     turn' = turn - yaw |distance|     r' = r - bias

Its sigma comes back wider, because tyres, loads and antennas change between two starts; module 3
then learns what is left. Scale and yaw rate are those of our own odometry, biases those of the
pairs that we own, by the id of the peer.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from drslamd.config import RelativePoseSection
from drslamd.conventions import MAX_ROBOT_ID
from drslamd.sensors.samples import Motion
from drslamd.slam.calibration.window_calibration import LEAST_BIAS_M, LEAST_SCALE, SHARED, remaining
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.odometry.track import OdometryNoise

CHANGED_BIAS_M = 0.15
"""Modules and antennas are swapped, and recorded pairs differ by some decimetres."""
CHANGED_SCALE = 0.03
"""Worn or newly inflated tyres, another floor."""
CHANGED_YAW = math.radians(0.1)
"""rad/m, for the same reasons on one side only."""
LEAST_YAW = math.radians(0.02)
MOST_BIAS_M, MOST_SCALE, MOST_YAW = 5.0, 0.5, math.radians(20)
"""What a configuration could allow for; beyond it a value is no calibration."""
MAX_BIASES = MAX_ROBOT_ID
"""As many peers as there are ids."""
SHARPER = 0.8
"""A sigma that shrank by a fifth is worth a write."""

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
            scale=remaining(self.scale, noise.scale, CHANGED_SCALE),
            yaw_rad_per_m=remaining(self.yaw, noise.yaw_rad_per_m, CHANGED_YAW),
        )

    def bias_sigma(self, peer: int, before: float) -> float:
        """What is left of the bias of a pair, one sigma, m."""
        return remaining(self.bias_to(peer), before, CHANGED_BIAS_M)


UNLEARNED = SensorCalibration()


def is_sound(state: object) -> bool:
    """Could `SensorCalibration.state` have written this? Anything may be given."""
    if not isinstance(state, dict):
        return False
    biases = state.get("bias_m", {})
    return (
        isinstance(biases, dict)
        and len(biases) <= MAX_BIASES
        and all(peer.isdecimal() and int(peer) <= MAX_ROBOT_ID for peer in biases)
        and all(_is_value(value, MOST_BIAS_M) for value in biases.values())
        and ("scale" not in state or _is_value(state["scale"], MOST_SCALE))
        and ("yaw_rad_per_m" not in state or _is_value(state["yaw_rad_per_m"], MOST_YAW))
    )


def _is_value(pair: object, most: float) -> bool:
    if not isinstance(pair, (list, tuple)) or len(pair) != 2:
        return False
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in pair):
        return False
    value, sigma = pair
    return bool(abs(value) <= most and 0 < sigma <= most)


class CalibrationStore:
    """The constants of one start."""

    def __init__(self, kept: SensorCalibration, section: RelativePoseSection) -> None:
        """
        Args:
            kept: of the start before this one.
            section: says whether they are used.
        """
        is_used = section.self_calibration and section.algorithm != "paper"
        self.used = kept if is_used else UNLEARNED
        """Taken out of all that this start measures."""
        self.latest = kept
        """What the next start should know."""
        self._kept, self._saved = kept, kept

    def update(self, estimate: TeamEstimate | None, own: int, owned: Collection[int]) -> None:
        """Module 3 has spoken.

        Args:
            owned: peers of the pairs that robot `own` owns.
        """
        if estimate is None or not estimate.converged:
            return
        used, kept, latest = self.used, self._kept, self.latest
        biases = dict(latest.bias)
        for peer in owned:
            rest = estimate.bias_m.get((min(own, peer), max(own, peer)), NOTHING)
            now = Learned(used.bias_to(peer).value + rest.value, rest.sigma)
            if _is_better(now, kept.bias_to(peer), CHANGED_BIAS_M, MOST_BIAS_M):
                biases[peer] = now
        rest, turned = estimate.scale.get(own, NOTHING), estimate.yaw.get(own, NOTHING)
        keep = (1 - used.scale.value) * (1 - rest.value)
        scale = Learned(1 - keep, rest.sigma)
        yaw = Learned(used.yaw.value + turned.value, turned.sigma)
        self.latest = SensorCalibration(
            scale if _is_better(scale, kept.scale, CHANGED_SCALE, MOST_SCALE) else latest.scale,
            yaw if _is_better(yaw, kept.yaw, CHANGED_YAW, MOST_YAW) else latest.yaw,
            biases,
        )

    def saved(self) -> None:
        """The latest constants are on their way to the disk."""
        self._saved = self.latest

    def is_news(self) -> bool:
        """Is what is known now worth a write? A card that is written to wears."""
        before, now = self._saved, self.latest
        return (
            _has_moved(before.scale, now.scale, LEAST_SCALE)
            or _has_moved(before.yaw, now.yaw, LEAST_YAW)
            or any(_has_moved(before.bias_to(p), b, LEAST_BIAS_M) for p, b in now.bias.items())
        )


def _is_better(now: Learned, kept: Learned, change: float, most: float) -> bool:
    """Does this start know more than the one before it did, seen from now?"""
    widened = math.hypot(SHARED * kept.sigma, change)
    return _is_value(now, most) and SHARED * now.sigma < widened


def _has_moved(before: Learned, now: Learned, step: float) -> bool:
    return abs(now.value - before.value) > step or now.sigma < SHARPER * before.sigma
