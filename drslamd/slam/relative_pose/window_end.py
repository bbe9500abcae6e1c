"""Does the end of a window lie off the rest?

Near the end a burst of wrong ranges and odometry that has just failed look alike, and the pose is
that of the end: such a window names none. What odometry adds up bends the far part of a long
window away from an end that is right; so an end that lies off the middle of all is asked whether
it does so by more than the noise of the window has it, given all ranges before it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.relative_pose.gls import Refined
from drslamd.slam.relative_pose.range_fit import RangeFit
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.relative_pose.window_stack import middle
from drslamd.slam.se2 import Index

NEWEST = 3
"""So many last measurements are the end."""
OFF_SIGMAS = 2.0
"""Of a range: so far off the middle of all they are in the median, before anything is asked."""
SURPRISE = 3.0
"""Sigmas of what the noise of the window leaves open."""


def end_is_off(fit: RangeFit, noise: WindowNoise, refined: Refined) -> NDArray[np.bool_]:
    """(w,) of the windows that have minima, at the best of them; no where nothing fits at all."""
    best = refined.groups.starts
    of = refined.groups.of[best]
    e, counts = refined.e[best], noise.counts[of]
    newest = np.take_along_axis(e, counts[:, None] - 1 - np.arange(NEWEST), axis=1)
    newest = np.abs(newest - middle(e, counts)[:, None])
    is_off = np.sort(newest, axis=1)[:, NEWEST // 2] > OFF_SIGMAS * noise.sigmas(of)[:, 0]
    is_off &= np.isfinite(refined.minima.chi2[best])
    for k in np.flatnonzero(is_off).tolist():
        at = best[k : k + 1]
        is_off[k] = surprise(fit, noise, refined, at) > SURPRISE
    return np.asarray(is_off)


def surprise(fit: RangeFit, noise: WindowNoise, refined: Refined, at: Index) -> float:
    """Of the end at one minimum, in the median, in sigmas of what all before it leave open.

    Args:
        at: (1,) place of the minimum.
    """
    of, x = refined.groups.of[at], refined.minima.centred[at]
    u, rows = fit.rows(of).linear(x)
    n = int(noise.counts[of][0])
    e = rows[0, 4, :n]
    weights = noise.weights(of, rows[:, 4])
    weights[:, n - NEWEST : n] = 1.0
    lower = noise.covariance(of, u, x[:, 1], weights)[0, :n, :n]
    covariance = np.tril(lower) + np.tril(lower, -1).T
    old, new = slice(0, n - NEWEST), slice(n - NEWEST, n)
    gain = np.linalg.solve(covariance[old, old], covariance[old, new]).T
    left = covariance[new, new] - gain @ covariance[old, new]
    off = np.abs(e[new] - gain @ e[old]) / np.sqrt(np.diag(left))
    return float(np.median(off))
