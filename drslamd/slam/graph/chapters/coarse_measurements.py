"""Measurements as chapters say them: in steps of what they can tell, because the rest is noise.

A quantity in steps of an eighth of its sigma is as uncertain as before, but for a thousandth. What
is in such steps stays as it is, so a chapter of chapters says the same.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement

OF_SIGMA = 8
MILLIMETRE_M = 1e-3
TURN_STEPS = 64
"""Steps of `ROTATION_STEP_RAD`, 6 mrad: it turns an antenna arm of 0.3 m by 1 mm at most."""
KEYFRAME_STEPS = 10
"""1 mm and 1 mrad of keyframes seconds apart: a tenth of what odometry errs between them."""
LOW_BITS = 14
"""Of variances; nine are left, two thousandths."""


def coarse_range(item: RangeMeasurement) -> RangeMeasurement:
    """A range, arms and turns of its antennas in steps."""
    millimetres = 2 ** max(0, math.floor(math.log2(item.sigma_m / MILLIMETRE_M / OF_SIGMA)))
    tenths = round(millimetres * MILLIMETRE_M / TRANSLATION_STEP_M)

    def arm(q: tuple[float, float]) -> tuple[float, float]:
        x, y = (_steps(v, MILLIMETRE_M, millimetres) * MILLIMETRE_M for v in q)
        return x, y

    return replace(
        item,
        q_a=arm(item.q_a),
        q_b=arm(item.q_b),
        range_m=_steps(item.range_m, TRANSLATION_STEP_M, tenths) * TRANSLATION_STEP_M,
        turn_a=_steps(item.turn_a, ROTATION_STEP_RAD, TURN_STEPS) * ROTATION_STEP_RAD,
        turn_b=_steps(item.turn_b, ROTATION_STEP_RAD, TURN_STEPS) * ROTATION_STEP_RAD,
    )


def coarse_closure(item: ClosureMeasurement) -> ClosureMeasurement:
    """A closure, its covariance with fewer digits where that is one."""
    bits = np.array(item.covariance, dtype=np.float32).view(np.uint32)
    few = ((bits + (1 << LOW_BITS - 1)) >> LOW_BITS << LOW_BITS).view(np.float32).astype(float)
    upper = few[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    is_whole = np.isfinite(few).all() and np.linalg.eigvalsh(upper)[0] > 0.5 * _least(item)
    return replace(item, covariance=tuple(few.tolist())) if is_whole else item


def _least(item: ClosureMeasurement) -> float:
    """The smallest variance in any direction."""
    packed = np.array(item.covariance)
    return float(np.linalg.eigvalsh(packed[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]])[0])


def coarse_keyframe(k: Keyframe) -> Keyframe:
    """A keyframe of which the next one is seconds away."""
    x, y, theta = (_steps(v, 1, KEYFRAME_STEPS) for v in (k.x, k.y, k.theta))
    return Keyframe(k.n, k.segment, x, y, theta)


def _steps(value: float, unit: float, steps: int) -> int:
    """The nearest multiple of so many units."""
    return round(round(value / unit) / steps) * steps
