"""Where a segment of odometry lies, by ranges to peers whose places are known.

    r_i = | p_i - (c + R(theta) q_i) | + bias of the peer

Module 1's problem with several peers at once and a place to begin from. All minima are looked for
and judged under the full noise of the ranges; while two cannot be told apart none is named. How
much ranges scatter is known badly soon after a start, so those of a placing have a say in it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import RangeModel
from drslamd.slam.relative_pose.solver import EXCLUDED_CHI2
from drslamd.slam.relocation.minima import distinct_poses, gauss_newton_step
from drslamd.slam.relocation.sightings import Sightings
from drslamd.slam.se2 import Array

HEADINGS = 12
"""Of starts at each place: a basin is wider than 30 degrees unless the way is long."""
RINGS = (0.0, 0.5, 1.0)
"""Starts lie on these shares of how far the robot may have come, six on each ring."""
AROUND = 24
"""Starts around a peer, where nothing says on which side of it the robot is."""
FIRST_STEPS, STEPS = 4, 16
CARRIED = 32
"""Starts that are carried on after the first steps."""
LONGEST = 1.0
"""m, rad: what one step may do."""
MERGE_M, MERGE_RAD = 0.2, 0.15
"""Minima that are nearer are one."""
CANDIDATES = 6
POOR_FIT = 3.0
"""Chi-squared per range beyond which the model does not explain them."""
MOST_OFF = 0.25
"""Share of ranges that may be off by more than `RangeModel.cauchy_sigmas`: bursts, and no more."""
MAX_SIGMA_M, MAX_SIGMA_RAD = 0.35, np.radians(8.0)
"""What is vaguer is not said yet."""
KNOWN = 12
"""So many independent ranges have told how much they scatter: half a minute of one a second, which
share errors with those before, and what was configured (`calibration.range_scatter`)."""
LEAST = 0.7
"""Times the sigma that was known: errors that last longer than a placing do not show in it."""
FEWEST = 10
"""Ranges."""
BEATEN_CHI2 = 12.0
"""A minimum that ranges alone make so much worse than the best (2 log-likelihood, 400 to 1) is
none. Where the robot was may be wrong in another way than was thought: with its help it takes
`EXCLUDED_CHI2` ..."""
LEAST_CHI2 = 3.0
"""... and so much must be of ranges: a cloud may have gone on on the wrong side of its peers, and
then is as sure of it."""


class Prior(NamedTuple):
    """Where the robot was when the segment began: (2,) in w, (2, 2), and how far from there the
    search must look, m; or does it look wherever ranges allow?

    It is a witness among others: what it says against a minimum grows like a logarithm.
    """

    place: Array
    covariance: Array
    reach_m: float
    is_anywhere: bool = False


@dataclass(frozen=True)
class WayUnder:
    """The odometry under k sightings.

    Attributes:
        antenna: (k, 2) in the odometry frame; begin: (2,) the body's first place there.
        way_m: (k,) driven since.
        noise: of this odometry.
    """

    antenna: Array
    begin: Array
    way_m: Array
    noise: OdometryNoise


class Placed(NamedTuple):
    """w_T_o (3,) of the odometry frame, and (3, 3) of x, y, theta of the robot's place at `at` in
    it, where that is known best, if peers are where they are thought to be; and by how much each of
    k sightings moves these if the peer was elsewhere, (3, k, 2)."""

    w_T_o: Array
    covariance: Array
    at: Array
    by_peers: Array


def place(seen: Sightings, stretch: WayUnder, prior: Prior, model: RangeModel) -> Placed | str:
    """The only pose that the sightings allow, or why none is named."""
    if len(seen) < FEWEST:
        return "too few ranges"
    problem = _Problem(seen, stretch, prior, model)
    minima = problem.minima()
    first, *_ = problem.all_judged(minima)
    if not first.chi2 <= POOR_FIT * len(seen) or problem.share_off(first.x) > MOST_OFF:
        return "ranges and odometry disagree"
    problem = problem.as_it_scatters(first)
    first, *others = problem.all_judged(minima)
    if problem.share_off(first.x) > MOST_OFF:
        return "ranges and odometry disagree"
    rivals = [one for one in others if not first.beats(one)]
    if len(distinct_poses(np.array([one.x for one in (first, *rivals)]), MERGE_M, MERGE_RAD)) > 1:
        return "ambiguous"
    sigma_m = np.sqrt(np.linalg.eigvalsh(first.covariance[:2, :2])[-1])
    if sigma_m > MAX_SIGMA_M or np.sqrt(first.covariance[2, 2]) > MAX_SIGMA_RAD:
        return "not enough motion"
    return problem.placed(first)


def scatter_about(chi2: float, ranges: int) -> float:
    """True over known sigma of so many ranges about a pose; never more than 1, for then it may as
    well be the wrong pose, and no less than `LEAST`."""
    return float(np.clip(np.sqrt((KNOWN + chi2) / (KNOWN + ranges - 3)), LEAST, 1.0))


class _Judged(NamedTuple):
    """A minimum (3,) with its covariance (3, 3) and chi-squared; `before` is what where the robot
    was adds to that, and `by_peers` (3, k, 2) see `Placed`."""

    x: Array
    covariance: Array
    by_peers: Array
    chi2: float
    before: float

    def beats(self, other: _Judged) -> bool:
        """Is the other one so much less likely that it is none?"""
        apart = other.chi2 - self.chi2
        by_ranges = apart - (other.before - self.before)
        is_excluded = apart >= EXCLUDED_CHI2 and by_ranges >= LEAST_CHI2
        return is_excluded or min(apart, by_ranges) >= BEATEN_CHI2


class _Problem:
    """Unknown is x: the place c of the middle of the antenna's way, and the heading theta."""

    def __init__(self, seen: Sightings, stretch: WayUnder, prior: Prior, model: RangeModel) -> None:
        self._seen, self._stretch, self._prior, self._model = seen, stretch, prior, model
        self._middle = stretch.antenna.mean(axis=0)
        self._q = _complex(stretch.antenna - self._middle)
        self._p = _complex(seen.place)
        self._begin = complex(*(stretch.begin - self._middle))
        self._wide = np.hypot(seen.sigma_m, seen.bias_m)
        self._root = np.linalg.inv(np.linalg.cholesky(prior.covariance + 1e-4 * np.eye(2)))

    def minima(self) -> Array:
        """(m, 3) those of the cost, the lowest first, and no more than can be judged."""
        x = self.descended(self.starts(), FIRST_STEPS)
        best = np.argsort(self.cost(x), kind="stable")[:CARRIED]
        x = self.descended(x[best], STEPS)
        x = x[np.argsort(self.cost(x), kind="stable")]
        return distinct_poses(x, MERGE_M, MERGE_RAD)[:CANDIDATES]

    def all_judged(self, minima: Array) -> list[_Judged]:
        """The likeliest first."""
        return sorted((self.judged(row) for row in minima), key=lambda one: one.chi2)

    def as_it_scatters(self, best: _Judged) -> _Problem:
        """The same with ranges that scatter as little as they do about the best minimum: the
        posterior mean of a variance of which something was known before."""
        scatter = scatter_about(best.chi2 - best.before, len(self._seen))
        seen = replace(self._seen, sigma_m=scatter * self._seen.sigma_m)
        return _Problem(seen, self._stretch, self._prior, self._model)

    def starts(self) -> Array:
        """(m, 3)."""
        headings = np.arange(HEADINGS) * 2 * np.pi / HEADINGS
        if self._prior.is_anywhere:
            at = np.repeat(self._in_sight(), HEADINGS)
            return np.column_stack([at.real, at.imag, np.tile(headings, AROUND)])
        angles = np.arange(6) * np.pi / 3
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        places = [
            self._prior.place + share * self._prior.reach_m * ring[: 6 if share else 1]
            for share in RINGS
        ]
        at = np.repeat(np.concatenate(places), HEADINGS, axis=0)
        theta = np.tile(headings, len(at) // HEADINGS)
        middle = _complex(at) - np.exp(1j * theta) * self._begin
        return np.column_stack([middle.real, middle.imag, theta])

    def _in_sight(self) -> Array:
        """(AROUND,) around the nearest peer, as far away as the middle one of its ranges: one of
        them is where the robot is."""
        seen = self._seen
        near = seen.peer[np.argmin(seen.range_m)]
        its = np.flatnonzero(seen.peer == near)
        middle = its[len(its) // 2]
        angle = np.arange(AROUND) * 2 * np.pi / AROUND
        return np.asarray(self._p[middle] + seen.range_m[middle] * np.exp(1j * angle))

    def _linear(self, x: Array) -> tuple[Array, Array]:
        """Residuals (m, k) and their derivatives (m, k, 3)."""
        turn = np.exp(1j * x[:, 2])[:, None]
        arm = turn * self._q
        sight = self._p - (x[:, 0] + 1j * x[:, 1])[:, None] - arm
        distance = np.maximum(np.abs(sight), 1e-6)
        u = sight / distance
        by_turn = -(np.conj(u) * 1j * arm).real
        return distance - self._seen.range_m, np.stack([-u.real, -u.imag, by_turn], axis=-1)

    def _before(self, x: Array) -> tuple[Array, Array]:
        """The whitened distance (m, 2) to where the robot was, and its derivatives (m, 2, 3)."""
        arm = np.exp(1j * x[:, 2]) * self._begin
        off = np.stack([x[:, 0] + arm.real, x[:, 1] + arm.imag], axis=-1) - self._prior.place
        j = np.zeros((len(x), 2, 3))
        j[:, 0, 0] = j[:, 1, 1] = 1.0
        j[:, 0, 2], j[:, 1, 2] = -arm.imag, arm.real
        return off @ self._root.T, np.einsum("ij,mjk->mik", self._root, j)

    def cost(self, x: Array) -> Array:
        """(m,) 2 log-likelihood, robust, as if all ranges were independent."""
        e, _ = self._linear(x)
        before, _ = self._before(x)
        of_ranges = self._robust((e / self._wide) ** 2).sum(axis=1)
        return np.asarray(of_ranges + self._robust((before**2).sum(axis=1)))

    def _robust(self, squares: Array) -> Array:
        c2 = self._model.cauchy_sigmas**2
        return np.asarray(c2 * np.log1p(squares / c2))

    def _weight(self, squares: Array) -> Array:
        return np.asarray(1 / (1 + squares / self._model.cauchy_sigmas**2))

    def descended(self, x: Array, steps: int) -> Array:
        """Gauss-Newton's steps from (m, 3), damped and bounded."""
        for _ in range(steps):
            e, j = self._linear(x)
            before, by = self._before(x)
            w = self._weight((e / self._wide) ** 2) / self._wide**2
            v = self._weight((before**2).sum(axis=1))[:, None]
            normal = np.einsum("mki,mk,mkj->mij", j, w, j)
            normal = normal + np.einsum("mki,mkj->mij", by * v[..., None], by)
            g = np.einsum("mki,mk->mi", j, w * e) + np.einsum("mki,mk->mi", by, v * before)
            x = gauss_newton_step(x, normal, g, LONGEST)
        return x

    def judged(self, x: Array) -> _Judged:
        """A minimum (3,) under the noise of all ranges together."""
        for _ in range(3):
            e, j = (part[0] for part in self._linear(x[None]))
            before, by = (part[0] for part in self._before(x[None]))
            covariance = self._noise(e, j, x)
            weighted = np.linalg.solve(covariance, np.column_stack([j, e]))
            v = float(self._weight(before @ before))
            normal = j.T @ weighted[:, :3] + v * by.T @ by
            spread = np.linalg.inv(normal + 1e-9 * np.eye(3))
            step = -spread @ (j.T @ weighted[:, 3] + v * by.T @ before)
            x = x + step * min(1.0, LONGEST / (float(np.abs(step).max()) + 1e-12))
        added = float(self._robust(before @ before))
        x[2] = float(se2.wrap(x[2]))
        by_peers = (spread @ weighted[:, :3].T)[:, :, None] * j[:, :2]
        return _Judged(x, spread, by_peers, float(e @ weighted[:, 3]) + added, added)

    def _noise(self, e: Array, j: Array, x: Array) -> Array:
        """(k, k) of the residuals: ranges share their errors with those before, with all of the
        same peer, and all of them the scale of the odometry."""
        seen, noise, model = self._seen, self._stretch.noise, self._model
        seconds = (seen.utime - seen.utime[0]) / 1e6
        same = seen.peer[:, None] == seen.peer
        covariance = model.correlated_covariance(seconds, 1.0)
        covariance = covariance * np.outer(seen.sigma_m, seen.sigma_m)
        covariance = np.where(same, covariance + np.outer(seen.bias_m, seen.bias_m), 0.0)
        arm = np.exp(1j * x[2]) * self._q
        by_scale = (np.conj(_complex(j[:, :2])) * arm).real
        covariance += noise.scale**2 * np.outer(by_scale, by_scale)
        way = np.abs(self._stretch.way_m - self._stretch.way_m.mean())
        drift = noise.translation_per_sqrt_m**2 * way + noise.yaw_rad_per_sqrt_m**2 * way**3 / 3
        beyond = np.maximum(e**2 - (model.cauchy_sigmas * self._wide) ** 2, 0.0)
        return np.asarray(covariance + np.diag(drift + beyond))

    def share_off(self, x: Array) -> float:
        """Share of ranges that (3,) does not explain."""
        e, _ = self._linear(x[None])
        return float(np.mean(np.abs(e[0]) > self._model.cauchy_sigmas * self._wide))

    def placed(self, found: _Judged) -> Placed:
        c, theta = found.x[:2], found.x[2]
        xy = c - se2.rotate(theta, self._middle)
        return Placed(np.append(xy, theta), found.covariance, self._middle, found.by_peers)


def _complex(points: Array) -> Array:
    return np.asarray(points[..., 0] + 1j * points[..., 1])
