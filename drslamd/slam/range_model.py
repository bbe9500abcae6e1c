"""The model of a range: what a UWB module measures, and how wrong that is.

    r = d + bias_ij + a exp(-d / L) + noise,     d = |p_j + R_j q_j - p_i - R_i q_i|

p, R are the poses of both robots and q their antennas. Each pair has its bias. Receivers misjudge
strong signals, all modules of one kind alike, so short ranges have a bias a exp(-d / L) that is one
for the whole team. It goes by the distance and not by what was measured: a shape that errs with the
very noise it is fitted to comes out too low. The noise has a white and a slow part, more of it at
short range, and far more where the first path is blocked. Modules 1, 2 and 3, the paper's solver
and the calibration all take these numbers from here.

`RangeModel` holds the constants; the defaults are those of LinkTrack modules.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.se2 import Array

LEAST_DISTANCE_M = 1e-6
"""Points nearer than this have no line of sight."""
NEAR_ROUNDS = 2
"""From a range to its distance; a bias of 0.3 m changes by a tenth of what the distance does."""


@dataclass(frozen=True)
class RangeNoise:
    """Sigmas of a range, m.

    `sigma` is what must be allowed for in any room and weighs ranges against odometry. Where more
    is known, ranges scatter by `scatter` times as much, and that is what a pose is as wrong by.

    Attributes:
        sigma: around the bias.
        bias_sigma: of the bias of a pair, where the teams' likeness is believed.
        bias_beyond: what is unknown of it besides; a pose is as wrong as both make it.
        scatter: true over allowed sigma.
    """

    sigma: float
    bias_sigma: float
    scatter: float = 1.0
    bias_beyond: float = 0.0


@dataclass(frozen=True)
class RangeModel:
    """The constants of the model.

    Attributes:
        slow_share: share of the sigma that is slow; the rest is white.
        slow_s: correlation time of the slow part (0.7 at 1 s, 0.45 at 2 s in recordings).
        near_reach_m: L; at this range a third of the near-range bias is left. The modules of the
            MURP recordings have -0.25 m below 1 m, -0.14 m at 2 to 4 m and -0.06 m beyond 6 m;
            Decawave's note APS011 prints such a curve over received power.
        near_bias_sigma_m: of a. Makers correct most of it; what they leave is as large as other
            things that move a bias (`least_bias_m`). Its prior is Gauss's: with heavier tails it
            and the biases of pairs trade metres where ranges vary little.
        near_sigma_m: what the near-range bias of one pair has beyond that of the team, at range 0.
            In the MURP recordings a range of below 1 m is 0.11 m shorter than one of 2 to 4 m, one
            of 1 to 2 m 0.05 m.
        near_sigma_reach_m: how it fades with the range.
        blocked_sigma_m: added where the first path is blocked; such ranges are 0.3 to 1 m too long.
        doubt_db: from likely line of sight, 6 dB, to likely none, 10 dB (LinkTrack manual 7.2).
        least_bias_m: biases move by so much with distance and bearing.
        spread_share: the biases of one team's modules resemble each other. What a pair has beyond
            that of the team is of Student's distribution, so much narrower than the sigma that is
            configured for a bias ...
        spread_dof: ... of so many degrees of freedom, all pairs together: where one pair is far
            off the others may be.
        team_share: what all pairs have in common is of Cauchy's distribution, so much narrower:
            most makers calibrate to centimetres, some not at all.
        antenna_sigma_m: biases move with the bearing by 4 to 10 cm, which is as if ranges were not
            measured from the antenna but from a point beside it.
        huber_sigmas: of module 1; beyond it a range loses weight (bursts are 0.3 m and more).
        cauchy_sigmas: of module 3; a burst of 0.5 m weighs 1/50 of a good range.
    """

    slow_share: float = 0.8
    slow_s: float = 2.5
    near_reach_m: float = 3.0
    near_bias_sigma_m: float = 0.05
    near_sigma_m: float = 0.20
    near_sigma_reach_m: float = 1.5
    blocked_sigma_m: float = 0.5
    doubt_db: float = 4.0
    least_bias_m: float = 0.05
    spread_share: float = 0.27
    spread_dof: float = 3.0
    team_share: float = 0.07
    antenna_sigma_m: float = 0.03
    huber_sigmas: float = 2.5
    cauchy_sigmas: float = 2.5

    def correlated_ratio(self, period_s: float) -> float:
        """How many times more wrong many ranges are together, one every `period_s`, than if each
        had its own error.

        The variance of a mean of values with a slow part is larger by the sum of its correlations.
        """
        keep = float(np.exp(-period_s / self.slow_s))
        return float(np.sqrt(1 + 2 * self.slow_share**2 * keep / (1 - keep)))

    def near_range_shape(self, distances: Array) -> Array:
        """(n,) exp(-d / L): how much of the near-range bias is in ranges over (n,) m."""
        return np.asarray(np.exp(-np.maximum(distances, 0.0) / self.near_reach_m))

    def near_range_bias(self, ranges: Array, near_bias_m: float) -> Array:
        """(n,) m: what a near-range bias that is known adds to ranges (n,) m without other biases.

        A range lies as far from its distance as the bias at that distance says, which two rounds
        find to a hundredth of what one would be off by.
        """
        near = near_bias_m * self.near_range_shape(ranges)
        for _ in range(NEAR_ROUNDS):
            near = near_bias_m * self.near_range_shape(ranges - near)
        return np.asarray(near)

    def near_range_sigma(self, ranges: Array | float) -> Array:
        """(n,) sigma, m, of what a pair does at short range and not elsewhere."""
        return np.asarray(
            self.near_sigma_m * np.exp(-np.maximum(ranges, 0.0) / self.near_sigma_reach_m)
        )

    def blocked_sigma(self, gap_db: float, nlos_db: float) -> float:
        """What a weak first path adds to the sigma of a range, m.

        Nothing below `nlos_db` - `doubt_db`, all of it from `nlos_db` on, a straight line between.

        Args:
            gap_db: received power minus first-path power.
            nlos_db: 0 where this is not wanted.
        """
        if not nlos_db:
            return 0.0
        doubt = (gap_db - nlos_db + self.doubt_db) / self.doubt_db
        return self.blocked_sigma_m * min(max(doubt, 0.0), 1.0)

    def correlated_covariance(self, t: Array, sigma: Array | float) -> Array:
        """(..., n, n): the slow and the white part of ranges around their bias.

        Args:
            t: (..., n) their times, s; sigma: (...) m.
        """
        square = np.square(sigma)[..., None, None]
        slow = self.slow_share**2 * square
        covariance = np.exp(np.abs(t[..., :, None] - t[..., None, :]) * (-1 / self.slow_s))
        covariance *= slow
        np.einsum("...ii->...i", covariance)[:] += (square - slow)[..., 0]
        return np.asarray(covariance)

    def covariance(
        self, t: Array, ranges: Array, sigma: Array | float, bias_sigma: Array | float
    ) -> Array:
        """(..., n, n): white, slow and constant parts, and what a pair does at short range.

        Args:
            t: (..., n) s; ranges: (..., n) m.
            sigma, bias_sigma: (...) see `RangeNoise`.
        """
        near = self.near_range_sigma(ranges)
        covariance = self.correlated_covariance(t, sigma)
        covariance += near[..., :, None] * near[..., None, :]
        covariance += np.square(bias_sigma)[..., None, None]
        return covariance


LINKTRACK = RangeModel()


def residuals(sight: Array, ranges: Array) -> tuple[Array, Array]:
    """The residual of one range, eq. (1): predicted minus measured, any biases left in.

    Args:
        sight: (..., n) from antenna to antenna, x + iy, m.
        ranges: (n,) measured, m.

    Returns:
        e (..., n) m, and the unit lines of sight (..., n), x + iy.
    """
    distance = np.maximum(np.abs(sight), LEAST_DISTANCE_M)
    return distance - ranges, sight / distance  # eq. (1)
