"""Module 3 as the paper has it: Riemannian block coordinate descent on a relaxation (III-C).

In the plane a rotation is a unit complex number z and a position a complex number p. Pose graph
optimisation is then

    min  sum kappa |z_j - z_i z_ij|^2 + tau |p_j - p_i - z_i t_ij|^2,   |z_k| = 1.

The rank-restricted relaxation lets z and p be vectors of C^r: rotations live on spheres, and for
a moderate r local minima disappear. (Poses that begin in a plane stay in it; then r costs nothing
on the air.) Every robot owns the block of its own poses and improves it by preconditioned
Riemannian descent while the poses of its neighbours stay as they were last heard. Only public
poses, those that carry closures, are exchanged.

With its neighbours held a block's cost is quadratic, so a step that goes past the block's minimum,
to x + (1 + lean) (y - x) with 0 < lean < 1, lowers the cost as well (Ostrowski 1954), and of what
the whole team still has to move together it brings far more: block successive over-relaxation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.slam import headway
from drslamd.slam.lapack.routines import cholesky_banded, cholesky_banded_solved
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.se2 import Array

MOST_STEPS = 30
"""Descent steps on one block; ten are enough unless it was just placed."""
ENOUGH = 1e-3
"""Gain of a step, as a share of that of all steps before, after which no other one is taken: the
neighbours are about to move anyway."""
SUFFICIENT = 1e-4
"""Armijo's constant."""
SHORTEST = 1e-6
"""Share of a step below which none is taken."""
LEAST_LEAN = 0.05
"""A shorter way past the minimum is not worth a trial."""
REGULARISATION = 1e-6
"""Of the preconditioner, relative to its diagonal."""


@dataclass(frozen=True)
class Term:
    """m squares of a block's cost: weight |sum_k factor_k x_k + pull|^2 over the k own ends.

    Attributes:
        weight: (m,); factors: (k, m) complex; rows: (k, m) of X; pull: (m, r) of held neighbours.
    """

    weight: Array
    factors: Array
    rows: Array
    pull: Array

    def cost(self, x: Array) -> float:
        ends = np.einsum("km,kmr->mr", self.factors, x[self.rows])
        return float(self.weight @ np.sum(np.abs(ends + self.pull) ** 2, axis=-1))


@dataclass(frozen=True)
class BlockProblem:
    """One robot's share: f(X) = Re tr(X^H Q X) + 2 Re tr(X^H G) + constant.

    Rows 2k and 2k + 1 of X (2n, r) are rotation and position of the robot's pose k.

    Attributes:
        q: (w + 1, 2n) lower band of the Hermitian Q.
        g: (2n, r) pull of the fixed neighbours.
        terms: f once more, square by square.
    """

    q: Array
    g: Array
    terms: tuple[Term, ...]

    def apply(self, x: Array) -> Array:
        """Q X."""
        out = self.q[0][:, None] * x
        for d in range(1, len(self.q)):
            below = self.q[d, : x.shape[0] - d, None]
            out[d:] += below * x[:-d]
            out[:-d] += below.conj() * x[d:]
        return np.asarray(out)

    def cost(self, x: Array) -> float:
        """Of the squares: the polynomial would lose half of its digits to stiff links."""
        return sum(term.cost(x) for term in self.terms)

    def change(self, gradient: Array, step: Array) -> float:
        """By how much a step from where the gradient is that lets the cost rise."""
        return _real(step, self.apply(step) + 2 * gradient)

    def gradient(self, x: Array) -> Array:
        """Half the Euclidean gradient."""
        return self.apply(x) + self.g


def block(
    own: ComplexFactors,
    leaving: ComplexFactors,
    arriving: ComplexFactors,
    neighbours: Array,
    size: int,
) -> BlockProblem:
    """Collect one robot's block.

    Args:
        own: edges between its poses, by their numbers.
        leaving: edges from one of its poses (i) to a neighbour's (j, a row of `neighbours`).
        arriving: edges from a neighbour's pose (i, a row of `neighbours`) to one of its own (j).
        neighbours: (m, 2 r) lifted poses that are held.
        size: number of its poses.
    """
    held = stacked(neighbours)
    width = 2 * int(np.abs(own.i - own.j).max(initial=0)) + 2
    q = np.zeros((width, 2 * size), dtype=complex)
    g = np.zeros((2 * size, held.shape[1]), dtype=complex)
    terms = []
    for edges, ours in ((own, (0, 1, 2, 3)), (leaving, (0, 1)), (arriving, (2, 3))):
        ends = np.stack([2 * edges.i, 2 * edges.i + 1, 2 * edges.j, 2 * edges.j + 1])
        theirs = [k for k in range(4) if k not in ours]
        for weight, factor in _residuals(edges):
            pull = np.zeros((len(edges), held.shape[1]), dtype=complex)
            for k in theirs:
                pull += factor[k][:, None] * held[ends[k]]
            for k in ours:
                np.add.at(g, ends[k], (weight * factor[k].conj())[:, None] * pull)
                for m in ours:
                    lower = ends[k] >= ends[m]
                    row, column = ends[k][lower], ends[m][lower]
                    value = (weight * factor[k].conj() * factor[m])[lower]
                    np.add.at(q, (row - column, column), value)
            mine = list(ours)
            terms.append(Term(weight, factor[mine], ends[mine], pull))
    return BlockProblem(q, g, tuple(terms))


def _residuals(edges: ComplexFactors) -> list[tuple[Array, Array]]:
    """Both terms of the cost, each as its weight (m,) and its factors (4, m) of the rows
    z_i, p_i, z_j, p_j."""
    one, none = np.ones_like(edges.turn), np.zeros_like(edges.turn)
    return [
        (edges.kappa, np.stack([-edges.turn, none, one, none])),
        (edges.tau, np.stack([-edges.shift, -one, none, one])),
    ]


def descend(problem: BlockProblem, x: Array, most: int = MOST_STEPS) -> tuple[Array, int]:
    """Preconditioned Riemannian conjugate gradients (Polak and Ribiere) from X (2n, r).

    Returns:
        the new X, nearly the block's minimum, and how many steps led there.
    """
    factor = _factor(problem.q)
    total = 0.0
    before: tuple[Array, Array, Array] | None = None
    for step in range(most):
        headway.mark()
        ambient = problem.gradient(x)
        gradient = tangent(x, ambient)
        downhill = -tangent(x, cholesky_banded_solved(factor, gradient))
        direction = downhill
        if before is not None:
            old_gradient, old_downhill, old_direction = before
            turned = _real(downhill, gradient - tangent(x, old_gradient))
            share = max(0.0, turned / _real(old_downhill, old_gradient))
            direction = tangent(x, downhill + share * old_direction)
            if _real(gradient, direction) >= 0:
                direction = downhill
        trial, gain = _line_search(problem, x, ambient, direction)
        if gain <= 0:
            return x, step
        x, before, total = trial, (gradient, downhill, direction), total + gain
        if gain <= ENOUGH * total:
            return x, step + 1
    return x, most


def _line_search(
    problem: BlockProblem, x: Array, ambient: Array, direction: Array
) -> tuple[Array, float]:
    """The new X and by how much the cost is less there; the old one where no step helps.

    Args:
        ambient: half the Euclidean gradient at X.
    """
    slope = 2 * _real(ambient, direction)
    curvature = _real(direction, problem.apply(direction))
    length = -slope / (2 * curvature) if curvature > 0 else 0.0
    shortest = SHORTEST * length
    while length > shortest:
        trial = retract(x + length * direction)
        change = problem.change(ambient, trial - x)
        if change <= SUFFICIENT * length * slope:
            return trial, -change
        length /= 2
    return x, 0.0


def leaned(problem: BlockProblem, x: Array, y: Array, lean: float) -> Array:
    """As far past the block's minimum y as `lean` says, a share of the way from x to y; less where
    the cost would be above that of x."""
    ambient = problem.gradient(x)
    while lean >= LEAST_LEAN:
        beyond = retract(y + lean * (y - x))
        if problem.change(ambient, beyond - x) <= 0:
            return beyond
        lean /= 2
    return y


def _real(a: Array, b: Array) -> float:
    """Inner product of tangent vectors."""
    return float(np.real(np.vdot(a, b)))


def _factor(q: Array) -> Array:
    """Cholesky factor of a Hermitian band; a block without neighbours is singular by itself."""
    lifted = q.copy()
    lifted[0] = q[0].real * (1 + REGULARISATION) + REGULARISATION
    return cholesky_banded(lifted)


def tangent(x: Array, vectors: Array) -> Array:
    """Project onto the tangent space: rotations may only move across their sphere."""
    z, v = x[0::2], vectors[0::2]
    out: Array = vectors.copy()
    out[0::2] = v - np.real(np.sum(z.conj() * v, axis=1))[:, None] * z
    return out


def retract(x: Array) -> Array:
    """Bring rotations back onto their spheres."""
    out: Array = x.copy()
    out[0::2] /= np.linalg.norm(out[0::2], axis=1)[:, None]
    return out


def lift(poses: Array, rank: int) -> Array:
    """Planar poses (n, 3) as rows of C^(2 rank), in the first direction: (n, 2 rank)."""
    out = np.zeros((len(poses), 2 * rank), dtype=complex)
    out[:, 0] = np.exp(1j * poses[:, 2])
    out[:, rank] = poses[:, 0] + 1j * poses[:, 1]
    return out


def moved(lifted: Array, measured: Array) -> Array:
    """Lifted poses (n, 2 r), each moved by a planar motion (n, 3) in its own frame."""
    rank = lifted.shape[1] // 2
    z, p = lifted[:, :rank], lifted[:, rank:]
    turn, shift = np.exp(1j * measured[:, 2]), measured[:, 0] + 1j * measured[:, 1]
    return np.concatenate([z * turn[:, None], p + z * shift[:, None]], axis=1)


def rounded(lifted: Array, anchor: Array) -> Array:
    """Planar poses (n, 3) in the frame of a lifted anchor pose (2 r,)."""
    rank = len(anchor) // 2
    z0, p0 = anchor[:rank], anchor[rank:]
    turn = lifted[:, :rank] @ z0.conj()
    place = (lifted[:, rank:] - p0) @ z0.conj()
    return np.stack([place.real, place.imag, np.angle(turn)], axis=-1)


def stacked(lifted: Array) -> Array:
    """Rows of C^(2 r) (n, 2 r) as the X (2n, r) of a block."""
    return np.asarray(lifted.reshape(2 * len(lifted), lifted.shape[1] // 2))


def rows(x: Array) -> Array:
    """Inverse of `stacked`."""
    return np.asarray(x.reshape(len(x) // 2, 2 * x.shape[1]))
