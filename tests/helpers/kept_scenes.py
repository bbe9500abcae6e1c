"""Problems with times that are thinned, and points that are no solution of them."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from slam_scenes import BANDED, group_of, small_team

from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem, build_problem
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration


def a_team_problem(seconds: int = 90, recent_s: int = 24, seed: int = 1) -> TeamProblem:
    """Three robots; what is older than `recent_s` is thinned, so some ranges were carried."""
    team = small_team(seed, count=seconds, clock=70)
    graph = PoseGraph(recent_s)
    for chain, entry in team.entries:
        graph.insert(chain, entry)
    return build_problem(graph, group_of(graph), None, BANDED)


def a_problem(carried: bool = True) -> Problem:
    problem = a_team_problem(recent_s=24 if carried else 300).problem
    assert bool(len(problem.ranges.carried.rows)) is carried
    return problem


def shaken(problem: Problem, by: float = 0.02, seed: int = 3) -> Point:
    """Everything some centimetres, and hundredths, from where it began."""
    rng = np.random.default_rng(seed)
    zero = Calibration.zero(problem.pairs, len(problem.priors.scale))
    moved = {f.name: rng.normal(0, by, getattr(zero, f.name).shape) for f in fields(Calibration)}
    moved["antenna"][~problem.doubted.antenna] = 0.0
    moved["turn"][~problem.doubted.track] = 0.0
    poses = problem.initial + rng.normal(0, by, problem.initial.shape)
    return Point.of(problem, poses, Calibration(**moved))
