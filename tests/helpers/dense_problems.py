"""The cost of module 3 written once more, plainly: residuals, differences, dense matrices."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq, least_squares
from slam_scenes import Array

from drslamd.slam.optimizer.banded.assembly import FewEntries, LeanSystem, System
from drslamd.slam.optimizer.banded.layout import NOWHERE, BandLayout
from drslamd.slam.optimizer.banded.normal_equations import GAUGE_SIGMA
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration
from drslamd.slam.range_model import LINKTRACK

CUT = 2.5
"""Sigmas at which a range has half of its weight."""
TRACK, ANTENNA, MOST = 0.01, 0.02, 0.5
"""Half widths of what is believed of turns and antennas, a fraction and m, and their tails."""


def packed(poses: Array, c: Calibration, doubted: Doubted | None = None) -> Array:
    """All unknowns in one vector: poses, biases, scales, yaw rates, near-range and common bias,
    then the turns and antennas that are in doubt."""
    known = [poses.ravel(), c.bias, c.scale, c.yaw, c.near_bias, c.team_bias]
    if doubted is not None:
        known += [c.turn[doubted.track], c.antenna[doubted.antenna].ravel()]
    return np.concatenate(known)


def unpacked(problem: Problem, x: Array) -> tuple[Array, Calibration]:
    robots, doubted = len(problem.priors.scale), problem.doubted
    sizes = [3 * len(problem.initial), problem.pairs, robots, robots, 1, 1, doubted.track.sum()]
    poses, *sensors, turns, antennas = np.split(x, np.cumsum(sizes))
    turn, antenna = np.zeros(robots), np.zeros((robots, 2))
    turn[doubted.track], antenna[doubted.antenna] = turns, antennas.reshape(-1, 2)
    bias, scale, yaw, near, team = sensors
    return poses.reshape(-1, 3), Calibration(bias, scale, yaw, near, team, turn, antenna)


def point_at(problem: Problem, poses: Array, c: Calibration, threshold: Array) -> Point:
    """A point where ranges lose weight at thresholds of the test's own."""
    return replace(Point.of(problem, poses, c), threshold=threshold)


def link_residuals(problem: Problem, x: Array) -> list[float]:
    """Three of each link of odometry, then three of each closure, over their sigmas."""
    poses, c = unpacked(problem, x)
    links, closures = problem.odometry, problem.closures
    right = links.measured.copy()
    for m, robot in enumerate(links.robot):
        right[m] += c.turn[robot] * links.by_turn[m]
        right[m, :2] *= 1 - c.scale[robot]
        right[m] -= c.yaw[robot] * links.by_yaw[m]
    return [
        *whitened(poses[links.i], poses[links.j], right, links.covariance),
        *whitened(poses[closures.i], poses[closures.j], closures.measured, closures.covariance),
    ]


def whitened(i: Array, j: Array, measured: Array, covariance: Array) -> list[float]:
    """Of poses i, j (m, 3), what was measured between them (m, 3) and its covariances."""
    cos, sin = np.cos(i[:, 2]), np.sin(i[:, 2])
    dx, dy, turn = (j - i).T
    ahead, left = cos * dx + sin * dy, cos * dy - sin * dx
    error = np.stack([ahead, left, turn], axis=1) - measured
    error[:, 2] = np.angle(np.exp(1j * error[:, 2]))
    roots = np.linalg.cholesky(covariance)
    return [float(v) for v in np.linalg.solve(roots, error[..., None]).ravel()]


def range_residuals(problem: Problem, x: Array) -> list[float]:
    """One of each range, over its sigma."""
    poses, c = unpacked(problem, x)
    r = problem.ranges
    points = np.stack([r.q_i, r.q_j])
    for row, moves in zip(r.carried.rows, r.carried.moves, strict=True):
        for end, robot in enumerate(r.robots[row]):
            points[end, row] -= c.yaw[robot] * moves[end, 0] + c.scale[robot] * moves[end, 1]
    ends = []
    for end, (k, q) in enumerate(zip((r.i, r.j), points, strict=True)):
        beside = rotated(c.antenna[r.robots[:, end]], r.turned[:, end])
        ends.append(poses[k, :2] + rotated(q + beside, poses[k, 2]))
    distance = np.hypot(*(ends[1] - ends[0]).T)
    near = c.near_bias[0] * np.exp(-distance / LINKTRACK.near_reach_m)
    seen = distance + c.bias[r.pair] + near
    return [float(v) for v in (seen - r.measured) / r.sigma]


def rotated(q: Array, angle: Array) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * q[:, 0] - sin * q[:, 1], sin * q[:, 0] + cos * q[:, 1]], axis=1)


def cauchy_root(e: float, c: float) -> float:
    """Whose square is c^2 log(1 + (e / c)^2)."""
    return math.copysign(c * math.sqrt(math.log1p((e / c) ** 2)), e)


def student_roots(own: Array, spread: float, dof: float) -> Array:
    """Whose squares come to (dof + n) log(1 + |own|^2 / (dof spread^2)), smooth where own is 0."""
    squares, width = float(own @ own), dof * spread**2
    if squares < 1e-20:
        return own * math.sqrt((dof + len(own)) / width)
    return np.asarray(own * math.sqrt((dof + len(own)) * math.log1p(squares / width) / squares))


def gaussian_residuals(problem: Problem, x: Array) -> list[float]:
    """Of near-range bias and gauge."""
    poses, c = unpacked(problem, x)
    moved = poses[problem.gauge] - problem.initial[problem.gauge]
    priors = problem.priors
    parts = [c.near_bias / priors.near_bias, moved / GAUGE_SIGMA]
    return [float(v) for v in np.concatenate(parts)]


def heavy_residuals(problem: Problem, x: Array) -> list[float]:
    """Of biases, scales and yaw rates, whose priors have heavy tails."""
    _, c = unpacked(problem, x)
    prior, team = problem.priors.bias, float(c.team_bias[0])
    own = c.bias - team
    out = [*student_roots(own, prior.spread, prior.dof), *(own / prior.sigma)]
    out += [cauchy_root(team / prior.team, 1.0), team / prior.sigma]
    for value, sigma in zip(c.scale, problem.priors.scale, strict=True):
        out.append(cauchy_root(value * problem.priors.scale_tails / sigma, 1.0))
    out += [
        cauchy_root(value / sigma, 1.0)
        for value, sigma in zip(c.yaw, problem.priors.yaw, strict=True)
    ]
    return [float(v) for v in out]


def mounting_residuals(problem: Problem, x: Array) -> list[float]:
    """Of turns and antennas, Cauchy's of one and of two components, with Gauss's tails."""
    _, c = unpacked(problem, x)
    out = []
    for values, width in ((c.turn[:, None], TRACK), (c.antenna, ANTENNA)):
        for value in values:
            # half of what Student's distribution of one degree of freedom costs
            out += [*(student_roots(value, width, 1.0) / math.sqrt(2)), *(value / MOST)]
    return [float(v) for v in out]


def residual_vector(problem: Problem, x: Array, threshold: Array) -> Array:
    """Whose sum of squares is the cost, one residual after the other."""
    c = threshold[problem.ranges.pair]
    ranges = [cauchy_root(*pair) for pair in zip(range_residuals(problem, x), c, strict=True)]
    parts = link_residuals(problem, x) + ranges
    parts += heavy_residuals(problem, x) + mounting_residuals(problem, x)
    return np.array(parts + gaussian_residuals(problem, x))


def jacobian(f: Callable[[Array], Array | list[float]], x: Array, h: float = 1e-6) -> Array:
    """(m, len(x)) by central differences."""
    columns = []
    for k in range(len(x)):
        step = np.zeros(len(x))
        step[k] = h
        columns.append((np.asarray(f(x + step)) - np.asarray(f(x - step))) / (2 * h))
    return np.stack(columns, axis=1)


def second(f: Callable[[float], float], e: float, h: float = 1e-3) -> float:
    """The second derivative of a function of one number."""
    return (f(e + h) - 2 * f(e) + f(e - h)) / h**2


def curvature_of(f: Callable[[Array], float], x: Array, h: float = 3e-5) -> Array:
    """Half the second derivative of a smooth function of a few numbers."""
    n = len(x)
    out = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            a, b = h * np.eye(n)[i], h * np.eye(n)[j]
            out[i, j] = (f(x + a + b) - f(x + a - b) - f(x - a + b) + f(x - a - b)) / (8 * h**2)
    return out


def heavy_curvature(problem: Problem, x: Array) -> Array:
    """Of the priors of biases, scales and yaw rates, over all unknowns; where the cost of a yaw
    rate bends by less than a tenth of the square that pulls as it does, by that."""
    first = 3 * len(problem.initial)
    sensors = np.arange(first, first + problem.pairs + 2 * len(problem.priors.scale) + 2)

    def cost(values: Array) -> float:
        moved = x.copy()
        moved[sensors] = values
        residuals = np.array(heavy_residuals(problem, moved))
        return float(residuals @ residuals)

    out = np.zeros((len(x), len(x)))
    out[np.ix_(sensors, sensors)] = curvature_of(cost, x[sensors])
    yaws = yaw_places(problem)
    out[yaws, yaws] = np.maximum(out[yaws, yaws], 0.1 * yaw_weights(problem, x))
    return out


def mounting_curvature(problem: Problem, x: Array) -> Array:
    """Of the priors of turns and antennas, over all unknowns."""
    doubted = problem.doubted
    mountings = np.arange(len(x) - doubted.track.sum() - 2 * doubted.antenna.sum(), len(x))

    def cost(values: Array) -> float:
        residuals = np.array(mounting_residuals(problem, np.append(x[: mountings[0]], values)))
        return float(residuals @ residuals)

    out = np.zeros((len(x), len(x)))
    if len(mountings):
        out[np.ix_(mountings, mountings)] = curvature_of(cost, x[mountings])
    return out


def information_of(problem: Problem, x: Array, of_range: Array) -> Array:
    """Of links, closures, ranges and Gauss's priors, as Gauss and Newton have it.

    Args:
        of_range: (n,) weights of the ranges.
    """
    j_links = jacobian(lambda v: link_residuals(problem, v), x)
    j_ranges = jacobian(lambda v: range_residuals(problem, v), x)
    j_priors = jacobian(lambda v: gaussian_residuals(problem, v), x)
    information = j_links.T @ j_links + j_priors.T @ j_priors
    return np.asarray(information + j_ranges.T @ (of_range[:, None] * j_ranges))


def range_weights(problem: Problem, x: Array, threshold: Array) -> Array:
    """Cauchy's weight of each range."""
    errors = np.array(range_residuals(problem, x))
    return np.asarray(1 / (1 + (errors / threshold[problem.ranges.pair]) ** 2))


def claimed_information(problem: Problem, x: Array, threshold: Array, claims: Array) -> Array:
    """Ranges so many times less certain, and every prior as wide as configured; but those of
    mountings are as they are believed, a yaw rate is as uncertain as it is far off, and biases may
    be held beside what they have in common."""
    weights = range_weights(problem, x, threshold) / claims[problem.ranges.pair] ** 2
    information = information_of(problem, x, weights) + mounting_curvature(problem, x)
    biases, scales = bias_places(problem), scale_places(problem)
    information[biases, biases] += problem.priors.bias.sigma**-2
    apart = np.column_stack([np.eye(problem.pairs), -np.ones(problem.pairs)])
    alike = apart.T @ apart / problem.priors.bias.own_sigma**2
    information[np.ix_(biases, biases)] += alike
    information[scales, scales] += problem.priors.scale**-2.0
    yaws = yaw_places(problem)
    information[yaws, yaws] += yaw_weights(problem, x)
    return information


def learned_information(problem: Problem, x: Array, threshold: Array, claims: Array) -> Array:
    """The same, but that biases resemble each other."""
    information = claimed_information(problem, x, threshold, claims)
    biases = bias_places(problem)
    information[biases, biases] -= problem.priors.bias.sigma**-2
    at = np.ix_(biases, biases)
    information[at] += heavy_curvature(problem, x)[at]
    return information


def bias_places(problem: Problem) -> Array:
    """Of the bias of each pair and of what is common, in the order of `packed`."""
    first = 3 * len(problem.initial)
    team = first + problem.pairs + 2 * len(problem.priors.scale) + 1
    return np.array([*range(first, first + problem.pairs), team])


def scale_places(problem: Problem) -> Array:
    first = 3 * len(problem.initial) + problem.pairs
    return np.arange(first, first + len(problem.priors.scale))


def yaw_places(problem: Problem) -> Array:
    return scale_places(problem) + len(problem.priors.scale)


def yaw_weights(problem: Problem, x: Array) -> Array:
    """Of the square that pulls a yaw rate as Cauchy's cost does."""
    return np.asarray(1 / (problem.priors.yaw**2 + x[yaw_places(problem)] ** 2))


def link_misfit(problem: Problem, x: Array, threshold: Array) -> tuple[Array, Array]:
    """(m,) of each link of odometry: its squares, and how far the rest could check it."""
    information = information_of(problem, x, range_weights(problem, x, threshold))
    information += heavy_curvature(problem, x) + mounting_curvature(problem, x)
    covariance = np.linalg.inv(information)
    m = len(problem.odometry)
    errors = np.array(link_residuals(problem, x))[: 3 * m].reshape(m, 3)
    ways = jacobian(lambda v: link_residuals(problem, v)[: 3 * m], x).reshape(m, 3, -1)
    seen = np.array([np.trace(way @ covariance @ way.T) for way in ways])
    return np.sum(errors**2, axis=1), 3 - seen


def thresholds(problem: Problem, x: Array) -> Array:
    """(pairs,) where the ranges of each pair lose weight: 2.5 times what inliers scatter.

    With the squared weights w of Cauchy, scatter^2 (20 + sum w) = 20 + 1.5 sum w z^2, at least
    0.3 and at most 1.
    """
    z = np.array(range_residuals(problem, x))
    out = []
    for pair in range(problem.pairs):
        squares = z[problem.ranges.pair == pair] ** 2

        def excess(s: float, squares: Array = squares) -> float:
            w = (1 + squares / (CUT * s) ** 2) ** -2
            return float(s**2 * (20 + w.sum()) - 20 - 1.5 * (w * squares).sum())

        out.append(1.0 if excess(1.0) < 0 else brentq(excess, 1e-3, 1.0))
    return CUT * np.maximum(out, 0.3)


def dense_solution(problem: Problem) -> tuple[Array, Array]:
    """The unknowns and thresholds that go together, by scipy, from the same poses."""
    robots = len(problem.priors.scale)
    x = packed(problem.initial, Calibration.zero(problem.pairs, robots), problem.doubted)
    for _ in range(12):
        c = thresholds(problem, x)
        found = least_squares(
            lambda v, c=c: residual_vector(problem, v, c), x, method="lm", xtol=1e-14, ftol=1e-14
        )
        moved = np.abs(found.x - x).max()
        x = np.asarray(found.x)
        if moved < 1e-8:
            break
    return x, thresholds(problem, x)


def dense(system: System, layout: BandLayout) -> Array:
    """The whole matrix of a system in the order of `packed`."""
    order = places(layout)
    return np.asarray(matrix_of(system)[np.ix_(order, order)])


def lean(system: System) -> LeanSystem:
    """The same, with those entries that are not zero."""
    band, border = _few(system.band.T), _few(system.border)
    return LeanSystem(band, border, system.corner, np.zeros(len(system.border)))


def _few(full: Array) -> FewEntries:
    row, column = np.nonzero(full)
    return FewEntries.of(row, column, full[row, column], full.shape)


def matrix_of(system: System) -> Array:
    """The whole matrix of a system, band first."""
    n, b = system.border.shape
    full = np.zeros((n + b, n + b))
    for d in range(len(system.band)):
        below = np.arange(n - d)
        full[below + d, below] = full[below, below + d] = system.band[d, : n - d]
    full[:n, n:], full[n:, :n], full[n:, n:] = system.border, system.border.T, system.corner
    return full


def places(layout: BandLayout) -> Array:
    """Where the unknowns of `packed` stand in a layout."""
    sensors = [layout.bias, layout.scale, layout.yaw, layout.near_bias, layout.team_bias]
    mountings = np.concatenate([layout.turn, layout.antenna.ravel()])
    known = mountings[mountings != NOWHERE]
    return np.concatenate([layout.poses.ravel(), *sensors, known])


def known_exactly(problem: Problem) -> Problem:
    """Whose sensors are told to have no constant errors."""
    prior = problem.priors
    nothing = replace(
        prior,
        bias=replace(prior.bias, sigma=1e-9),
        scale=np.full(len(prior.scale), 1e-9),
        yaw=np.full(len(prior.yaw), 1e-9),
        near_bias=1e-9,
    )
    return replace(problem, priors=nothing)
