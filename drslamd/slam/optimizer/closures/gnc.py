"""Closures that contradict the rest of the graph, found by graduated non-convexity.

Module 2 looks at one pair at a time: a set of closures that agrees with itself is kept, also when
it is wrong as a whole and nobody of that pair speaks against it. Where other pairs close the loop,
they do. Truncated least squares let a closure cost no more than c^2,

    min  sum odometry + sum min(r_k^2, c^2) = min over w  sum w_k r_k^2 + (1 - w_k) c^2,

and are reached from the plain solution through costs that get less and less convex (Yang et al.,
Graduated Non-Convexity for Robust Spatial Perception, RA-L 2020, with eq. 14 for the weights):

    w = c / r sqrt(mu (mu + 1)) - mu, but 1 at most, and 0 above (mu + 1) / mu c^2

Of some hundred true closures one is beyond c nearly always, so this is the rule: 26 ms for 1,800
poses with 300 closures, where one plain solution takes 2 ms. A robot that hangs only on closures
which are no longer believed stays where they put it, with the covariance that this leaves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.chi_squared import quantile3
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolution, PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.se2 import Array

BELIEVABLE = quantile3(0.99)
"""c^2: a true closure has a larger squared error once in a hundred times."""
GROWTH = 1.4
"""Of mu, from one solution to the next (Yang et al.)."""
MOST_ROUNDS = 40
"""Mu grows half a millionfold on the way."""
SECOND_CHANCE = 10.0
"""In the end those with up to so many times the believable squared error are believed once more,
and judged anew: true ones beside the false may have lost their weight with them."""
LEAST_WEIGHT = 1e-6
"""Left to what is not believed, so that poses which hang on nothing else stay determined."""


def solve(
    edges: ComplexFactors,
    count: int,
    doubted: NDArray[np.bool_],
    start: Array | None,
    believable: float = BELIEVABLE,
) -> tuple[PoseGraphSolution, ComplexFactors]:
    """The least truncated cost that a start leads to, and the edges as they were weighed for it.

    Args:
        edges: between `count` poses that are all connected.
        doubted: (m,) which of them may be wrong as a whole.
        start: (count, 3), or None for the chordal relaxation.
        believable: see `BELIEVABLE`.
    """
    answer = PoseGraphSolver(edges, count).solve(start)
    squares = squared_errors(edges, answer.poses)[doubted]
    worst = float(squares.max(initial=0.0))
    if worst <= believable:
        return answer, edges
    schedule = _Schedule(worst, believable)
    steps, weighed = answer.steps, edges
    while (weight := schedule.next(squares)) is not None:
        held = np.ones(len(edges))
        held[doubted] = np.maximum(weight, LEAST_WEIGHT)
        weighed = replace(edges, kappa=held * edges.kappa, tau=held * edges.tau)
        answer = PoseGraphSolver(weighed, count).solve(answer.poses)
        steps += answer.steps
        squares = squared_errors(edges, answer.poses)[doubted]
    return replace(answer, steps=steps), weighed


class _Schedule:
    """Weights of one solution after the other."""

    def __init__(self, worst: float, believable: float) -> None:
        """Begins with the cost that is just convex at the worst squared error."""
        self._believable = believable
        mu = believable / (2 * worst - believable)
        self._mu = [mu * GROWTH**k for k in range(MOST_ROUNDS)]
        self._gates = [SECOND_CHANCE * believable, believable]

    def next(self, squares: Array) -> Array | None:
        """(k,) for squared errors (k,); None at the end."""
        if self._mu:
            weight = weights(squares, self._mu.pop(0), self._believable)
            if np.isin(weight, (0.0, 1.0)).all():
                self._mu = []
            return weight
        return (squares <= self._gates.pop(0)).astype(float) if self._gates else None


def weights(squares: Array, mu: float, believable: float = BELIEVABLE) -> Array:
    """(k,) in [0, 1], of squared errors in sigmas."""
    return np.asarray(
        np.clip(np.sqrt(believable * mu * (mu + 1) / np.maximum(squares, 1e-12)) - mu, 0.0, 1.0)
    )


def squared_errors(edges: ComplexFactors, poses: Array) -> Array:
    """(m,) squared errors in sigmas, of x, y and angle together."""
    place, turned = poses[:, 0] + 1j * poses[:, 1], np.exp(1j * poses[:, 2])
    off = place[edges.j] - place[edges.i] - turned[edges.i] * edges.shift
    turn = np.angle(turned[edges.j] / (turned[edges.i] * edges.turn))
    # kappa is twice the information of an angle (`ComplexFactors.of`)
    return np.asarray(edges.tau * np.abs(off) ** 2 + edges.kappa / 2 * turn**2)
