"""The last word on a few poses: generalised least squares under the noise of the whole window."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import get_lapack_funcs

from drslamd.slam.relative_pose.descent import WEAK_PRIOR
from drslamd.slam.relative_pose.range_fit import Minima, RangeFit, stepped
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.se2 import Array

MOST_ITERATIONS = 12
SAME_SIGMAS = 0.5
"""The covariance stays as it is while no residual has moved by more sigmas ..."""
SAME_SIGHT = 0.1
"""... and no line of sight has turned by more, rad."""
SETTLED = 1e-3
"""A step below this, m and rad, is the last one ..."""
SETTLED_CHI2 = 1e-2
"""... and so is one that promises less (2 log-likelihood)."""
LONGEST = 0.5
"""m, rad: what one step may do."""

_factorise, _solve = get_lapack_funcs(("potrf", "potrs"), dtype=np.float64)


class Refined(NamedTuple):
    """Minima under the noise of the whole window, best first.

    Attributes:
        minima: chi-squared is infinite where the covariance of the window is not one, which absurd
            odometry can bring about.
        e: (k, n) predicted minus measured ranges.
    """

    minima: Minima
    e: Array


def refine(
    fit: RangeFit, noise: WindowNoise, centred: Array, wants_vague: bool = False
) -> Refined | None:
    """Where the noise of the window puts some minima (k, 2).

    None where it leaves one vague, unless that is wanted too.
    """
    x = centred
    made_at: tuple[Array, Array] | None = None
    for n in range(MOST_ITERATIONS):
        u, rows = fit.linear(x)
        e = rows[:, 4]
        if made_at is None or not _same(e, u, made_at, noise.sigma):
            factors, sound = _factors(noise.covariance(u, x[:, 1], _weights(e, noise)))
            made_at = e, u
        weighted = np.array([_solve(f, r.T)[0] for r, f in zip(rows, factors, strict=True)])
        normal = rows @ weighted
        covariance = np.linalg.inv(normal[:, :3, :3] + WEAK_PRIOR * np.eye(3))
        step = -(covariance @ normal[:, :3, 4:])[..., 0]
        promise = -(normal[:, 4, :3] * step).sum(axis=1)
        minima = Minima(x, covariance, np.where(sound, normal[:, 4, 4] - promise, np.inf))
        if n == 0 and not wants_vague and fit.is_vague(_as_they_scatter(minima, weighted, noise)):
            return None
        size = np.abs(step).max(axis=1)
        x = stepped(x, step * np.minimum(1.0, LONGEST / (size + 1e-12))[:, None])
        if ((size < SETTLED) | (promise < SETTLED_CHI2)).all():
            break
    minima = _as_they_scatter(minima._replace(centred=x), weighted, noise)
    order = np.argsort(minima.chi2, kind="stable")
    return Refined(Minima(*(values[order] for values in minima)), e[order])


def _as_they_scatter(minima: Minima, weighted: Array, noise: WindowNoise) -> Minima:
    """Weights are those of what must be allowed for, the covariance that of what is known."""
    gain = minima.covariance @ weighted[:, :, :3].transpose(0, 2, 1)
    return minima._replace(covariance=minima.covariance + noise.excess(gain))


def _same(e: Array, u: Array, before: tuple[Array, Array], sigma: float) -> bool:
    same = np.abs(e - before[0]) < SAME_SIGMAS * sigma
    same &= np.abs(u - before[1]) < SAME_SIGHT
    return bool(same.all())


def middle(values: Array) -> Array:
    """Median along the last axis."""
    n = values.shape[-1]
    ordered = np.sort(values, axis=-1)
    return np.asarray((ordered[..., (n - 1) // 2] + ordered[..., n // 2]) / 2)


def _weights(e: Array, noise: WindowNoise) -> Array:
    """(k, n): ranges lose weight that are far from the middle of all."""
    beyond = noise.huber_sigmas * noise.sigma
    return np.asarray((beyond / np.maximum(np.abs(e - middle(e)[:, None]), beyond)) ** 2)


def _factors(covariance: Array) -> tuple[list[Array], Array]:
    """Cholesky factors out of lower triangles, and which of them there are."""
    # LAPACK reads columns: what is below the diagonal here is above it there
    found = [_factorise(c.T, overwrite_a=True, clean=False) for c in covariance]
    sound = np.array([info == 0 for _, info in found])
    return [f if ok else np.eye(len(f)) for (f, _), ok in zip(found, sound, strict=True)], sound
