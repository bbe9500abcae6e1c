"""What is believed of how wheels and antenna are mounted, where a configuration is doubted.

A track that is not as configured makes turns too long or too short by a fraction (the wheels of a
skid-steered robot slide, its track is half as wide again); an antenna that is not where it is said
to be moves every range. Most configurations are right, some are far off: the cost of a value v of d
components is Cauchy's, with Gauss's tails,

    (1 + d) / 2 log(1 + |v|^2 / width^2) + |v|^2 / most^2
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.bias_prior import LEAST_CURVATURE, TINY
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class MountingPrior:
    """Of values (k, d): d components of one thing each.

    Attributes:
        width: half width of the distribution.
        most: sigma of its tails.
    """

    width: float
    most: float

    def cost(self, values: Array) -> float:
        squares = (values**2).sum(axis=1)
        heads = (1 + values.shape[1]) / 2 * np.log1p(squares / self.width**2)
        return float(heads.sum() + squares.sum() / self.most**2)

    def pull(self, values: Array) -> Array:
        """(k, d) half the derivative."""
        return np.asarray(self._stiffness(values)[:, None] * values)

    def curvature(self, values: Array, least: float = LEAST_CURVATURE) -> Array:
        """(k, d, d) half the second derivative, kept positive definite.

        Args:
            least: see `LEAST_CURVATURE`.
        """
        squares, d = (values**2).sum(axis=1), values.shape[1]
        bend = np.minimum(2 / (self.width**2 + squares), (1 - least) / np.maximum(squares, TINY))
        outer = values[:, :, None] * values[:, None, :]
        rounded = self._head(values)[:, None, None] * (np.eye(d) - bend[:, None, None] * outer)
        return np.asarray(rounded + self.most**-2 * np.eye(d))

    def _stiffness(self, values: Array) -> Array:
        return self._head(values) + self.most**-2

    def _head(self, values: Array) -> Array:
        squares = (values**2).sum(axis=1)
        return np.asarray((1 + values.shape[1]) / 2 / (self.width**2 + squares))


TRACK = MountingPrior(width=0.01, most=0.5)
"""Of how much longer turns are than odometry says, a fraction."""
ANTENNA = MountingPrior(width=0.02, most=0.5)
"""m"""
