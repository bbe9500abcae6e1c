"""Small pose graphs split over robots, their costs and minima worked out pose by pose."""

from __future__ import annotations

import math

import numpy as np
from lab.play.block_team import SplitGraph
from slam_scenes import Array, inverted, product, wander

from drslamd.slam.optimizer.complex_factors import ComplexFactors

ODOMETRY, CLOSURE = (0.01, 0.005), (0.1, 0.05)
"""Sigmas in m and rad."""
COUNT = 12
"""Poses of each robot."""


def split_graph(
    seed: int, pairs: list[tuple[int, int]], closures: int = 5, error: float = 1.0
) -> SplitGraph:
    """Robots on curves; of each pair so many closures, from random poses to random poses.

    Args:
        error: of what is measured, in its sigmas.
    """
    rng = np.random.default_rng(seed)
    robots = 1 + max(max(pair) for pair in pairs)
    truth = np.concatenate([wander(rng, COUNT, 0.3) for _ in range(robots)])
    ends, sigmas = [], []
    for robot in range(robots):
        first = robot * COUNT
        ends += [(first + k, first + k + 1) for k in range(COUNT - 1)]
        sigmas += [ODOMETRY] * (COUNT - 1)
    for a, b in pairs:
        for one, other in rng.integers(0, COUNT, (closures, 2)).tolist():
            ends.append((a * COUNT + one, b * COUNT + other))
            sigmas.append(CLOSURE)
    measured = []
    for (i, j), (metres, radians) in zip(ends, sigmas, strict=True):
        wrong = error * rng.normal(0, [metres, metres, radians])
        measured.append(product(inverted(truth[i]), truth[j]) + wrong)
    x, y, theta = np.array(measured).T
    metres, radians = np.array(sigmas).T
    i, j = np.array(ends).T
    weights = 2 / radians**2, 1 / metres**2
    edges = ComplexFactors(i, j, np.exp(1j * theta), x + 1j * y, *weights)
    return SplitGraph(np.repeat(np.arange(robots), COUNT), np.tile(np.arange(COUNT), robots), edges)


def plain_cost(graph: SplitGraph, poses: Array) -> float:
    """Of planar poses (k, 3), edge by edge."""
    cost, e = 0.0, graph.edges
    for i, j, turn, shift, kappa, tau in zip(
        e.i, e.j, e.turn, e.shift, e.kappa, e.tau, strict=True
    ):
        seen = product(inverted(poses[i]), poses[j])
        off = complex(seen[0], seen[1]) - shift
        twist = abs(complex(math.cos(seen[2]), math.sin(seen[2])) - turn)
        cost += kappa * twist**2 + tau * abs(off) ** 2
    return cost
