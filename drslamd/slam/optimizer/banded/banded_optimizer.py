"""`optimizer.algorithm = "banded"`: every robot solves its whole group exactly.

What is replicated is small: keyframes condense the odometry to one pose a second, a range is one
number. Robots that hold the same measurements reach the same answer without exchanging any
iterate, so a lost message delays the answer and does not change it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import compress
from typing import TypeVar

import numpy as np

from drslamd.conventions import Chain, is_node
from drslamd.slam.graph import standing_points
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.optimizer import factors, mirror_factors, near_pairs, range_weights, valleys
from drslamd.slam.optimizer.banded import banded_solver
from drslamd.slam.optimizer.banded.banded_solver import SETTLED
from drslamd.slam.optimizer.banded.lapses.known_lapses import freed_again, lapse_of
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE
from drslamd.slam.optimizer.banded.pairs.narrowing import narrower
from drslamd.slam.optimizer.banded.solution import Solution
from drslamd.slam.optimizer.bias_prior import BiasPrior
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.factors import Numbering
from drslamd.slam.optimizer.problem import Doubted, Problem
from drslamd.slam.optimizer.sensor_priors import Calibration, Priors
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.se2 import Array, Index

Name = TypeVar("Name")
Solver = Callable[["TeamProblem", tuple[int, ...], float, object], tuple[Solution, object]]
"""Solves a team's problem: poses whose joint covariance is wanted, the tolerance, and what came of
the solution before; and what comes of this one."""

YAW_PRIOR_FLOOR = 1e-4
"""rad/m; a prior of zero width would make the system singular."""
SCALE_TAILS = 3.0
"""The prior of the scale is Cauchy's, so many times narrower than its sigma: four of five values of
that distribution lie within three half widths. Most wheels are measured to a percent, some not at
all."""
AS_CONFIGURED = (Learned(), Learned())
"""An antenna that is where it is said to be."""
HINT = 10.0**2
"""Variance, m^2 and rad^2, that closures get here. What they say is said better by the ranges that
they came from; but where those are missing nothing else holds the group together."""


MANY_NEW = 5
"""So many keyframes of each robot may be new to a problem that is said to be near its solution; of
larger teams as many as there are robots, since solutions of theirs are as many seconds apart."""


def anew(
    team: TeamProblem, last: tuple[int, ...], tolerance: float, kept: object = None
) -> tuple[Solution, object]:
    """Solve with nothing kept: slower, and what other solvers are held against."""
    return banded_solver.solve(team.problem, team.start, last, tolerance=tolerance), None


@dataclass(frozen=True)
class BandedOptimizer:
    """Ranges and condensed odometry of the whole group, one banded solve.

    Attributes:
        bias_sigma: how far off the ranges of a pair may be, m.
        range_sigma: around that, as configured, m.
        scale_tails: see `SCALE_TAILS`.
        solve: the solver.
    """

    bias_sigma: float
    range_sigma: float
    model: RangeModel = LINKTRACK
    scale_tails: float = SCALE_TAILS
    solve: Solver = anew

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job:
        """See `Optimizer.job`; public poses are not needed."""
        return partial(_begun, self, graph.frozen(), group, previous)


@dataclass(frozen=True)
class TeamProblem:
    """A group as a problem, with the names behind its numbers.

    Attributes:
        start: calibration to start from.
        chains: of the robots that calibration numbers; pairs: that its biases number.
        places: of the keyframes.
        is_known: is there a solution of the same keyframes? Then it is solved to the end, which
            costs some steps more and would be in vain while others come.
        is_near: is there one of nearly all of them, with a model that was right?
        by_gyro: robots whose constant yaw rate is that of a gyro.
        left: modules of which only places are here that they have left since.
        left_out: pairs of which there was no room for ranges.
    """

    problem: Problem
    start: Calibration
    chains: list[Chain]
    pairs: list[tuple[int, int]]
    places: Numbering
    is_known: bool
    by_gyro: frozenset[int]
    is_near: bool = False
    left: frozenset[int] = frozenset()
    left_out: int = 0


def build_problem(
    graph: PoseGraph, group: Group, previous: TeamEstimate | None, numbers: BandedOptimizer
) -> TeamProblem:
    """Number the group's poses by time and collect its factors."""
    mirrored = group.mirrored_robots
    places = factors.numbering(graph, group.members | group.mirrored, group.points, mirrored)
    robots = sorted({s.robot for s in group.everything})
    chains = [graph.view.chains[robot] for robot in robots]
    ranges, met = factors.ranges(graph, places)
    ranges, pairs = near_pairs.solvable(graph, places, ranges, met)
    closures = factors.closures(graph, places)
    hints = replace(closures, covariance=closures.covariance + HINT * np.eye(3))
    known = factors.corrections(graph, robots, previous, mirrored)
    by_gyro = {c.chain.robot for c in chains if c.model.noise.learns_gyro}
    priors = Priors(
        bias=BiasPrior.of(numbers.bias_sigma, numbers.model),
        scale=np.array([data.model.noise.scale for data in chains]),
        scale_tails=numbers.scale_tails,
        yaw=np.array([_yaw_prior(data.model.noise) for data in chains]),
        near_bias=numbers.model.near_bias_sigma_m,
    )
    problem = Problem(
        robot_id=places.robot,
        n=places.n,
        initial=factors.initial_poses(graph, group, previous, places, known),
        gauge=factors.gauge_place(graph, group, places),
        pairs=len(pairs),
        odometry=factors.as_driven(factors.odometry(graph, places, robots), known, robots),
        closures=hints.chosen(factors.sensible(hints.i, hints.j)),
        ranges=ranges.chosen(factors.sensible(ranges.i, ranges.j)),
        priors=priors,
        doubted=_doubted(previous, known, robots),
        range_sigma=numbers.range_sigma,
        model=numbers.model,
        width=range_weights.widths(pairs, by_gyro),
        half_track=np.array([data.model.half_track_m for data in chains]),
    )
    if previous is not None:
        fitted = np.array([previous.fitted.get(robot, 0) for robot in robots], dtype=float)
        problem = freed_again(replace(problem, fitted=fitted), robots, previous.lapses)
    start = _start(previous, known, pairs, robots, by_gyro)
    solved = {chain.chain: places.n[places.of_robot(chain.chain.robot)] for chain in chains}
    is_known, is_near = _knows(previous, group, solved), _is_near(previous, group, solved)
    left = frozenset(
        data.chain.robot
        for data in chains
        if is_node(data.chain.robot) and data.keyframes.n[-1] > solved[data.chain][-1]
    )
    by_gyros = frozenset(by_gyro)
    named = list(solved), pairs, places
    out = len(met) - len(pairs)
    return TeamProblem(problem, start, *named, is_known, by_gyros, is_near, left, out)


def _yaw_prior(noise: OdometryNoise) -> float:
    """Sigma of the constant yaw rate that is learned: rad/m, of a gyro rad/s."""
    if noise.gyro is not None and noise.gyro.is_in_use:
        return noise.gyro.yaw_rad_per_s
    return max(noise.yaw_rad_per_m, YAW_PRIOR_FLOOR)


def _knows(previous: TeamEstimate | None, group: Group, keyframes: Mapping[Chain, Index]) -> bool:
    """Is there a good solution of these keyframes (k,) in the frame of the group?"""
    if previous is None or previous.frame != group.frame or not previous.converged:
        return False
    known = {t.chain: t.n for t in previous.paths.values()}
    return known.keys() == keyframes.keys() and all(
        np.array_equal(known[chain], n) for chain, n in keyframes.items()
    )


def _is_near(previous: TeamEstimate | None, group: Group, keyframes: Mapping[Chain, Index]) -> bool:
    """Is there a good solution of most of these keyframes (k,), with a model that was right?"""
    if previous is None or previous.frame != group.frame or not previous.is_as_modelled:
        return False
    known = {t.chain: t.n for t in previous.trajectories.values()}
    if not previous.converged or known.keys() != keyframes.keys():
        return False
    new = sum(len(np.setdiff1d(n, known[chain])) for chain, n in keyframes.items())
    return new <= max(MANY_NEW, len(known)) * len(known)


def _start(
    previous: TeamEstimate | None,
    known: Mapping[int, Correction],
    pairs: list[tuple[int, int]],
    robots: list[int],
    by_gyro: set[int],
) -> Calibration:
    """What the last solution learned, and what closures were found with."""
    if previous is None:
        start = Calibration.zero(len(pairs), len(robots))
    else:
        start = _learned(previous, pairs, robots, by_gyro)
    odometry = [
        known.get(robot, Correction(start.scale[at], 0.0, start.turn[at]))
        for at, robot in enumerate(robots)
    ]
    return replace(
        start,
        scale=np.array([correction.scale for correction in odometry]),
        turn=np.array([correction.longer for correction in odometry]),
    )


def _learned(
    previous: TeamEstimate, pairs: list[tuple[int, int]], robots: list[int], by_gyro: set[int]
) -> Calibration:
    """By the last solution."""
    rates = [previous.gyro_rate if robot in by_gyro else previous.yaw for robot in robots]
    return Calibration(
        bias=np.array([previous.bias_m.get(pair, Learned()).value for pair in pairs]),
        scale=np.array([previous.scale.get(robot, Learned()).value for robot in robots]),
        yaw=np.array(
            [of.get(robot, Learned()).value for of, robot in zip(rates, robots, strict=True)]
        ),
        near_bias=np.array([previous.near_bias_m.value]),
        team_bias=np.array([previous.team_bias_m.value]),
        turn=np.array([previous.turn.get(robot, Learned()).value for robot in robots]),
        antenna=np.array(
            [[c.value for c in previous.antenna_m.get(robot, AS_CONFIGURED)] for robot in robots]
        ),
    )


def _doubted(
    previous: TeamEstimate | None, known: Mapping[int, Correction], robots: list[int]
) -> Doubted:
    """What the last solution let go, and what closures were found with."""
    antennas = previous.antenna_m if previous else {}
    turns = [robot in known and known[robot].longer != 0 for robot in robots]
    return Doubted(np.array(turns), np.array([robot in antennas for robot in robots]))


def _begun(
    numbers: BandedOptimizer, graph: PoseGraph, group: Group, previous: TeamEstimate | None
) -> TeamEstimate:
    """State the problem and solve it: both take long where the team is large."""
    team = build_problem(graph, group, previous, numbers)
    kept, fitted = (previous.kept, previous.fitted) if previous else (None, {})
    found = solved(team, group, solve=numbers.solve, kept=kept)
    for start in valleys.other_starts(found, previous):
        team = build_problem(graph, group, start, numbers)
        other = solved(team, group, solve=numbers.solve)
        found = other if valleys.is_better(other, found) else found
    return found if found.is_as_modelled else replace(found, fitted=fitted)


def solved(
    team: TeamProblem,
    group: Group,
    tolerance: float | None = None,
    solve: Solver = anew,
    kept: object = None,
) -> TeamEstimate:
    """Solve, with the uncertainty of everybody's latest pose, and sort the answer by robot.

    Args:
        tolerance: by what is known where it is left out.
        kept: what came of the solution before.
    """
    mine = {chain.robot: team.places.of_robot(chain.robot) for chain in team.chains}
    stays = [chain.robot for chain in team.chains if chain.robot not in team.left]
    last = tuple(int(mine[robot][-1]) for robot in stays)
    solution, kept = solve(team, last, tolerance or (SETTLED if team.is_known else TOLERANCE), kept)
    learned, spread, doubted = solution.calibration, solution.spread, solution.doubted
    assert spread is not None
    n, poses = team.problem.n, solution.poses
    paths = {c.robot: Trajectory(c, n[mine[c.robot]], poses[mine[c.robot]]) for c in team.chains}
    points, mirrored = group.places_only, group.mirrored_robots
    turn = _named(list(mine), learned.turn, spread.turn)
    yaw = _named(list(mine), learned.yaw, spread.yaw)
    x, y = (_named(list(mine), learned.antenna[:, k], spread.antenna[:, k]) for k in (0, 1))
    return TeamEstimate(
        frame=group.frame,
        trajectories={robot: path for robot, path in paths.items() if not is_node(robot)},
        nodes={number: paths[number] for number in stays if is_node(number)},
        left={number: paths[number] for number in team.left},
        points=points,
        mirrored=mirror_factors.headings(solution.joint, stays, mirrored),
        narrower=narrower(stays, solution.shares),
        joint=standing_points.without_headings(solution.joint, np.isin(stays, list(points))),
        bias_m=_named(team.pairs, learned.bias, spread.bias),
        bias_sigma_m=dict(zip(team.pairs, solution.bias_sigmas.tolist(), strict=True)),
        scale=_named(list(mine), learned.scale, spread.scale),
        yaw={robot: value for robot, value in yaw.items() if robot not in team.by_gyro},
        gyro_rate={robot: yaw[robot] for robot in team.by_gyro},
        near_bias_m=Learned(float(learned.near_bias[0]), float(spread.near_bias[0])),
        team_bias_m=Learned(float(learned.team_bias[0]), float(spread.team_bias[0])),
        turn=mirror_factors.turns(turn, compress(mine, doubted.track), mirrored),
        antenna_m={robot: (x[robot], y[robot]) for robot in compress(mine, doubted.antenna)},
        scatter=dict(zip(team.pairs, solution.scatter.tolist(), strict=True)),
        odometry_level=_latest(team, solution.feared_level),
        late_level=_latest(team, solution.late_level),
        lapses=tuple(lapse_of(team.problem, list(mine), one) for one in solution.freed),
        contradicted=frozenset(compress(team.pairs, solution.contradicted)),
        blocked=frozenset(compress(team.pairs, solution.blocked)),
        left_out=team.left_out,
        is_explained=solution.is_explained,
        cost=solution.cost,
        iterations=solution.iterations,
        # (a good one stays good, should the last digits not come to rest)
        converged=solution.converged or team.is_known,
        settled=team.is_known,
        fitted={robot: int(team.problem.n[mine[robot][-1]]) for robot in mine},
        is_as_modelled=solution.is_as_modelled,
        kept=kept,
    )


def _latest(team: TeamProblem, of_links: Array) -> dict[int, float]:
    """Of the last link of each robot, where it is not as configured."""
    robot = team.problem.odometry.robot
    last = {team.chains[index].robot: k for k, index in enumerate(robot.tolist())}
    levels = {name: float(of_links[k]) for name, k in last.items()}
    return {name: level for name, level in levels.items() if level > 1.0}


def _named(names: list[Name], values: Array, sigmas: Array) -> dict[Name, Learned]:
    pairs = zip(values.tolist(), sigmas.tolist(), strict=True)
    return {name: Learned(*pair) for name, pair in zip(names, pairs, strict=True)}
