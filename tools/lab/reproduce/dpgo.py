"""The paper's module 3 on one seed: DPGO's cost, and its minimum.

    min  sum kappa |z_j - z_i z_ij|^2 + tau |p_j - p_i - z_i t_ij|^2,   |z_k| = 1

with weights and notation of `riemannian_descent`. Block coordinate descent is run as the daemon
runs it, each robot on its block and in turns, over datagrams. Beside it stands what a centralised
solver makes of the same edges: chordal initialisation as in DPGO, then Levenberg-Marquardt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import spsolve

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.graph.thinning.chain_view import ChainView, whole
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.factors import chain_links
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.robot_model import RobotModel
from lab.play.block_team import SplitGraph
from lab.recordings.recording import Array
from lab.reproduce.paper_column import NOISE, Closures

STEPS = 60
SETTLED = 1e-5
"""m and rad; a smaller step ends the descent."""


@dataclass(frozen=True)
class Graph:
    """Robot r at pose time k is number robots * k + r; edges are odometry and closures."""

    robots: int
    size: int
    edges: ComplexFactors


def chain(odometry: Array, robot: int) -> ChainView:
    """Dead-reckoned poses (n, 3) as keyframes."""
    items = ChainData(Chain(robot, 1))
    items.model = RobotModel(NOISE)
    steps = np.array([TRANSLATION_STEP_M, TRANSLATION_STEP_M, ROTATION_STEP_RAD])
    for n, (x, y, theta) in enumerate(np.round(odometry / steps).astype(int).tolist()):
        items.add(Keyframe(n, 0, x, y, theta))
    return whole(items)


def graph(odometry: dict[int, Array], kept: dict[tuple[int, int], Closures]) -> Graph:
    """Of robots 0, 1 ...; every one has to have a closure."""
    count = len(odometry)
    parts = [
        BetweenFactors(count * e.i + r, count * e.j + r, e.measured, e.covariance)
        for r, e in ((r, chain_links(chain(o, r), calibrated=False)) for r, o in odometry.items())
    ]
    parts += [
        BetweenFactors(count * c.k + a, count * c.k + b, c.poses, c.covariances)
        for (a, b), c in kept.items()
    ]
    columns = zip(*((e.i, e.j, e.measured, e.covariance) for e in parts), strict=True)
    edges = BetweenFactors(*(np.concatenate(column) for column in columns))
    return Graph(count, count * len(odometry[0]), ComplexFactors.of(edges))


def solve(problem: Graph) -> dict[int, Array]:
    """Poses (n, 3) of each robot at the minimum, robot 0's first one being the origin."""
    return by_robot(problem, minimum(problem, chordal(problem)))


def by_robot(problem: Graph, poses: Array) -> dict[int, Array]:
    """All poses (size, 3), sorted."""
    sorted_out = poses.reshape(-1, problem.robots, 3)
    return {r: sorted_out[:, r] for r in range(problem.robots)}


def split(problem: Graph) -> SplitGraph:
    """The same graph, and whose its poses are."""
    number = np.arange(problem.size)
    return SplitGraph(number % problem.robots, number // problem.robots, problem.edges)


def chordal(problem: Graph) -> Array:
    """(size, 3): rotations while they need not have length one, then positions given these."""
    e = problem.edges
    turns = _linear(problem, -e.turn, e.kappa, np.zeros(len(e.i), dtype=complex), 1.0)
    z = turns / np.maximum(np.abs(turns), 1e-12)
    p = _linear(problem, -np.ones(len(e.i), dtype=complex), e.tau, z[e.i] * e.shift, 0.0)
    return np.stack([p.real, p.imag, np.angle(z)], axis=-1)


def _linear(problem: Graph, factor: Array, weight: Array, right: Array, first: float) -> Array:
    """min sum weight |x_j + factor x_i - right|^2 with x_0 given."""
    e, rows = problem.edges, np.arange(len(problem.edges.i))
    values = np.concatenate([np.ones(len(rows), dtype=complex), factor])
    places = (np.concatenate([rows, rows]), np.concatenate([e.j, e.i]))
    a = csc_array(coo_array((values, places), shape=(len(rows), problem.size)))
    held, free = a[:, [0]].toarray()[:, 0] * first, a[:, 1:]
    adjoint = free.conj().T @ diags_array(weight)
    x = spsolve(csc_array(adjoint @ free), adjoint @ (right - held))
    return np.concatenate([[first], x])


def minimum(problem: Graph, poses: Array) -> Array:
    """Levenberg-Marquardt from poses (size, 3); pose 0 is held."""
    damping = 1e-6
    error, slope = _linearised(problem, poses)
    for _ in range(STEPS):
        hessian, gradient = csc_array(slope.T @ slope), slope.T @ error
        lifted = hessian + diags_array(damping * hessian.diagonal())
        step = np.concatenate([np.zeros(3), -spsolve(csc_array(lifted), gradient)])
        trial = poses + step.reshape(-1, 3)
        new_error, new_slope = _linearised(problem, trial)
        if new_error @ new_error <= error @ error:
            poses, error, slope, damping = trial, new_error, new_slope, damping / 10
            if np.abs(step).max() < SETTLED:
                break
        else:
            damping *= 100
    return poses


def _linearised(problem: Graph, poses: Array) -> tuple[Array, csc_array]:
    """Weighted errors (4 m,) and their Jacobian without pose 0: real parts, then imaginary ones."""
    e, rows = problem.edges, np.arange(len(problem.edges.i))
    z, p = np.exp(1j * poses[:, 2]), poses[:, 0] + 1j * poses[:, 1]
    turned, shifted = z[e.i] * e.turn, z[e.i] * e.shift
    kappa, tau = np.sqrt(e.kappa), np.sqrt(e.tau)
    error = np.concatenate([kappa * (z[e.j] - turned), tau * (p[e.j] - p[e.i] - shifted)])
    one, m = np.ones(len(rows), dtype=complex), len(rows)
    parts = [
        (rows, 3 * e.j + 2, 1j * kappa * z[e.j]),
        (rows, 3 * e.i + 2, -1j * kappa * turned),
        (rows + m, 3 * e.j, tau * one),
        (rows + m, 3 * e.i, -tau * one),
        (rows + m, 3 * e.j + 1, 1j * tau),
        (rows + m, 3 * e.i + 1, -1j * tau),
        (rows + m, 3 * e.i + 2, -1j * tau * shifted),
    ]
    row, column, value = (np.concatenate(c) for c in zip(*parts, strict=True))
    places = (np.concatenate([row, row + 2 * m]), np.concatenate([column, column]))
    values = np.concatenate([value.real, value.imag])
    slope = csc_array(coo_array((values, places), shape=(4 * m, 3 * problem.size)))
    return np.concatenate([error.real, error.imag]), slope[:, 3:]
