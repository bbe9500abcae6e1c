"""Teams of which robot 1 stuck or slipped, and that drive as they are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from slam_problems import CLOCKS, held_at, links_of, team_problem
from slam_scenes import Array

from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.optimizer.sensor_priors import Calibration

ROBOTS, COUNT = 3, 45
FAULT = (25, 31)
"""Keyframes between which something happens to robot 1."""
STEP_M = 0.4
"""What robots drive in a second, and so their usual speed."""
FROM_TO = (CLOCKS[1] + 240, CLOCKS[1] + 320)
"""Grid numbers of the keyframes of robot 1 one before and one behind the fault."""


def a_team(seed: int = 2, robots: int = ROBOTS) -> tuple[Problem, Array]:
    problem, truth = team_problem(seed, robots=robots, count=COUNT, closures=6)
    return held_at(problem, truth), truth


def nominal(problem: Problem) -> Point:
    start = Calibration.zero(problem.pairs, len(problem.priors.scale))
    return descend(Equations(problem), start, 60)


def worst(poses: Array, truth: Array) -> float:
    return float(np.hypot(*(poses - truth)[:, :2].T).max())


def driven(ways: dict[int, float], turn: float = 0.0) -> Problem:
    """A team that drives straight on; robot 1 goes other ways in some seconds."""
    problem, _ = a_team()
    odometry = problem.odometry
    measured = np.tile([STEP_M, 0.0, 0.0], (len(odometry), 1))
    for second, way in ways.items():
        measured[links_of(problem, 1, second, second + 1)] = [way, 0.0, turn]
    return replace(problem, odometry=replace(odometry, measured=measured))
