"""`optimizer.algorithm = "banded"`: every robot solves its whole group exactly.

What is replicated is small: keyframes condense the odometry to one pose a second, a range is one
number. Robots that hold the same items reach the same answer without exchanging any iterate, so a
lost message delays the answer and does not change it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from drslamd.config import Config
from drslamd.conventions import Chain
from drslamd.slam.calibration.range_scatter import scatter_ratios
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import PublicPoses
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.banded import banded_solver
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.problem import Calibration, Priors, Problem, range_errors
from drslamd.slam.se2 import Array

YAW_PRIOR_FLOOR = 1e-4
"""rad/m; a prior of zero width would make the system singular."""
NEAR_BIAS_SIGMA_M = 0.05
"""Makers correct most of what receivers misjudge of strong signals; what they leave is as large as
other things that move a bias (`self_calibration.LEAST_BIAS_M`). Gauss's tails: with those that
biases have, the two trade metres against each other where ranges vary little."""
CAUCHY_TAILS = 3.0
"""Half widths of Cauchy's distribution within which four of five values lie."""
HINT = 10.0**2
"""Variance, m^2 and rad^2, that closures get here. What they say is said better by the ranges that
they came from; but where those are missing nothing else holds the group together."""


class BandedOptimizer:
    """Ranges and condensed odometry of the whole group, one banded solve."""

    def __init__(self, config: Config, own: Chain) -> None:
        self._bias_sigma = config.relative_pose.range_bias_sigma_m
        self._range_sigma = config.relative_pose.range_sigma_m

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job:
        """See `Optimizer.job`; public poses are not needed."""
        team = build_problem(graph, group, previous, self._bias_sigma)
        return partial(_solve, team, group, self._range_sigma)


@dataclass(frozen=True)
class TeamProblem:
    """A group as a problem, with the names behind its numbers.

    Attributes:
        start: calibration to start from.
        chains: of the robots that calibration numbers; pairs: that its biases number.
    """

    problem: Problem
    start: Calibration
    chains: list[Chain]
    pairs: list[tuple[int, int]]


def build_problem(
    graph: PoseGraph, group: Group, previous: TeamEstimate | None, bias_sigma: float
) -> TeamProblem:
    """Number the group's poses by time and collect its edges.

    Args:
        bias_sigma: how far off a pair's ranges may be, m.
    """
    numbers = factors.numbering(graph, group.members, group.shift_us)
    robots = sorted({s.robot for s in group.members})
    ranges, pairs = factors.ranges(graph, numbers)
    chains = [graph.chains[robot] for robot in robots]
    priors = Priors(
        np.full(len(pairs), bias_sigma / CAUCHY_TAILS),
        np.array([items.noise.scale for items in chains]) / CAUCHY_TAILS,
        np.array([max(items.noise.yaw_rad_per_m, YAW_PRIOR_FLOOR) for items in chains]),
        np.array([NEAR_BIAS_SIGMA_M]),
    )
    start = Calibration.zero(priors)
    if previous:
        start = Calibration(
            np.array([previous.bias_m.get(pair, Learned()).value for pair in pairs]),
            np.array([previous.scale.get(robot, Learned()).value for robot in robots]),
            np.array([previous.yaw.get(robot, Learned()).value for robot in robots]),
            np.array([previous.near_bias_m.value]),
        )
    initial = np.zeros((len(numbers.n), 3))
    for segment, poses in team_frame.placed(graph, group, previous).items():
        rows = graph.chains[segment.robot].rows_of(segment.segment)
        initial[numbers.place[segment.robot][rows]] = poses
    first = graph.segment_rows(group.frame)[0, 0]
    gauge = int(numbers.of(graph.chains[group.frame.robot], np.array([first]))[0])
    closures = factors.closures(graph, numbers)
    hints = replace(closures, covariance=closures.covariance + HINT * np.eye(3))
    problem = Problem(
        numbers.robot, numbers.n, initial, gauge, factors.links(graph, numbers, robots),
        hints.chosen(factors.sensible(hints.i, hints.j)),
        ranges.chosen(factors.sensible(ranges.i, ranges.j)), priors,
    )  # fmt: skip
    return TeamProblem(problem, start, [items.chain for items in chains], pairs)


def _solve(team: TeamProblem, group: Group, range_sigma: float) -> TeamEstimate:
    """Solve, with the uncertainty of everybody's latest pose, and sort the answer by robot."""
    problem = team.problem
    mine: dict[int, Array] = {}
    for chain in team.chains:
        at = np.flatnonzero(problem.robot == chain.robot)
        mine[chain.robot] = at[np.argsort(problem.n[at], kind="stable")]
    last = {robot: int(at[-1]) for robot, at in mine.items()}
    solution = banded_solver.solve(problem, team.start, tuple(last.values()))
    robots = [chain.robot for chain in team.chains]
    learned, spread, priors = solution.calibration, solution.spread, problem.priors
    assert spread is not None
    ranges = problem.ranges
    errors = range_errors(solution.poses, ranges, learned)[0]
    scatters = scatter_ratios(
        errors, ranges.sigma, ranges.pair, len(team.pairs), range_sigma
    ).tolist()
    return TeamEstimate(
        group.frame,
        {
            chain.robot: Trajectory(
                chain, problem.n[mine[chain.robot]], solution.poses[mine[chain.robot]]
            )
            for chain in team.chains
        },
        {robot: solution.covariances[at] for robot, at in last.items()},
        dict(zip(team.pairs, _loosely(learned.bias, spread.bias, priors.bias), strict=True)),
        dict(zip(robots, _loosely(learned.scale, spread.scale, priors.scale), strict=True)),
        dict(zip(robots, _measured(learned.yaw, spread.yaw, priors.yaw**-2.0), strict=True)),
        dict(zip(team.pairs, scatters, strict=True)),
        solution.cost,
        solution.iterations,
        solution.converged,
        near_bias_m=_measured(learned.near_bias, spread.near_bias, priors.near_bias**-2.0)[0],
    )


def _loosely(values: Array, sigmas: Array, prior: Array) -> list[Learned]:
    """`_measured` of what Cauchy's prior held."""
    return _measured(values, sigmas, 1 / (prior**2 * (1 + (values / prior) ** 2)))


def _measured(values: Array, sigmas: Array, by_prior: Array) -> list[Learned]:
    """Values with the sigmas of what was measured of them, the information of priors taken out."""
    information = np.maximum(sigmas**-2.0 - by_prior, 1e-12)
    sigma = (information**-0.5).tolist()
    return [Learned(*pair) for pair in zip(values.tolist(), sigma, strict=True)]
