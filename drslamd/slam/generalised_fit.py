"""The last word on a few poses: generalised least squares under the noise of the whole window."""

from __future__ import annotations

import numpy as np
from scipy.linalg import get_lapack_funcs

from drslamd.slam.range_fit import PRIOR, ROBUST_SIGMAS, RangeFit, stepped
from drslamd.slam.se2 import Array
from drslamd.slam.window_noise import WindowNoise

ROUNDS, STEPS = 3, 4
"""The covariance hardly changes on the way: it is made anew after so many steps at most."""
SETTLED = 1e-3
"""A step below this (m, rad) is the last one."""
SAME_NOISE = 0.1
"""Nor does it change when a pose has moved by less than this (m, rad)."""
LONGEST = 0.5
"""m, rad: what one step may do."""

_factorise, _solve = get_lapack_funcs(("potrf", "potrs"), dtype=np.float64)


def judge(fit: RangeFit, noise: WindowNoise, centred: Array) -> tuple[Array, Array, Array]:
    """Poses (k, 2), centred (see `RangeFit`), where the noise of the window puts them.

    Returns:
        Poses (k, 2), their covariances (k, 3, 3) in parts of a step, and chi-squared (k,);
        infinite where the covariance of the window is not one, which absurd odometry can bring
        about.
    """
    x = centred
    for _ in range(ROUNDS):
        u, rows = fit.linear(x)
        factors, sound = _factors(noise.covariance(u, x[:, 1], _weights(rows[:, 4], noise.sigma)))
        moved = np.zeros(len(x))
        for _ in range(STEPS):
            normal = np.stack([r @ _solve(f, r.T)[0] for r, f in zip(rows, factors, strict=True)])
            information = normal[:, :3, :3] + PRIOR * np.eye(3)
            step = -np.linalg.solve(information, normal[:, :3, 4:])[..., 0]
            size = np.abs(step).max(axis=1)
            x = stepped(x, step * np.minimum(1.0, LONGEST / (size + 1e-12))[:, None])
            moved += size
            if (size < SETTLED).all():
                break
            rows = fit.linear(x)[1]
        if (moved < SAME_NOISE).all():
            break
    chi2 = normal[:, 4, 4] + (normal[:, 4, :3] * step).sum(axis=1)
    return x, np.linalg.inv(information), np.where(sound, chi2, np.inf)


def _weights(e: Array, sigma: float) -> Array:
    """(k, n): ranges lose weight that are far from the middle of all."""
    n = e.shape[1]
    middle = np.sort(e, axis=1)[:, (n - 1) // 2 : n // 2 + 1].mean(axis=1)
    beyond = ROBUST_SIGMAS * sigma
    return np.asarray((beyond / np.maximum(np.abs(e - middle[:, None]), beyond)) ** 2)


def _factors(covariance: Array) -> tuple[list[Array], Array]:
    """Cholesky factors out of lower triangles, and which of them there are."""
    # LAPACK reads columns: what is below the diagonal here is above it there
    found = [_factorise(c.T, overwrite_a=True, clean=False) for c in covariance]
    sound = np.array([info == 0 for _, info in found])
    return [f if ok else np.eye(len(f)) for (f, _), ok in zip(found, sound, strict=True)], sound
