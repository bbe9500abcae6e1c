"""A pose graph of three robots for the benchmark's tests, and its optimum by scipy."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from lab.benchmark import graphs
from lab.benchmark.graphs import Graph, Known
from scipy.optimize import least_squares

from drslamd.slam import se2

Array = np.ndarray
EACH, ROBOTS = 13, 3
COUNT = EACH * ROBOTS
OFF = np.array([0.05, 0.05, 0.02])


def lines() -> list[str]:
    """A team of three with closures of one time, two of them between the same two poses."""
    rng = np.random.default_rng(3)
    poses = rng.normal(0, 5, (COUNT, 3))
    odometry = [(k, k + 1, 400.0) for k in range(COUNT - 1) if (k + 1) % EACH]
    closures = [(k, k + EACH, 40.0) for k in range(0, 2 * EACH, 4)]
    out = []
    for i, j, weight in [*odometry, *closures, closures[3]]:
        x, y, theta = se2.between(poses[i], poses[j]) + OFF * rng.normal(size=3)
        info = f"{weight} 0 0 {weight} 0 {4 * weight}"
        out.append(f"EDGE_SE2 {i} {j} {x} {y} {theta} {info}")
    return out


@cache
def optimum() -> float:
    """Least cost by scipy, the cost written down once more with matrices."""
    table = np.array([[float(word) for word in line.split()[1:]] for line in lines()])
    i, j = table[:, 0].astype(int), table[:, 1].astype(int)
    x, y, theta, weight = table[:, 2], table[:, 3], table[:, 4], table[:, 5]

    def errors(flat: Array) -> Array:
        p = flat.reshape(COUNT, 3)
        c, s = np.cos(p[i, 2]), np.sin(p[i, 2])
        dx = p[j, 0] - p[i, 0] - (c * x - s * y)
        dy = p[j, 1] - p[i, 1] - (s * x + c * y)
        turn = p[j, 2] - p[i, 2] - theta
        # Frobenius norm of a difference of rotations, weighed by the information of the angle
        rotation = np.sqrt(4 * weight * 8) * np.sin(turn / 2)
        return np.concatenate([np.sqrt(weight) * dx, np.sqrt(weight) * dy, rotation])

    best = np.inf
    truth = np.random.default_rng(3).normal(0, 5, (COUNT, 3))
    for scale in (0.0, 0.01):
        start = truth + scale * np.random.default_rng(0).normal(size=truth.shape)
        best = min(best, 2 * least_squares(errors, start.ravel(), method="lm", xtol=1e-14).cost)
    return float(best)


def loaded(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Graph:
    """The graph, as the benchmark reads it from a folder."""
    (folder / "small.g2o").write_text("\n".join(lines()) + "\n\n")
    known = Known("small.g2o", ROBOTS, optimum(), True)
    monkeypatch.setattr(graphs, "FOLDER", folder)
    monkeypatch.setattr(graphs, "GRAPHS", {"small": known})
    return graphs.load("small")
