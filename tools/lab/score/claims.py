"""Poses with what was claimed of them: are they as wrong as they say?"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lab.recordings.recording import Array
from lab.score import metrics

ELLIPSE_95 = 5.991
"""Chi-squared quantile with two degrees of freedom: the ellipse that ought to hold 95 %."""
LIE_M, LIE_SIGMA_M = 1.0, 0.33
"""Who is off by more than the first and claims less than the second lies."""
WILD = 50.0
"""Squared errors of honest poses, three degrees of freedom, never exceed this."""


class Claim(NamedTuple):
    """A pose with its covariance, against the truth.

    Attributes:
        error_m: of its position.
        sigma_m: claimed, along the largest axis of the position.
        squared: error in units of the covariance, position and angle, squared.
        squared_position: of the position alone.
    """

    error_m: float
    sigma_m: float
    squared: float
    squared_position: float

    @property
    def is_lie(self) -> bool:
        return self.error_m > LIE_M and self.sigma_m < LIE_SIGMA_M

    @property
    def is_inside(self) -> bool:
        """In its own ellipse?"""
        return self.squared_position <= ELLIPSE_95


def claim(pose: Array, covariance: Array, truth: Array) -> Claim:
    """Of a pose (3,) with its covariance (3, 3); errors of one that is none are infinite."""
    error = pose[:2] - truth[:2]
    spread = np.linalg.eigvalsh(covariance[:2, :2])[-1]
    squared = position = float("inf")
    if np.linalg.eigvalsh(covariance)[0] > 0:
        squared = mahalanobis(pose, covariance, truth)
        position = float(error @ np.linalg.solve(covariance[:2, :2], error))
    return Claim(float(np.hypot(*error)), float(np.sqrt(max(spread, 0.0))), squared, position)


def mahalanobis(pose: Array, covariance: Array, truth: Array) -> float:
    """Squared error of a pose (3,) in units of its covariance (3, 3)."""
    error = pose - truth
    error[2] = metrics.wrapped(error[2])
    return float(error @ np.linalg.solve(covariance, error))
