"""`optimizer.algorithm = "banded"`: every robot solves its whole group exactly.

What is replicated is small: keyframes condense the odometry to one pose a second, a range is one
number. Robots that hold the same measurements reach the same answer without exchanging any
iterate, so a lost message delays the answer and does not change it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from drslamd.conventions import Chain
from drslamd.slam.calibration.range_scatter import scatter_ratios
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.banded import banded_solver
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.factors import Numbering
from drslamd.slam.optimizer.problem import Calibration, Priors, Problem, Solution, range_errors
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.se2 import Array

YAW_PRIOR_FLOOR = 1e-4
"""rad/m; a prior of zero width would make the system singular."""
SCALE_TAILS = 3.0
"""The prior of the scale is Cauchy's, so many times narrower than its sigma (see
`RangeModel.bias_tails`)."""
HINT = 10.0**2
"""Variance, m^2 and rad^2, that closures get here. What they say is said better by the ranges that
they came from; but where those are missing nothing else holds the group together."""


@dataclass(frozen=True)
class BandedOptimizer:
    """Ranges and condensed odometry of the whole group, one banded solve.

    Attributes:
        bias_sigma: how far off the ranges of a pair may be, m.
        range_sigma: around that, as configured, m.
        scale_tails: see `SCALE_TAILS`.
        has_cauchy_priors: of biases and scales; else they are Gauss's.
        learns_scatter: is it looked how much ranges scatter?
    """

    bias_sigma: float
    range_sigma: float
    model: RangeModel = LINKTRACK
    scale_tails: float = SCALE_TAILS
    has_cauchy_priors: bool = True
    learns_scatter: bool = True

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job:
        """See `Optimizer.job`; public poses are not needed."""
        team = build_problem(graph, group, previous, self)
        return partial(_solve, team, group, self.range_sigma if self.learns_scatter else None)


@dataclass(frozen=True)
class TeamProblem:
    """A group as a problem, with the names behind its numbers.

    Attributes:
        start: calibration to start from.
        chains: of the robots that calibration numbers; pairs: that its biases number.
        places: of the keyframes.
    """

    problem: Problem
    start: Calibration
    chains: list[Chain]
    pairs: list[tuple[int, int]]
    places: Numbering


def build_problem(
    graph: PoseGraph, group: Group, previous: TeamEstimate | None, numbers: BandedOptimizer
) -> TeamProblem:
    """Number the group's poses by time and collect its factors."""
    places = factors.numbering(graph, group.members)
    robots = sorted({s.robot for s in group.members})
    chains = [graph.view.chains[robot] for robot in robots]
    ranges, pairs = factors.ranges(graph, places)
    closures = factors.closures(graph, places)
    hints = replace(closures, covariance=closures.covariance + HINT * np.eye(3))
    priors = Priors(
        bias=np.full(len(pairs), numbers.bias_sigma / numbers.model.bias_tails),
        scale=np.array([data.model.noise.scale for data in chains]) / numbers.scale_tails,
        yaw=np.array([max(data.model.noise.yaw_rad_per_m, YAW_PRIOR_FLOOR) for data in chains]),
        near_bias=np.array([numbers.model.near_bias_sigma_m]),
        has_cauchy_tails=numbers.has_cauchy_priors,
    )
    problem = Problem(
        robot=places.robot,
        n=places.n,
        initial=factors.initial_poses(graph, group, previous, places),
        gauge=factors.gauge_place(graph, group, places),
        odometry=factors.odometry(graph, places, robots),
        closures=hints.chosen(factors.sensible(hints.i, hints.j)),
        ranges=ranges.chosen(factors.sensible(ranges.i, ranges.j)),
        priors=priors,
        model=numbers.model,
    )
    start = _start(previous, pairs, robots) if previous else Calibration.zero(priors)
    return TeamProblem(problem, start, [data.chain for data in chains], pairs, places)


def _start(previous: TeamEstimate, pairs: list[tuple[int, int]], robots: list[int]) -> Calibration:
    """What the last solution learned."""
    return Calibration(
        bias=np.array([previous.bias_m.get(pair, Learned()).value for pair in pairs]),
        scale=np.array([previous.scale.get(robot, Learned()).value for robot in robots]),
        yaw=np.array([previous.yaw.get(robot, Learned()).value for robot in robots]),
        near_bias=np.array([previous.near_bias_m.value]),
    )


def _solve(team: TeamProblem, group: Group, range_sigma: float | None) -> TeamEstimate:
    """Solve, with the uncertainty of everybody's latest pose, and sort the answer by robot."""
    mine = {chain.robot: team.places.of_robot(chain.robot) for chain in team.chains}
    last = {robot: int(at[-1]) for robot, at in mine.items()}
    solution = banded_solver.solve(team.problem, team.start, tuple(last.values()))
    return TeamEstimate(
        frame=group.frame,
        trajectories={
            chain.robot: Trajectory(
                chain, team.problem.n[mine[chain.robot]], solution.poses[mine[chain.robot]]
            )
            for chain in team.chains
        },
        covariances={robot: solution.covariances[at] for robot, at in last.items()},
        **_learned(team, solution),
        scatter=_scatter(team, solution, range_sigma) if range_sigma else {},
        cost=solution.cost,
        iterations=solution.iterations,
        converged=solution.converged,
    )


def _scatter(
    team: TeamProblem, solution: Solution, range_sigma: float
) -> dict[tuple[int, int], float]:
    """How much the ranges of each pair scatter about the solution."""
    ranges = team.problem.ranges
    errors = range_errors(solution.poses, ranges, solution.calibration, team.problem.model)[0]
    ratios = scatter_ratios(
        errors,
        ranges.sigma,
        ranges.pair,
        pairs=len(team.pairs),
        configured=range_sigma,
        most_sigmas=team.problem.model.cauchy_sigmas,
    )
    return dict(zip(team.pairs, ratios.tolist(), strict=True))


def _learned(team: TeamProblem, solution: Solution) -> dict[str, Any]:
    """The sensors' constants by name, as `TeamEstimate` has them."""
    learned, spread, priors = solution.calibration, solution.spread, team.problem.priors
    assert spread is not None
    robots = [chain.robot for chain in team.chains]
    bias = _beside(learned.bias, spread.bias, priors.stiffness(learned.bias, priors.bias))
    scale = _beside(learned.scale, spread.scale, priors.stiffness(learned.scale, priors.scale))
    yaw = _beside(learned.yaw, spread.yaw, priors.yaw**-2.0)
    near_bias = _beside(learned.near_bias, spread.near_bias, priors.near_bias**-2.0)
    return {
        "bias_m": dict(zip(team.pairs, bias, strict=True)),
        "scale": dict(zip(robots, scale, strict=True)),
        "yaw": dict(zip(robots, yaw, strict=True)),
        "near_bias_m": near_bias[0],
    }


def _beside(values: Array, sigmas: Array, by_prior: Array) -> list[Learned]:
    """Values with the sigmas of what was measured of them, the information of priors taken out."""
    information = np.maximum(sigmas**-2.0 - by_prior, 1e-12)
    sigma = (information**-0.5).tolist()
    return [Learned(*pair) for pair in zip(values.tolist(), sigma, strict=True)]
