"""What the banded solver answers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.optimizer.problem import Doubted, Freed
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class Solution:
    """Poses (k, 3) in the order of the problem, and how they were reached.

    Attributes:
        scatter: (pairs,) how many times the configured sigma ranges scatter.
        joint: (3 k, 3 k) covariance of x, y, theta in w of the k poses that were asked for.
        shares: (k, k) what is left of the covariance of each two of them in each other, and of each
            in w, with the noise that was seen (`pairs.narrowing`); of none where nothing is known.
        spread: sigmas of the calibration; bias_sigmas: (pairs,) how wrong biases may be, m.
        odometry_level: (m,) sigmas of the links of odometry over what was configured, as far as
            it was seen; feared_level: as far as it must be feared; late_level: of the last seconds.
        doubted: whose mountings were let go.
        freed: stretches along which wheels stood or spun.
        is_explained: is the model, with these levels, one of what was measured?
        is_as_modelled: is it the one that is configured?
        contradicted: (pairs,) whose ranges of late do not fit.
        blocked: (pairs,) between which sight was blocked.
    """

    poses: Array
    calibration: Calibration
    cost: float
    iterations: int
    converged: bool
    scatter: Array = field(default_factory=lambda: np.zeros(0))
    joint: Array = field(default_factory=lambda: np.zeros((0, 0)))
    shares: Array = field(default_factory=lambda: np.ones((0, 0)))
    spread: Calibration | None = None
    bias_sigmas: Array = field(default_factory=lambda: np.zeros(0))
    odometry_level: Array = field(default_factory=lambda: np.zeros(0))
    feared_level: Array = field(default_factory=lambda: np.zeros(0))
    late_level: Array = field(default_factory=lambda: np.zeros(0))
    is_explained: bool = True
    is_as_modelled: bool = True
    contradicted: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    blocked: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    doubted: Doubted = field(default_factory=lambda: Doubted.none(0))
    freed: tuple[Freed, ...] = ()
