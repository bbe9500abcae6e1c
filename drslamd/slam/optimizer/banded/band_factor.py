"""A system of band and border, factorised: solutions and covariances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dtbtrs

from drslamd.slam.optimizer.banded.normal_equations import System
from drslamd.slam.se2 import Array, Index


@dataclass(frozen=True)
class BandFactor:
    """A system [A B; B' C] taken apart: A = L L', and what is left for the border.

    Attributes:
        lower: L in lower banded form.
        halfway: (n, b) L^-1 B: half of the way is enough, since B' A^-1 B = (L^-1 B)' (L^-1 B).
        schur: (b, b) C - B' A^-1 B, whose inverse is the covariance of the border.
    """

    lower: Array
    halfway: Array
    schur: Array

    @staticmethod
    def of(system: System, damping: float = 0.0) -> BandFactor | None:
        """None where the system is not positive definite."""
        band, corner = system.band.copy(), system.corner.copy()
        band[0] *= 1 + damping
        corner[np.diag_indices(len(corner))] *= 1 + damping
        try:
            lower = cholesky_banded(band, lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            return None
        halfway, _ = dtbtrs(lower, system.border, uplo="L")
        schur = corner - halfway.T @ halfway
        # a tiny pivot of A can leave nothing of the border but rounding
        definite = np.isfinite(schur).all() and bool((np.diag(schur) > 0).all())
        return BandFactor(lower, halfway, schur) if definite else None

    def solved(self, right: Array) -> Array | None:
        """(n + b,) the solution for a right-hand side (n + b,)."""
        n = len(self.halfway)
        middle = self._forward(right[:n, None])[:, 0]
        try:
            outer = np.linalg.solve(self.schur, right[n:] - self.halfway.T @ middle)
        except np.linalg.LinAlgError:
            return None
        rest = (middle - self.halfway @ outer)[:, None]
        inner, _ = dtbtrs(self.lower, rest, uplo="L", trans="T")
        return np.concatenate([inner[:, 0], outer])

    def joint_covariance(self, unknowns: Index) -> Array | None:
        """(k, k) block of the inverse for some unknowns (k,); None where there is none."""
        n, b = self.halfway.shape
        columns = np.arange(len(unknowns))
        inside = unknowns < n
        unit = np.zeros((n, len(unknowns)))
        unit[unknowns[inside], columns[inside]] = 1
        own = self._forward(unit)
        bound = -self.halfway.T @ own
        bound[unknowns[~inside] - n, columns[~inside]] += 1
        try:
            joint = own.T @ own + bound.T @ np.linalg.solve(self.schur, bound)
        except np.linalg.LinAlgError:
            return None
        return joint if np.isfinite(joint).all() else None

    def _forward(self, columns: Array) -> Array:
        """L^-1 times columns (n, c)."""
        solved, _ = dtbtrs(self.lower, columns, uplo="L")
        return np.asarray(solved)
