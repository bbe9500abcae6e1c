"""What is believed of range biases before anything is measured.

The modules of one team resemble each other. The bias of a pair is that of the team plus what the
pair has of its own,

    bias_ij = team + own_ij.

All `own` together are of Student's distribution: while all pairs agree each is held tightly, and
where they differ all are held loosely. Its cost is -2 log of the density, without the constant:

    (dof + pairs) log(1 + sum own^2 / (dof spread^2))

`team` has Cauchy's cost, log(1 + (team / width)^2). Both have Gauss's tails beyond the sigma that
is configured: without them a bias that motion says little of runs off by metres after whatever else
is wrong.

How wrong a bias may be is another question than how strongly it is held. The peak of a heavy tail
is narrow, and most of what it holds is elsewhere: what windows claim rests on the variances of
these distributions (`sigmas`), and not on the curvatures of their costs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drslamd.slam.range_model import RangeModel
from drslamd.slam.se2 import Array

LEAST_CURVATURE = 0.1
"""Of a heavy tail over that of a square with the same pull: beyond some value the curvature is
negative, and a system must stay positive definite."""
WHOLE = -1.0
"""In its place: the second derivative as it is, for steps near a minimum."""
WEIGHT = 1.0
"""In its place: no less than that square, which no step overshoots, however far it starts."""
TINY = 1e-12
"""m^2; no bias is known so well."""
ROUNDS, SAME = 50, 1e-3
"""Of finding how much the pairs of a team differ, until it moves by less than a thousandth."""
REACH, POINTS = 8.0, 400
"""Gauss's tails are over after so many sigmas; steps of an integral that far."""


@dataclass(frozen=True)
class BiasPrior:
    """
    Attributes:
        sigma: as configured, m.
        spread: half width of what pairs have of their own, m.
        dof: degrees of freedom of its distribution.
        team: half width of what all pairs have in common, m.
        own_sigma: of what pairs have of their own, m, where claims rest on what was seen of it;
            beside it `sigma` holds as ever. Infinite where they do not.
    """

    sigma: float
    spread: float
    dof: float
    team: float
    own_sigma: float = math.inf

    @staticmethod
    def of(sigma: float, model: RangeModel) -> BiasPrior:
        """For a configured sigma, m, of the bias of a pair."""
        return BiasPrior(
            sigma=sigma,
            spread=model.spread_share * sigma,
            dof=model.spread_dof,
            team=model.team_share * sigma,
        )

    def cost(self, own: Array, team: float) -> float:
        """Of what pairs have of their own (pairs,), m, and of what is common, m."""
        squares = float(own @ own)
        student = (self.dof + len(own)) * np.log1p(squares / (self.dof * self.spread**2))
        cauchy = np.log1p((team / self.team) ** 2)
        return float(student + cauchy + (squares + team**2) / self.sigma**2)

    def own_pull(self, own: Array) -> Array:
        """(pairs,) half the derivative of the cost by what each pair has of its own, 1/m."""
        return np.asarray((self._student(own) + self.sigma**-2) * own)

    def own_curvature(self, own: Array, least: float = LEAST_CURVATURE) -> Array:
        """(pairs, pairs) half the second derivative, 1/m^2, kept positive definite.

        Args:
            least: see `LEAST_CURVATURE`.
        """
        squares = float(own @ own)
        bend = min(2 / self._scale(own), (1 - least) / max(squares, TINY))
        rounded = self._student(own) * (np.eye(len(own)) - bend * np.outer(own, own))
        return np.asarray(rounded + self.sigma**-2 * np.eye(len(own)))

    def team_pull(self, team: float) -> float:
        """Half the derivative of the cost by what is common."""
        return team * (1 / (self.team**2 + team**2) + self.sigma**-2)

    def team_curvature(self, team: float, least: float = LEAST_CURVATURE) -> float:
        """Half the second derivative, kept positive."""
        return float(cauchy_curvature(self.team, np.array([team]), least)[0]) + self.sigma**-2

    def sigmas(self, own: Array, told: Array) -> Array:
        """(pairs,) how wrong biases may be that were measured, m.

        What was measured of the other pairs tells what all have in common.

        Args:
            own, told: see `own_variance`.
        """
        varies = 1 / (1 / self.own_variance(own, told) + self.sigma**-2)
        of_team = told / (1 + told * varies)
        team = 1 / (1 / self.team_variance + of_team.sum() - of_team)
        return np.asarray(1 / np.sqrt(told + 1 / (varies + team)))

    def own_variance(self, own: Array, told: Array) -> float:
        """What a pair may have of its own, m^2, where nothing was measured of it.

        Student's distribution is Gauss's with a variance that is unknown, of 1 / chi-squared. What
        the pairs that were measured have of their own tells of it (`seen_variance`), and those that
        were not tell nothing.

        Args:
            own: (pairs,) m; told: (pairs,) the information with which it was measured, 1/m^2.
        """
        variance = self.dof * self.spread**2 / (self.dof - 2)
        for _ in range(ROUNDS):
            before = variance
            variance = self.seen_variance(own, 1 / (told + 1 / before))
            if abs(variance - before) < SAME * before:
                break
        return variance

    def seen_variance(self, own: Array, left: Array) -> float:
        """The mean of the variances that may be, m^2:

            (dof spread^2 + sum (own^2 + variance of own)) / (dof + pairs - 2).

        Args:
            own, left: (pairs,) what was seen of them, m, and the variance of that, m^2.
        """
        squares = self.dof * self.spread**2 + float(np.sum(own**2 + left))
        return squares / (self.dof + len(own) - 2)

    @property
    def team_variance(self) -> float:
        """What all pairs may have in common, m^2, before anything is measured."""
        return _variance_with_tails(self.team, self.sigma)

    def _scale(self, own: Array) -> float:
        return self.dof * self.spread**2 + float(own @ own)

    def _student(self, own: Array) -> float:
        return (self.dof + len(own)) / self._scale(own)


def cauchy_curvature(width: Array | float, values: Array, least: float = LEAST_CURVATURE) -> Array:
    """(k,) half the second derivative of log(1 + (value / width)^2), kept positive."""
    squares = (values / width) ** 2
    ratio = np.maximum((1 - squares) / (1 + squares), least)
    return np.asarray(ratio / (1 + squares) / np.square(width))


@lru_cache(maxsize=8)
def _variance_with_tails(width: float, sigma: float) -> float:
    """Of Cauchy's cost of that half width with Gauss's tails of that sigma."""
    # with values = width sinh(u) the density of Cauchy's cost is even in u
    u = np.linspace(0.0, np.arcsinh(REACH * sigma / width), POINTS)
    squares = (width * np.sinh(u)) ** 2
    tails = np.exp(-squares / (2 * sigma**2))
    tails[0] /= 2
    return float(tails @ squares / tails.sum())
