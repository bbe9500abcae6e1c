"""Problems for the optimisers of module 3."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from slam_scenes import Array, inverted, product, wander

from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.bias_prior import BiasPrior
from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    CarriedEnds,
    Doubted,
    OdometryFactors,
    Problem,
    RangeFactors,
)
from drslamd.slam.optimizer.sensor_priors import Calibration, Priors
from drslamd.slam.range_model import LINKTRACK

BIAS = BiasPrior(sigma=0.6, spread=0.3, dof=3.0, team=0.1)
"""So wide that the biases of these problems are found."""
IDS = (2, 3, 7, 40, 200, 201)
"""Of robots 0 to 5: who is whose number is found out by tests whose ids are not numbers."""
CLOCKS = (20_000, 50_000, 10_000, 40_000)
"""Steps of the grid at which the clocks of the robots begin; a keyframe is ten steps long."""


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
        none,
        none,
        np.zeros((0, 2)),
        np.zeros((0, 2)),
        np.zeros(0),
        np.zeros(0),
        none,
        np.zeros((0, 2), dtype=np.int64),
        np.zeros((0, 2)),
    )


def team_problem(
    seed: int,
    robots: int = 2,
    count: int = 12,
    biases: tuple[float, ...] = (0.0,) * 6,
    scale: tuple[float, ...] = (0.0,) * 4,
    yaw: tuple[float, ...] = (0.0,) * 4,
    near_bias: float = 0.0,
    range_error: float = 0.05,
    link_error: float = 1.0,
    closures: int = 3,
    link_sigma: tuple[float, float, float] = (0.01, 0.01, 0.008),
    is_thinned: bool = False,
) -> tuple[Problem, Array]:
    """Robots whose poses alternate in time, with every kind of edge; and the truth.

    Pose robots * k + r is keyframe k of robot r, one a second on a clock of its own. Each pair has
    its ranges, between antennas off the middle, wrong by `near_bias` where they are near;
    neighbouring poses of a robot have their odometry, wrong by `scale` and `yaw`. Of a thinned
    problem each third link was driven in bows, and each third range was carried by such odometry.
    """
    rng = np.random.default_rng(seed)
    paths = [wander(rng, count, 0.4) for _ in range(robots)]
    truth = np.stack(paths, axis=1).reshape(-1, 3)
    chain = [
        (robots * k + r, robots * (k + 1) + r) for k in range(count - 1) for r in range(robots)
    ]
    odometry = pose_edges(rng, truth, chain, link_sigma, link_error)
    robot = odometry.i % robots
    bows = np.random.default_rng(seed).normal(0, 0.1, (2, len(chain), 3))
    bows[:, (np.arange(len(chain)) % 3 > 0) | (not is_thinned)] = 0.0
    measured = odometry.measured.copy()
    measured[:, :2] *= 1 + np.array(scale)[robot, None]
    by_yaw = straight_by_yaw(measured) + bows[0]
    measured += np.array(yaw)[robot, None] * by_yaw
    odometry = OdometryFactors(
        odometry.i,
        odometry.j,
        measured,
        odometry.covariance,
        robot,
        by_yaw=by_yaw,
        by_turn=straight_by_turn(measured) + bows[1],
    )
    names = [(a, b) for a in range(robots) for b in range(a + 1, robots)]
    rows = []
    q = rng.normal(0, 0.2, (robots, 2))
    for k in range(count):
        for number, (a, b) in enumerate(names):
            i, j = robots * k + a, robots * k + b
            ends = [product(truth[i], (*q[a], 0)), product(truth[j], (*q[b], 0))]
            distance = math.hypot(*(ends[1] - ends[0])[:2])
            near = near_bias * math.exp(-distance / LINKTRACK.near_reach_m)
            measured_m = distance + biases[number] + near
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
        table[:, :2].astype(int) % robots,
        np.zeros((len(table), 2)),
        carried_ends(seed, table, robots, scale, yaw) if is_thinned else CarriedEnds.none(),
    )
    joined = [(robots * k, robots * k + 1) for k in np.linspace(1, count - 2, closures).astype(int)]
    priors = Priors(
        bias=BIAS,
        scale=np.full(robots, 0.06),
        scale_tails=2.0,
        yaw=np.full(robots, 0.01),
        near_bias=0.1,
    )
    start = truth + rng.normal(0, 0.03, truth.shape)
    which = np.arange(len(truth)) % robots
    problem = Problem(
        robot_id=np.array(IDS)[which],
        n=np.array(CLOCKS)[which] + 10 * (np.arange(len(truth)) // robots),
        initial=start,
        gauge=0,
        pairs=len(names),
        odometry=odometry,
        closures=pose_edges(rng, truth, [(int(i), int(j)) for i, j in joined], (0.05, 0.05, 0.03)),
        ranges=ranges,
        priors=priors,
        doubted=Doubted.none(robots),
        range_sigma=0.05,
    )
    return problem, truth


def straight_by_yaw(measured: Array) -> Array:
    """(m, 3) how straight links move with a yaw rate: each swings about its middle."""
    x, y, _ = measured.T
    way = np.hypot(x, y)
    return np.stack([-way / 2 * y, way / 2 * x, way], axis=-1)


def straight_by_turn(measured: Array) -> Array:
    """(m, 3) how straight links move when turns are longer by a fraction."""
    x, y, turn = measured.T
    return np.stack([-turn / 2 * y, turn / 2 * x, turn], axis=-1)


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
    moves = np.random.default_rng(seed).normal(0, [[1.0], [0.3]], (len(rows), 2, 2, 2))
    for row, move in zip(rows, moves, strict=True):
        for end, at in enumerate((slice(2, 4), slice(4, 6))):
            robot = int(table[row, end]) % robots
            table[row, at] += yaw[robot] * move[end, 0] + scale[robot] * move[end, 1]
    return CarriedEnds(rows, moves)


def links_of(problem: Problem, robot: int, first: int, last: int) -> Array:
    """The links of a robot that begin at its keyframes from `first` to before `last`."""
    robots = len(problem.priors.scale)
    k = problem.odometry.i // robots
    return np.flatnonzero((problem.odometry.robot == robot) & (k >= first) & (k < last))


def mismeasured(
    problem: Problem, links: Array, measured: Array, sigma: float | None = None
) -> Problem:
    """A problem some of whose links of odometry say something else, with so much certainty."""
    odometry = problem.odometry
    poses, covariance = odometry.measured.copy(), odometry.covariance.copy()
    poses[links] = measured
    if sigma is not None:
        covariance[links] = sigma**2 * np.eye(3)
    by_yaw, by_turn = odometry.by_yaw.copy(), odometry.by_turn.copy()
    by_yaw[links], by_turn[links] = straight_by_yaw(poses[links]), straight_by_turn(poses[links])
    wrong = replace(odometry, measured=poses, covariance=covariance, by_yaw=by_yaw, by_turn=by_turn)
    return replace(problem, odometry=wrong)


def stuck(problem: Problem, robot: int, first: int, last: int) -> Problem:
    """Wheels that measure no way for some seconds, and no way has no noise."""
    return mismeasured(problem, links_of(problem, robot, first, last), np.zeros(3), 5e-4)


def slipping(problem: Problem, robot: int, first: int, last: int) -> Problem:
    """Wheels that turn two and a half times as fast as the robot drives."""
    links = links_of(problem, robot, first, last)
    return mismeasured(problem, links, problem.odometry.measured[links] * [2.5, 2.5, 1])


def mismounted(
    problem: Problem,
    truth: Array,
    turn: tuple[float, ...] | None = None,
    antenna: tuple[tuple[float, float], ...] | None = None,
    turned_sigma: float = 0.0,
) -> Problem:
    """Robots whose mountings are not as configured.

    Args:
        turn: of each robot, by which fraction its turns are longer than its wheels say.
        antenna: of each robot, where its antenna is beside the place that is said, m.
        turned_sigma: ranges are measured where robots stand turned against their keyframes, rad.
    """
    robots = len(problem.priors.scale)
    fraction = np.array(turn or (0.0,) * robots)[problem.odometry.robot]
    by_turn = problem.odometry.by_turn / (1 + fraction[:, None])
    measured = problem.odometry.measured - fraction[:, None] * by_turn
    odometry = replace(problem.odometry, measured=measured, by_turn=by_turn)
    r, beside = problem.ranges, np.array(antenna or ((0.0, 0.0),) * robots)
    turned = np.random.default_rng(5).normal(0, turned_sigma, r.turned.shape)
    said, seen, real = [], [], []
    for m in range(len(r)):
        for end, (k, q) in enumerate(((r.i[m], r.q_i[m]), (r.j[m], r.q_j[m]))):
            there = (0.0, 0.0, turned[m, end])
            said.append(product(there, (*q, 0.0))[:2])
            seen.append(product(truth[k], (*q, 0.0))[:2])
            place = (*(q + beside[r.robots[m, end]]), 0.0)
            real.append(product(truth[k], there, place)[:2])
    q_ends, before, after = (np.reshape(v, (-1, 2, 2)) for v in (said, seen, real))
    lengths = [np.hypot(*(v[:, 1] - v[:, 0]).T) for v in (before, after)]
    ranges = replace(
        r,
        q_i=q_ends[:, 0],
        q_j=q_ends[:, 1],
        turned=turned,
        measured=r.measured - lengths[0] + lengths[1],
    )
    return replace(problem, odometry=odometry, ranges=ranges)


def held_at(problem: Problem, truth: Array) -> Problem:
    """The same, its gauge at the true place, so that solutions can be compared with the truth."""
    start = problem.initial.copy()
    start[problem.gauge] = truth[problem.gauge]
    return replace(problem, initial=start)


def errs(sigmas: Array, pair: Array | None = None) -> tuple[Problem, Point]:
    """Ranges between robots that stand, so many sigmas too long, one a second."""
    problem, _ = team_problem(4, robots=3, count=len(sigmas))
    pair = np.zeros(len(sigmas), dtype=int) if pair is None else pair
    rows = 3 * np.arange(len(sigmas)) + pair
    ranges = problem.ranges.chosen(np.isin(np.arange(len(problem.ranges)), rows))
    problem = replace(problem, ranges=ranges)
    nothing = Calibration.zero(3, 3)
    apart = Point.of(problem, problem.initial, nothing).sight.error
    right = ranges.measured + apart + sigmas * ranges.sigma
    problem = replace(problem, ranges=replace(ranges, measured=right))
    return problem, Point.of(problem, problem.initial, nothing)
