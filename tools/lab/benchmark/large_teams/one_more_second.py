"""One more second of a team whose pairs have mostly met, beside a solve with every factor anew.

Both in one run on the same graphs, CPU time. What a second costs is all of module 3: the graph
renewed, its digest, the problem stated and solved; a mean over more than one step of time, because
each step costs extra. The plain solve is `banded_optimizer.anew`, which tests hold the other one
against.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.optimizer.banded import banded_optimizer
from drslamd.slam.optimizer.banded.banded_solver import SETTLED
from lab.benchmark import timing
from lab.benchmark.large_teams.met_team import MetTeam, begun
from lab.benchmark.rows import Peer, Row

TIMES_LESS = {3: 1.8, 10: 5.0, 20: 8.0, 50: 22.0, 100: 35.0}
"""Goals: CPU of the plain solve over ours."""
SHARES = {20: 1 / 8, 50: 1 / 3}
"""Goals: of a core at 1 Hz."""
MINUTES, HOURS = 600, 28_800
SECONDS = 34
"""Two steps of time, and two seconds on the way."""
FIRST = 2
"""Seconds that are not counted."""
PAIRED = {3: 8, 10: 4, 20: 2, 50: 1, 100: 1}
"""How many of these seconds are solved plainly as well."""
GOAL_M, GOAL_SIGMA, GOAL_HOURS = 1e-4, 1.03, 1.3


@dataclass
class Costs:
    """Of one team.

    Attributes:
        ours: ms of each second; around: what of that is not the solve; plain: ms of plain solves.
        off_m: worst distance of any pose to that of a plain solve that went to the end.
        sigma: worst ratio of any sigma of a newest pose to that of the same.
        kept: share of the seconds that began with what was kept.
    """

    ours: list[float] = field(default_factory=list)
    around: list[float] = field(default_factory=list)
    plain: list[float] = field(default_factory=list)
    off_m: float = 0.0
    sigma: float = 1.0
    kept: list[bool] = field(default_factory=list)

    @property
    def ms(self) -> float:
        return float(np.mean(self.ours))

    @property
    def plain_ms(self) -> float:
        return float(np.mean(self.plain) + np.mean(self.around))


def rows(quick: bool) -> Iterator[Row]:
    """By the size of the team, and of some after eight hours."""
    for robots, times in TIMES_LESS.items():
        if quick and robots > 10:
            return
        found = measured(robots, MINUTES)
        name = f"one more second of {robots} robots that have met"
        peers = (Peer("every factor anew", found.plain_ms, True),)
        curve = ("robots that have met", robots)
        yield Row(3, name, found.ms, "ms", None, None, peers, curve)
        yield Row(3, f"{name}, over a plain solve", found.ms / found.plain_ms, "ratio", 1 / times)
        if robots in SHARES:
            yield Row(3, f"{name}, share of a core", found.ms / 1e3, "ratio", SHARES[robots])
        yield Row(3, f"{name}, off a plain solve to the end, m", found.off_m, "gap", GOAL_M)
        yield Row(
            3, f"{name}, worst sigma over that of a plain one", found.sigma, "ratio", GOAL_SIGMA
        )
        if not quick and robots <= 20:
            later = measured(robots, HOURS, paired=0).ms / found.ms
            yield Row(3, f"{name}, 8 h over 10 min", later, "ratio", GOAL_HOURS)


def measured(robots: int, after_s: int, seconds: int = SECONDS, paired: int | None = None) -> Costs:
    """Drive a team on, second by second.

    Args:
        paired: how many seconds are solved plainly too; by the size of the team where left out.
    """
    team = MetTeam(robots, after_s, seconds + FIRST)
    team.know_the_truth()
    costs = Costs()
    paired = PAIRED[robots] if paired is None else paired
    beside = set(np.linspace(FIRST, FIRST + seconds - 1, paired + 1, dtype=int)[1:].tolist())
    for second in range(FIRST + seconds):
        began = timing.now_ms()
        job = begun(team.back, team.living)
        team.back.said_digest()
        stated = timing.now_ms()
        found = job()
        solved = timing.now_ms()
        if second in beside:
            _compare(costs, job, found)
        if second >= FIRST:
            costs.around.append(stated - began)
            costs.ours.append(solved - began)
            costs.kept.append(found.kept is not None)
        team.back.on_solution(found)
        team.drive()
    return costs


def _compare(costs: Costs, job: Any, found: TeamEstimate) -> None:
    """Solve a second plainly, timed as it would be, then to the end."""
    numbers, graph, group, previous = job.args
    began = timing.now_ms()
    problem = banded_optimizer.build_problem(graph, group, previous, numbers)
    banded_optimizer.solved(problem, group)
    costs.plain.append(timing.now_ms() - began)
    right = banded_optimizer.solved(problem, group, tolerance=SETTLED)
    for robot, path in right.trajectories.items():
        apart = path.poses - found.trajectories[robot].poses
        costs.off_m = max(costs.off_m, float(np.abs(apart[:, :2]).max()))
    ratios = np.sqrt(np.diag(found.joint) / np.diag(right.joint))
    costs.sigma = max(costs.sigma, float(np.maximum(ratios, 1 / ratios).max()))
