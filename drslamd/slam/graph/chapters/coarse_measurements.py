"""Measurements as chapters say them: in steps of what they can tell, because the rest is noise.

A quantity in steps of an eighth of its sigma is as uncertain as before, but for a thousandth. What
is in such steps stays as it is, so a chapter of chapters says the same; and what lies within its
bound stays there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement
from drslamd.slam.graph.pair_data import BEST_SIGMA, FARTHEST_M, WORST_SIGMA
from drslamd.slam.se2 import Array

OF_SIGMA = 8
MILLIMETRE_M = 1e-3
TURN_STEPS = 64
"""Steps of `ROTATION_STEP_RAD`, 6 mrad: it turns an antenna arm of 0.3 m by 1 mm at most."""
WHOLE_WAY_STEPS, KEYFRAME_STEPS = 5, 10
"""0.5 mm and 0.5 mrad of keyframes a second apart, twice that of others: a tenth of what odometry
errs between them, and where a robot stands less than the floor of its noise in module 3."""
LOW_BITS = 14
"""Of variances; nine are left, two thousandths."""
HALF_TURN = math.floor(math.pi / ROTATION_STEP_RAD)
LAST_STEP = 2**31 - 1
"""Of a chain, 32 bits."""
LONGEST_ARM = 2**15 - 1
"""Millimetres, 16 bits."""
FARTHEST = round(FARTHEST_M / TRANSLATION_STEP_M) - 1


def coarse_range(item: RangeMeasurement) -> RangeMeasurement:
    """A range, arms and turns of its antennas in steps."""
    millimetres = _power(item.sigma_m / MILLIMETRE_M)
    tenths = round(millimetres * MILLIMETRE_M / TRANSLATION_STEP_M)

    def arm(q: tuple[float, float]) -> tuple[float, float]:
        x, y = (_steps(v, MILLIMETRE_M, millimetres, LONGEST_ARM) * MILLIMETRE_M for v in q)
        return x, y

    def turn(angle: float) -> float:
        return _steps(angle, ROTATION_STEP_RAD, TURN_STEPS, HALF_TURN) * ROTATION_STEP_RAD

    return replace(
        item,
        q_a=arm(item.q_a),
        q_b=arm(item.q_b),
        range_m=_steps(item.range_m, TRANSLATION_STEP_M, tenths, FARTHEST) * TRANSLATION_STEP_M,
        turn_a=turn(item.turn_a),
        turn_b=turn(item.turn_b),
    )


def coarse_closure(item: ClosureMeasurement) -> ClosureMeasurement:
    """A closure in steps; all of it stays as it is where fewer digits of its covariance are none.

    Steps are those of what one number alone could tell if the others were known, so that a pose
    that is sure in one direction only stays so.
    """
    bits = np.array(item.covariance, dtype=np.float32).view(np.uint32)
    few = ((bits + (1 << LOW_BITS - 1)) >> LOW_BITS << LOW_BITS).view(np.float32).astype(float)
    covariance = _unpacked(few)
    if not _is_bounded(covariance) or not _is_near(covariance, _unpacked(item.covariance)):
        return item
    sigmas = 1 / np.sqrt(np.diagonal(np.linalg.inv(covariance)))
    units = TRANSLATION_STEP_M, TRANSLATION_STEP_M, ROTATION_STEP_RAD
    bounds = FARTHEST, FARTHEST, HALF_TURN
    x, y, theta = (
        _steps(v, unit, _power(sigma / unit), most) * unit
        for v, sigma, unit, most in zip(item.a_T_b, sigmas, units, bounds, strict=True)
    )
    return replace(item, a_T_b=(x, y, theta), covariance=tuple(few.tolist()))


def _unpacked(covariance: Sequence[float] | Array) -> Array:
    """(3, 3) of xx xy xt yy yt tt."""
    return np.array(covariance)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]


def _is_bounded(covariance: Array) -> bool:
    """Would a graph take it?"""
    variances = np.diagonal(covariance)
    return bool((variances > BEST_SIGMA**2).all() and (variances < WORST_SIGMA**2).all())


def _is_near(covariance: Array, before: Array) -> bool:
    """Is the least variance in any direction nearly what it was?"""
    least, known = np.linalg.eigvalsh(covariance)[0], np.linalg.eigvalsh(before)[0]
    return bool(least > 0.5 * known > 0)


def coarse_keyframe(k: Keyframe, steps: int = KEYFRAME_STEPS) -> Keyframe:
    """A keyframe of which the next one is seconds away."""
    x, y, theta = (_steps(v, 1, steps, LAST_STEP) for v in (k.x, k.y, k.theta))
    return Keyframe(k.n, k.segment, x, y, theta)


def _power(sigma: float) -> int:
    """The power of two that is an eighth of sigma or less, and one at least."""
    return 1 << max(0, math.floor(math.log2(sigma / OF_SIGMA)))


def _steps(value: float, unit: float, steps: int, most: int) -> int:
    """The nearest multiple of so many units that is no more than `most`, in units."""
    found = round(round(value / unit) / steps) * steps
    return found if abs(found) <= most else found - int(math.copysign(steps, found))
