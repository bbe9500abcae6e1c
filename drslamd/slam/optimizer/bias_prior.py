"""What is believed of range biases before anything is measured.

The modules of one team resemble each other. The bias of a pair is that of the team plus what the
pair has of its own,

    bias_ij = team + own_ij.

All `own` together are of Student's distribution: while all pairs agree each is held tightly, and
where they differ all are held loosely. `team` is of Cauchy's distribution. Both have Gauss's tails
beyond the sigma that is configured: without them a bias that motion says little of runs off by
metres after whatever else is wrong. The cost is -2 log of the density, without its constant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.range_model import RangeModel
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class BiasPrior:
    """
    Attributes:
        sigma: as configured, m.
        spread: half width of what pairs have of their own, m.
        dof: degrees of freedom of its distribution.
        team: half width of what all pairs have in common, m.
    """

    sigma: float
    spread: float
    dof: float
    team: float

    @staticmethod
    def of(sigma: float, model: RangeModel) -> BiasPrior:
        """For a configured sigma, m."""
        return BiasPrior(
            sigma=sigma,
            spread=model.spread_share * sigma,
            dof=model.spread_dof,
            team=model.team_share * sigma,
        )

    def own_stiffness(self, own: Array) -> float:
        """Information, 1/m^2, with which each of these values (pairs,) is held."""
        scale = self.dof * self.spread**2 + float(own @ own)
        return (self.dof + len(own)) / scale + self.sigma**-2

    def team_stiffness(self, team: float) -> float:
        """Likewise of what is common."""
        return 1 / (self.team**2 + team**2) + self.sigma**-2

    def cost(self, own: Array, team: float) -> float:
        squares = float(own @ own)
        student = (self.dof + len(own)) * np.log1p(squares / (self.dof * self.spread**2))
        cauchy = np.log1p((team / self.team) ** 2)
        return float(student + cauchy + (squares + team**2) / self.sigma**2)
