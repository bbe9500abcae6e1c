"""Module 3 as the paper has it: Riemannian block coordinate descent on a relaxation (III-C).

In the plane a rotation is a unit complex number z and a position a complex number p. Pose graph
optimisation is then

    min  sum kappa |z_j - z_i z_ij|^2 + tau |p_j - p_i - z_i t_ij|^2,   |z_k| = 1.

The rank-restricted relaxation lets z and p be vectors of C^r: rotations live on spheres, and for
a moderate r local minima disappear. Every robot owns the block of its own poses and improves it by
preconditioned Riemannian gradient descent while the poses of its neighbours stay as they were last
heard. Only public poses, those that carry closures, are exchanged; nobody waits for anybody.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from drslamd.slam.optimizer.problem import Index, PoseEdges
from drslamd.slam.se2 import Array

STEPS_PER_ROUND = 3
"""Descent steps on one block before its public poses are sent; more would fit the block to
neighbours that are about to move."""
SUFFICIENT = 1e-4
"""Armijo's constant."""
REGULARISATION = 1e-6
"""Of the preconditioner, relative to its diagonal."""
HOLD = 1e10
"""Weight that pins a pose: 10 um."""


@dataclass(frozen=True)
class ComplexEdges:
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
    def of(edges: PoseEdges) -> ComplexEdges:
        """DPGO's weights: tau = 2 / trace of the positional covariance, kappa = 2 / var(theta).

        The 2 of kappa is because DPGO measures rotations by the Frobenius norm of matrices, whose
        square is twice that of the complex difference.
        """
        x, y, theta = edges.measured.T
        spread = edges.covariance[:, 0, 0] + edges.covariance[:, 1, 1]
        return ComplexEdges(
            edges.i, edges.j, np.exp(1j * theta), x + 1j * y,
            2 / edges.covariance[:, 2, 2], 2 / spread,
        )  # fmt: skip

    @staticmethod
    def joined(parts: list[ComplexEdges]) -> ComplexEdges:
        """All edges of all parts."""
        columns = ((e.i, e.j, e.turn, e.shift, e.kappa, e.tau) for e in parts)
        return ComplexEdges(*(np.concatenate(column) for column in zip(*columns, strict=True)))

    def __len__(self) -> int:
        return len(self.i)

    def chosen(self, which: Array) -> ComplexEdges:
        return ComplexEdges(self.i[which], self.j[which], self.turn[which], self.shift[which],
                            self.kappa[which], self.tau[which])  # fmt: skip


@dataclass(frozen=True)
class Block:
    """One robot's share: f(X) = Re tr(X^H Q X) + 2 Re tr(X^H G) + constant.

    Rows 2k and 2k + 1 of X (2n, r) are rotation and position of the robot's pose k.

    Attributes:
        q: (w + 1, 2n) lower band of the Hermitian Q.
        g: (2n, r) pull of the fixed neighbours.
        constant: cost that no own pose can change.
    """

    q: Array
    g: Array
    constant: float

    def apply(self, x: Array) -> Array:
        """Q X."""
        out = self.q[0][:, None] * x
        for d in range(1, len(self.q)):
            below = self.q[d, : x.shape[0] - d, None]
            out[d:] += below * x[:-d]
            out[:-d] += below.conj() * x[d:]
        return np.asarray(out)

    def cost(self, x: Array) -> float:
        return float(np.real(np.vdot(x, self.apply(x) + 2 * self.g))) + self.constant

    def gradient(self, x: Array) -> Array:
        """Half the Euclidean gradient."""
        return self.apply(x) + self.g


def block(
    own: ComplexEdges, leaving: ComplexEdges, arriving: ComplexEdges,
    neighbours: Array, size: int,
) -> Block:  # fmt: skip
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
    constant = 0.0
    for edges, ours in ((own, (0, 1, 2, 3)), (leaving, (0, 1)), (arriving, (2, 3))):
        ends = np.stack([2 * edges.i, 2 * edges.i + 1, 2 * edges.j, 2 * edges.j + 1])
        theirs = [k for k in range(4) if k not in ours]
        for weight, factor in _residuals(edges):
            # |sum_k factor_k x_k|^2 with x_k ours or held: its square, its mixed term, its rest
            pull = sum((factor[k][:, None] * held[ends[k]] for k in theirs), np.zeros(1))
            for k in ours:
                np.add.at(g, ends[k], (weight * factor[k].conj())[:, None] * pull)
                for m in ours:
                    lower = ends[k] >= ends[m]
                    row, column = ends[k][lower], ends[m][lower]
                    value = (weight * factor[k].conj() * factor[m])[lower]
                    np.add.at(q, (row - column, column), value)
            constant += float(np.sum(weight * np.sum(np.abs(pull) ** 2, axis=-1)))
    return Block(q, g, constant)


def _residuals(edges: ComplexEdges) -> list[tuple[Array, Array]]:
    """Both terms of the cost, each as its weight (m,) and its factors (4, m) of the rows
    z_i, p_i, z_j, p_j."""
    one, none = np.ones_like(edges.turn), np.zeros_like(edges.turn)
    return [
        (edges.kappa, np.stack([-edges.turn, none, one, none])),
        (edges.tau, np.stack([-edges.shift, -one, none, one])),
    ]


def descend(problem: Block, x: Array, steps: int = STEPS_PER_ROUND) -> Array:
    """Some steps of preconditioned Riemannian gradient descent from X (2n, r); the new X."""
    factor = _factor(problem.q)
    cost = problem.cost(x)
    for _ in range(steps):
        gradient = tangent(x, problem.gradient(x))
        direction = -cho_solve_banded((factor, True), gradient, check_finite=False)
        direction = tangent(x, direction)
        slope = 2 * float(np.real(np.vdot(gradient, direction)))
        length = 1.0
        while length > 1e-6:
            trial = retract(x + length * direction)
            new = problem.cost(trial)
            if new <= cost + SUFFICIENT * length * slope:
                x, cost = trial, new
                break
            length /= 2
        else:
            break
    return x


def conditional_covariance(problem: Block, pose: int, held: int | None) -> Array:
    """(3, 3) of x, y, theta of one pose while the neighbours' poses are taken as exact.

    Too small by what the neighbours do not know; the relaxation offers no better.

    Args:
        held: our pose that is the origin of the frame, when it is ours.
    """
    q = problem.q.copy()
    if held is not None:
        q[0, 2 * held : 2 * held + 2] += HOLD
    unit = np.zeros((q.shape[1], 2))
    unit[[2 * pose, 2 * pose + 1], [0, 1]] = 1
    inverse = cho_solve_banded((_factor(q), True), unit, check_finite=False)
    turn, place = (float(inverse[2 * pose + k, k].real) for k in range(2))
    return np.diag([place, place, 2 * turn])


def _factor(q: Array) -> Array:
    """Cholesky factor of a Hermitian band; a block without neighbours is singular by itself."""
    lifted = q.copy()
    lifted[0] = q[0].real * (1 + REGULARISATION) + REGULARISATION
    return np.asarray(cholesky_banded(lifted, lower=True, check_finite=False))


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
