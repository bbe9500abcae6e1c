"""Relative poses in complex numbers, with the weights of the paper's pose graph optimisation.

In the plane a rotation is a unit complex number and a position a complex number. The paper's cost
weighs each relative pose by two numbers, kappa for its rotation and tau for its position.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.se2 import Array, Index


@dataclass(frozen=True)
class ComplexFactors:
    """m relative poses with isotropic weights.

    Attributes:
        turn: (m,) z_ij; shift: (m,) t_ij; both complex.
        kappa, tau: (m,) weights of rotation and translation.
    """

    i: Index
    j: Index
    turn: Array
    shift: Array
    kappa: Array
    tau: Array

    @staticmethod
    def of(edges: BetweenFactors) -> ComplexFactors:
        """DPGO's weights: tau = 2 / trace of the positional covariance, kappa = 2 / var(theta).

        The 2 of kappa is because DPGO measures rotations by the Frobenius norm of matrices, whose
        square is twice that of the complex difference.
        """
        x, y, theta = edges.measured.T
        spread = edges.covariance[:, 0, 0] + edges.covariance[:, 1, 1]
        return ComplexFactors(
            edges.i,
            edges.j,
            np.exp(1j * theta),
            x + 1j * y,
            2 / edges.covariance[:, 2, 2],
            2 / spread,
        )

    @staticmethod
    def joined(parts: list[ComplexFactors]) -> ComplexFactors:
        """All edges of all parts."""
        columns = ((e.i, e.j, e.turn, e.shift, e.kappa, e.tau) for e in parts)
        return ComplexFactors(*(np.concatenate(column) for column in zip(*columns, strict=True)))

    def __len__(self) -> int:
        return len(self.i)

    def chosen(self, which: Array) -> ComplexFactors:
        return ComplexFactors(
            self.i[which],
            self.j[which],
            self.turn[which],
            self.shift[which],
            self.kappa[which],
            self.tau[which],
        )
