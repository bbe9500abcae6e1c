"""Made-up chi-squared of windows under each mistake, as the search for mistakes gets them."""

from __future__ import annotations

import numpy as np

from drslamd.slam.odometry.mounting import SCALES, SIDES, TRACKS
from drslamd.slam.relative_pose.mistakes.evidence import FITS
from drslamd.slam.relative_pose.mistakes.what_if import CASES, Case
from drslamd.slam.se2 import Array

FAR = 1e4
"""Chi-squared of what does not fit at all."""
FREEDOM = 100
"""Of all windows together."""
FIT = 0.9 * FITS * FREEDOM
"""Chi-squared of what fits them, noise being allowed for generously."""
GOOD = 0.9 * FITS * 30
"""Likewise, of one window of 33 measurements."""
AS_IT_IS = Case()
LEFT, RIGHT = Case(b=SIDES[0]), Case(b=SIDES[1])
TRACK, SCALE = Case(b=TRACKS[0]), Case(b=SCALES[0])
LITTLE = 0.01


def costs(known: dict[Case, float], rest: float = FAR) -> Array:
    """(cases,) in the order of `CASES`."""
    return np.array([known.get(case, rest) for case in CASES])
