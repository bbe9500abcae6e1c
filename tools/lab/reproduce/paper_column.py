"""The column "paper": the three algorithms as printed, on one seed, without a network.

Closures have the covariance sigma_r^2 (J'J)^-1, consistency adds what odometry adds along both
chains, and the pose graph has DPGO's isotropic weights; no robust cost, no bias, no scale.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from drslamd.config import ConsistencySection, OdometrySection, RelativePoseSection
from drslamd.slam import settings
from drslamd.slam.chi_squared import quantile3
from drslamd.slam.consistency.incremental_clique import IncrementalClique, bits
from drslamd.slam.consistency.pcm import Candidate, PairConsistency
from drslamd.slam.odometry.noise import growth
from drslamd.slam.relative_pose import algorithm_1
from drslamd.slam.relative_pose.estimate import Hypothesis
from drslamd.slam.relative_pose.window import Window
from lab.recordings.recording import Array
from lab.reproduce.experiment import WHEELS, Trial

SIGMA_R = RelativePoseSection().range_sigma_m
DELTA = RelativePoseSection().delta
EPSILON = ConsistencySection().epsilon
TOLD = OdometrySection(
    scale_sigma=WHEELS.scale,
    yaw_sigma_deg_per_m=WHEELS.yaw_deg_per_m,
    random_translation_per_sqrt_m=WHEELS.translation_per_sqrt_m,
    random_yaw_deg_per_sqrt_m=WHEELS.yaw_deg_per_sqrt_m,
)
NOISE = settings.odometry_noise(TOLD)
"""The sigmas that the simulated wheels have: the authors knew their robots. The column "drslamd" is
not told."""


@dataclass(frozen=True)
class Closures:
    """Of one pair: at pose times k (n,), a_T_b (n, 3), covariances (n, 3, 3)."""

    k: Array
    poses: Array
    covariances: Array

    def chosen(self, which: Array) -> Closures:
        return Closures(self.k[which], self.poses[which], self.covariances[which])


def timed(run: Callable[[], Array]) -> tuple[Array, float]:
    """A result and the milliseconds that it took."""
    start = time.perf_counter()
    result = run()
    return result, (time.perf_counter() - start) * 1e3


def nls(window: Window, seed: int) -> Array:
    """Equation 1 from an arbitrary first guess: the right distance, any bearing, any heading."""
    phi, theta = np.random.default_rng(seed).uniform(-np.pi, np.pi, 2)
    r = window.ranges[-1]
    guess = np.array([r * np.cos(phi), r * np.sin(phi), theta])
    a, b = window.a_points, window.b_points

    def error(pose: Array) -> Array:
        return np.asarray(algorithm_1.linear(pose[None], a, b, window.ranges)[0][0])

    def slope(pose: Array) -> Array:
        return np.asarray(algorithm_1.linear(pose[None], a, b, window.ranges)[1][0])

    return np.asarray(least_squares(error, guess, slope, method="lm").x)


def coarse(window: Window, delta: float) -> Array:
    """Algorithm 1 alone."""
    return algorithm_1.coarse_search(window.a_points, window.b_points, window.ranges, delta)


def closures(trial: Trial, pair: tuple[int, int], tau: int, ms: list[float]) -> Closures:
    """Coarse search and optimisation at every pose time; its times are added to `ms`."""
    found: list[tuple[int, Hypothesis]] = []
    for k in range(len(trial.truth[pair[0]])):
        window = trial.window(pair, k, tau)
        if window is None:
            continue
        start = time.perf_counter()
        estimate = algorithm_1.solve(window, SIGMA_R, DELTA)
        ms.append((time.perf_counter() - start) * 1e3)
        found += [(k, hypothesis) for hypothesis in estimate.hypotheses]
    return Closures(
        np.array([k for k, _ in found], dtype=np.int64),
        np.array([h.a_T_b for _, h in found]).reshape(-1, 3),
        np.array([h.covariance for _, h in found]).reshape(-1, 3, 3),
    )


def consistency(trial: Trial, pair: tuple[int, int], found: Closures) -> list[Array]:
    """Equation 2's squared lengths: row k against all closures before it."""
    a, b = (trial.odometry[robot] for robot in pair)
    a_sums, b_sums = growth(a), growth(b)
    # an epsilon near one makes no edges: only the lengths are wanted here
    checked = PairConsistency(NOISE, NOISE, 1 - 1e-9)
    for number, k in enumerate(found.k.tolist()):
        pose, covariance = found.poses[number], found.covariances[number]
        checked.add(Candidate(number, pose, covariance, a[k], b[k], a_sums[k], b_sums[k]))
    return [checked.distances(k) for k in range(len(found.k))]


def inliers(lengths: list[Array], epsilon: float) -> Array:
    """Numbers of the closures in the largest consistent set."""
    gate, graph = quantile3(1 - epsilon), IncrementalClique()
    for row in lengths:
        agrees = np.packbits(row <= gate, bitorder="little").tobytes()
        graph.add(int.from_bytes(agrees, "little"))
    return np.array(bits(graph.clique), dtype=np.int64)
