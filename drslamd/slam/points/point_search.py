"""Where something stands, by ranges to it from a robot that drives past.

    r_i = | x - p_i | + bias

Two unknowns that count. All minima are looked for, and judged under the noise of the whole window:
ranges share a bias and a slow part, odometry bends all that lies behind. While the robot drives
straight on there are two, left and right of its way; none is named before one alone is left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from drslamd.slam import range_model, se2
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import RangeModel, RangeNoise
from drslamd.slam.relative_pose.solver import EXCLUDED_CHI2
from drslamd.slam.relative_pose.window_noise import moments, odometry_covariance, way_twists
from drslamd.slam.relocation.minima import gauss_newton_step
from drslamd.slam.se2 import Array

Row = TypeVar("Row")

STARTS = 24
"""Around the robot's place in the middle of its way, as far away as the range there."""
STEPS, JUDGED_STEPS = 20, 6
LONGEST_M = 2.0
"""What one step may do."""
MERGE_M = 0.25
"""Minima that are nearer are one."""
CANDIDATES = 6
FEWEST = 10
"""Ranges."""
POOR_FIT = 2.0
"""Chi-squared per range beyond which the model does not explain them: what is heard does not stand,
or odometry is worse than configured."""
MOST_OFF = 0.25
"""Share of ranges that may be off by more than `RangeModel.cauchy_sigmas`: bursts, and no more."""
MAX_SIGMA_M = 0.4
"""What is vaguer is not said yet."""


@dataclass(frozen=True)
class Passing:
    """k ranges on the way past something that stands, oldest first.

    Attributes:
        t: (k,) s before now.
        range_m: (k,) m; doubt_m: (k,) what a weak first path adds to their sigmas.
        poses: (k, 3) of the body, seen from where it is at the end of the way.
        antenna: (2,) in the body frame, m.
    """

    t: Array
    range_m: Array
    doubt_m: Array
    poses: Array
    antenna: Array

    def __len__(self) -> int:
        return len(self.t)


class PlaceCandidate(NamedTuple):
    """A place (2,) in the body frame at the end of the way, its covariance (2, 2), and what the
    ranges cost there."""

    place: Array
    covariance: Array
    chi2: float

    @property
    def sigma_m(self) -> float:
        """Along the longer axis."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance)[-1]))


class PlaceFound(NamedTuple):
    """All places that the ranges allow, best first, and why none is named, "" where one is."""

    candidates: tuple[PlaceCandidate, ...]
    verdict: str


def search(
    seen: Passing, noise: OdometryNoise, ranges: RangeNoise, model: RangeModel
) -> PlaceFound:
    """Where it may stand."""
    if len(seen) < FEWEST:
        return PlaceFound((), "too few ranges")
    problem = _Problem(seen, noise, ranges, model)
    x = problem.descended(problem.starts())
    x = x[np.argsort(problem.cost(x), kind="stable")]
    judged = [problem.judged(row[:2]) for row in _distinct(x, _place)[:CANDIDATES]]
    judged = _distinct(sorted(judged, key=lambda one: one.chi2), lambda one: one.place)
    first = judged[0]
    is_poor = not first.chi2 <= POOR_FIT * len(seen) or problem.share_off(first.place) > MOST_OFF
    if is_poor:
        return PlaceFound((), "it moves, or ranges and odometry disagree")
    # a burst that is taken for a slow error can speak for a wrong place, but not in both costs
    robust = _place(problem.descended(np.append(first.place, 0.0)[None])[0])
    if np.hypot(*(robust - x[0, :2])) > MERGE_M:
        return PlaceFound(tuple(judged[:2]), "ambiguous")
    left = tuple(one for one in judged if one.chi2 < first.chi2 + EXCLUDED_CHI2)
    if len(left) > 1:
        return PlaceFound(left, "ambiguous")
    return PlaceFound(left, "" if first.sigma_m <= MAX_SIGMA_M else "not enough motion")


def _place(row: Array) -> Array:
    return np.asarray(row[:2])


class _Problem:
    """Unknown are the place, and for a start the bias."""

    def __init__(
        self, seen: Passing, noise: OdometryNoise, ranges: RangeNoise, model: RangeModel
    ) -> None:
        self._seen, self._bias, self._model = seen, ranges.bias_sigma, model
        self._points = se2.transform(seen.poses, seen.antenna) @ [1, 1j]
        self._sigma = np.hypot(ranges.sigma, seen.doubt_m)
        self._all = np.array([len(seen)])
        self._twists = way_twists(seen.poses[None], (noise,), self._all, model.antenna_sigma_m)
        sigma, bias_sigma = ranges.sigma, ranges.bias_sigma
        self._of_ranges = model.covariance(seen.t, seen.range_m, sigma, bias_sigma)
        self._of_ranges += np.diag(seen.doubt_m**2)

    def starts(self) -> Array:
        """(m, 3) places and biases."""
        middle = len(self._seen) // 2
        # (a start on a straight way would stay there, between the two places)
        angle = (np.arange(STARTS) + 0.5) * 2 * np.pi / STARTS
        at = self._points[middle] + self._seen.range_m[middle] * np.exp(1j * angle)
        return np.column_stack([at.real, at.imag, np.zeros(STARTS)])

    def _errors(self, x: Array) -> tuple[Array, Array]:
        """(m, k) residuals and unit lines of sight of places (m, 2)."""
        sight = (x[:, :2] @ [1, 1j])[:, None] - self._points
        return range_model.residuals(sight, self._seen.range_m)

    def cost(self, x: Array) -> Array:
        """(m,) robust, as if all ranges were independent."""
        e, _ = self._errors(x)
        c2 = self._model.cauchy_sigmas**2
        squares = ((e + x[:, 2:]) / self._sigma) ** 2
        return np.asarray(c2 * np.log1p(squares / c2).sum(axis=1) + (x[:, 2] / self._bias) ** 2)

    def descended(self, x: Array) -> Array:
        """Gauss-Newton's steps from (m, 3), damped and bounded."""
        for _ in range(STEPS):
            e, u = self._errors(x)
            e = e + x[:, 2:]
            c2 = self._model.cauchy_sigmas**2
            w = 1 / (1 + (e / self._sigma) ** 2 / c2) / self._sigma**2
            j = np.stack([u.real, u.imag, np.ones_like(e)], axis=-1)
            normal = np.einsum("mki,mk,mkj->mij", j, w, j)
            normal[:, 2, 2] += self._bias**-2
            g = np.einsum("mki,mk->mi", j, w * e)
            g[:, 2] += x[:, 2] / self._bias**2
            x = gauss_newton_step(x, normal, g, LONGEST_M)
        return x

    def judged(self, place: Array) -> PlaceCandidate:
        """A minimum (2,) under the noise of all ranges together."""
        for _ in range(JUDGED_STEPS):
            e, u = (part[0] for part in self._errors(place[None]))
            j = np.stack([u.real, u.imag], axis=-1)
            weighted = np.linalg.solve(self._noise(e, u), np.column_stack([j, e]))
            spread = np.linalg.inv(j.T @ weighted[:, :2] + 1e-6 * np.eye(2))
            step = -spread @ (j.T @ weighted[:, 2])
            place = place + step * min(1.0, LONGEST_M / (float(np.abs(step).max()) + 1e-12))
        return PlaceCandidate(place, spread, float(e @ weighted[:, 2]))

    def _noise(self, e: Array, u: Array) -> Array:
        """(k, k) of the residuals."""
        moment = moments(self._points[None], u[None, None])
        lower = odometry_covariance(self._twists[None], moment, self._all)[0]
        around = e - np.median(e)
        beyond = np.maximum(around**2 - (self._model.cauchy_sigmas * self._sigma) ** 2, 0.0)
        both = np.tril(lower) + np.tril(lower, -1).T
        return np.asarray(both + self._of_ranges + np.diag(beyond))

    def share_off(self, place: Array) -> float:
        """Share of ranges that a place does not explain, whatever their bias."""
        e, _ = self._errors(place[None])
        off = np.abs(e[0] - np.median(e[0])) > self._model.cauchy_sigmas * self._sigma
        return float(np.mean(off))


def _distinct(rows: Iterable[Row], at: Callable[[Row], Array]) -> list[Row]:
    """Those, best first, that are not near a better one."""
    kept: list[Row] = []
    for row in rows:
        if all(np.hypot(*(at(row) - at(other))) >= MERGE_M for other in kept):
            kept.append(row)
    return kept
