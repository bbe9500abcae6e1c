"""Several minima of one small cost at once: a step towards each, and those that are apart."""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.se2 import Array

DAMPING = 1e-3
"""Share of the diagonal that is added to it."""
_LEAST = 1e-9
"""Added where nothing is known of an unknown."""


def gauss_newton_step(x: Array, normal: Array, gradient: Array, longest: float) -> Array:
    """One step of Gauss and Newton, damped and bounded, (m, u).

    Args:
        x: (m, u) where m searches are, u unknowns each.
        normal: (m, u, u) J' W J of the residuals there; gradient: (m, u) J' W e.
        longest: no unknown moves by more, in its own unit.
    """
    diagonal = np.einsum("mii->mi", normal)
    damped = normal + (DAMPING * diagonal + _LEAST)[:, :, None] * np.eye(x.shape[1])
    step = -np.linalg.solve(damped, gradient[..., None])[..., 0]
    size = np.abs(step).max(axis=1, keepdims=True)
    return np.asarray(x + step * np.minimum(1.0, longest / (size + 1e-12)))


def distinct_poses(x: Array, merge_m: float, merge_rad: float) -> Array:
    """Rows (m, 3), best first, that are not near a better one: both nearer and less turned."""
    kept: list[Array] = []
    for row in x:
        if not any(
            np.hypot(*(row - other)[:2]) < merge_m and abs(se2.wrap(row[2] - other[2])) < merge_rad
            for other in kept
        ):
            kept.append(row)
    return np.array(kept)
