"""Problems for the optimisers of module 3, and the same problems as dense residuals."""

from __future__ import annotations

import math

import numpy as np
from slam_scenes import Array, inverted, product, wander

from drslamd.slam.optimizer.banded.layout import BandLayout
from drslamd.slam.optimizer.banded.normal_equations import GAUGE_SIGMA, System
from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    Calibration,
    CarriedEnds,
    OdometryFactors,
    Priors,
    Problem,
    RangeFactors,
)
from drslamd.slam.range_model import LINKTRACK


def random_covariance(rng: np.random.Generator, sigma: tuple[float, float, float]) -> Array:
    root = np.diag(sigma) @ (np.eye(3) + 0.3 * rng.normal(size=(3, 3)))
    return np.asarray(root @ root.T)


def pose_edges(
    rng: np.random.Generator,
    truth: Array,
    pairs: list[tuple[int, int]],
    sigma: tuple[float, float, float],
    error: float = 1.0,
) -> BetweenFactors:
    """Relative poses of pairs of true poses; `error` scales the noise that is drawn."""
    measured, covariances = [], []
    for i, j in pairs:
        covariance = random_covariance(rng, sigma)
        noise = rng.multivariate_normal(np.zeros(3), covariance)
        measured.append(product(inverted(truth[i]), truth[j]) + error * noise)
        covariances.append(covariance)
    i, j = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return BetweenFactors(i, j, np.reshape(measured, (-1, 3)), np.reshape(covariances, (-1, 3, 3)))


def no_ranges() -> RangeFactors:
    none = np.zeros(0, dtype=np.int64)
    return RangeFactors(
        none, none, np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), none
    )


def team_problem(
    seed: int,
    robots: int = 2,
    count: int = 12,
    biases: tuple[float, ...] = (0.0, 0.0, 0.0),
    scale: tuple[float, ...] = (0.0, 0.0, 0.0),
    yaw: tuple[float, ...] = (0.0, 0.0, 0.0),
    near_bias: float = 0.0,
    range_error: float = 0.05,
    link_error: float = 1.0,
    closures: int = 3,
    link_sigma: tuple[float, float, float] = (0.01, 0.01, 0.008),
) -> tuple[Problem, Array]:
    """Robots whose poses alternate in time, with every kind of edge; and the truth.

    Pose robots * k + r is keyframe k of robot r. Each pair has its ranges, between antennas off
    the middle, wrong by `near_bias` where they are near; neighbouring poses of a robot have their
    odometry, wrong by `scale` and `yaw`. Each third range was carried by such odometry.
    """
    rng = np.random.default_rng(seed)
    paths = [wander(rng, count, 0.4) for _ in range(robots)]
    truth = np.stack(paths, axis=1).reshape(-1, 3)
    chain = [
        (robots * k + r, robots * (k + 1) + r) for k in range(count - 1) for r in range(robots)
    ]
    odometry = pose_edges(rng, truth, chain, link_sigma, link_error)
    robot = odometry.i % robots
    path = np.hypot(odometry.measured[:, 0], odometry.measured[:, 1])
    measured = odometry.measured.copy()
    for k, r in enumerate(robot):
        bend = yaw[r] * path[k]
        x, y = (1 + scale[r]) * measured[k, :2]
        measured[k] = [x - bend / 2 * y, y + bend / 2 * x, measured[k, 2] + bend]
    by_yaw = np.stack([-path / 2 * measured[:, 1], path / 2 * measured[:, 0], path], axis=-1)
    odometry = OdometryFactors(odometry.i, odometry.j, measured, odometry.covariance, robot, by_yaw)
    names = [(a, b) for a in range(robots) for b in range(a + 1, robots)]
    rows = []
    q = rng.normal(0, 0.2, (robots, 2))
    for k in range(count):
        for number, (a, b) in enumerate(names):
            i, j = robots * k + a, robots * k + b
            ends = [product(truth[i], (*q[a], 0)), product(truth[j], (*q[b], 0))]
            distance = math.hypot(*(ends[1] - ends[0])[:2])
            measured_m = distance + biases[number]
            # the term is of what is measured, itself included
            for _ in range(30):
                measured_m = (
                    distance
                    + biases[number]
                    + near_bias * math.exp(-measured_m / LINKTRACK.near_reach_m)
                )
            rows.append((i, j, *q[a], *q[b], measured_m, number))
    table = np.reshape(rows, (-1, 8))
    ranges = RangeFactors(
        table[:, 0].astype(int),
        table[:, 1].astype(int),
        table[:, 2:4],
        table[:, 4:6],
        table[:, 6] + range_error * rng.normal(size=len(table)),
        np.full(len(table), 0.05),
        table[:, 7].astype(int),
        carried_ends(seed, table, robots, scale, yaw),
    )
    joined = [(robots * k, robots * k + 1) for k in np.linspace(1, count - 2, closures).astype(int)]
    priors = Priors(
        np.full(len(names), 0.3), np.full(robots, 0.03), np.full(robots, 0.01), np.full(1, 0.1)
    )
    start = truth + rng.normal(0, 0.03, truth.shape)
    problem = Problem(
        np.arange(len(truth)) % robots,
        np.arange(len(truth)) // robots,
        start,
        0,
        odometry,
        pose_edges(rng, truth, [(int(i), int(j)) for i, j in joined], (0.05, 0.05, 0.03)),
        ranges,
        priors,
    )
    return problem, truth


def carried_ends(
    seed: int,
    table: Array,
    robots: int,
    scale: tuple[float, ...],
    yaw: tuple[float, ...],
) -> CarriedEnds:
    """Each third range of a table (m, 6 or more) of i, j, q_i and q_j: how its points move; in the
    table they are made wrong by the constants of their robots."""
    rows = np.arange(1, len(table), 3)
    whose = table[rows, :2].astype(int) % robots
    moves = np.random.default_rng(seed).normal(0, [[1.0], [0.3]], (len(rows), 2, 2, 2))
    for row, (a, b), move in zip(rows, whose, moves, strict=True):
        for robot, at, by in ((a, slice(2, 4), move[0]), (b, slice(4, 6), move[1])):
            table[row, at] += yaw[robot] * by[0] + scale[robot] * by[1]
    return CarriedEnds(rows, whose, moves)


# ---- the same written once more, plainly -------------------------------------------------------


def unpacked(problem: Problem, x: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Poses, biases, scales, yaw rates and near-range bias of one vector of all unknowns."""
    count, priors = len(problem.initial), problem.priors
    ends = np.cumsum([3 * count, len(priors.bias), len(priors.scale), len(priors.yaw)])
    poses, bias, scale, yaw, near_bias = np.split(x, ends)
    return poses.reshape(-1, 3), bias, scale, yaw, near_bias


def packed(poses: Array, c: Calibration) -> Array:
    return np.concatenate([poses.ravel(), c.bias, c.scale, c.yaw, c.near_bias])


def residual_vector(problem: Problem, x: Array, robust: bool = True) -> Array:
    """Whose sum of squares is the cost, one residual after the other.

    Args:
        robust: ranges, biases and scales by the root of Cauchy's cost; otherwise by the error
            itself, which Gauss and Newton weigh by `range_weights`.
    """
    poses, bias, scale, yaw, near_bias = unpacked(problem, x)
    out: list[float] = []
    odometry = problem.odometry
    for m in range(len(odometry)):
        mx, my, mt = odometry.measured[m]
        s, bend = scale[odometry.robot[m]], yaw[odometry.robot[m]] * odometry.by_yaw[m]
        right = ((1 - s) * mx - bend[0], (1 - s) * my - bend[1], mt - bend[2])
        out += whitened(poses[odometry.i[m]], poses[odometry.j[m]], right, odometry.covariance[m])
    closures = problem.closures
    for m in range(len(closures)):
        ends = poses[closures.i[m]], poses[closures.j[m]]
        out += whitened(*ends, closures.measured[m], closures.covariance[m])
    r = problem.ranges
    arms = [[*r.q_i[m], *r.q_j[m]] for m in range(len(r))]
    for row, (a, b), ((a_yaw, a_scale), (b_yaw, b_scale)) in zip(
        r.carried.rows, r.carried.robots, r.carried.moves, strict=True
    ):
        for axis in range(2):
            arms[row][axis] -= yaw[a] * a_yaw[axis] + scale[a] * a_scale[axis]
            arms[row][2 + axis] -= yaw[b] * b_yaw[axis] + scale[b] * b_scale[axis]
    for m in range(len(r)):
        i, j = (
            product(poses[k], (*q, 0)) for k, q in ((r.i[m], arms[m][:2]), (r.j[m], arms[m][2:]))
        )
        wrong = bias[r.pair[m]] + near_bias[0] * math.exp(-r.measured[m] / LINKTRACK.near_reach_m)
        e = (math.hypot(*(j - i)[:2]) + wrong - r.measured[m]) / r.sigma[m]
        out.append(cauchy_root(e, LINKTRACK.cauchy_sigmas) if robust else e)
    for e in np.concatenate([bias / problem.priors.bias, scale / problem.priors.scale]):
        out.append(cauchy_root(e, 1.0) if robust else e)
    out += (yaw / problem.priors.yaw).tolist() + (near_bias / problem.priors.near_bias).tolist()
    out += ((poses[problem.gauge] - problem.initial[problem.gauge]) / GAUGE_SIGMA).tolist()
    return np.array(out)


def cauchy_root(e: float, c: float) -> float:
    """Whose square is c^2 log(1 + (e / c)^2)."""
    return math.copysign(c * math.sqrt(math.log1p((e / c) ** 2)), e)


def whitened(
    i: Array, j: Array, measured: Array | tuple[float, ...], covariance: Array
) -> list[float]:
    seen = product(inverted(i), j)
    error = np.array(
        [*(seen[:2] - np.array(measured[:2])), math.remainder(seen[2] - measured[2], 2 * math.pi)]
    )
    return list(np.linalg.solve(np.linalg.cholesky(covariance), error))


def range_weights(problem: Problem, x: Array) -> Array:
    """Cauchy's weight of every residual of `residual_vector`; 1 where there is none."""
    plain = residual_vector(problem, x, robust=False)
    first = 3 * (len(problem.odometry) + len(problem.closures))
    weights = np.ones(len(plain))
    part = slice(first, first + len(problem.ranges))
    weights[part] = 1 / (1 + (plain[part] / LINKTRACK.cauchy_sigmas) ** 2)
    loose = len(problem.priors.bias) + len(problem.priors.scale)
    sensors = slice(part.stop, part.stop + loose)
    weights[sensors] = 1 / (1 + plain[sensors] ** 2)
    return weights


def jacobian(problem: Problem, x: Array, robust: bool, h: float = 1e-6) -> Array:
    columns = []
    for k in range(len(x)):
        step = np.zeros(len(x))
        step[k] = h
        ahead, behind = (residual_vector(problem, x + s, robust) for s in (step, -step))
        columns.append((ahead - behind) / (2 * h))
    return np.stack(columns, axis=1)


def dense(system: System, layout: BandLayout) -> Array:
    """The whole matrix of a system in the order of `packed`."""
    n, b = layout.band, layout.border
    full = np.zeros((n + b, n + b))
    for d in range(len(system.band)):
        below = np.arange(n - d)
        full[below + d, below] = full[below, below + d] = system.band[d, : n - d]
    full[:n, n:], full[n:, :n], full[n:, n:] = system.border, system.border.T, system.corner
    order = np.concatenate(
        [layout.poses.ravel(), layout.bias, layout.scale, layout.yaw, layout.near_bias]
    )
    return np.asarray(full[np.ix_(order, order)])
