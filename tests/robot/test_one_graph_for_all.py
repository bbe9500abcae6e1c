"""Whole robots on a bad radio: who holds the same has the same graph, and then the same paths.

Old times begin after half a minute here, so that all of it happens to a graph that is thinned.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable

import numpy as np
import pytest
from lab.play.simulator import Member, Network
from lab.recordings import world
from lab.soak import agreement
from teams import EASY, VirtualTeam

from drslamd.slam.tuning import Tuning

SECONDS = 100.0
THINNED = Tuning(recent_s=16)
RARELY = "[relative_pose]\nrate_hz = 0.5\n[optimizer]\nrate_hz = 0.5\n"
LOOK_S = 0.5


def compare(members: list[Member]) -> int:
    """How many pairs of robots hold the same; these have the same graph."""
    same, unequal = agreement.compared(member.robot for member in members)
    assert not unequal
    return same


def parted(chance: random.Random) -> Callable[[int, int, int], bool]:
    """A team that falls apart for a while, anyhow."""
    begin = chance.uniform(25, 40)
    end = begin + chance.uniform(10, 30)
    alone = chance.randrange(3)
    return lambda a, b, t: not (begin * 1e6 < t < end * 1e6 and alone in (a, b))


def played(seed: int) -> tuple[VirtualTeam, int]:
    """A team on a radio that loses, doubles and delays, parted once, with one that comes late.

    Returns:
        The team half a minute after it has ceased to drive, and how often two robots were seen to
        hold the same while it drove.
    """
    chance = random.Random(seed)
    network = Network(
        loss=chance.uniform(0.0, 0.3),
        jitter_us=chance.choice([2_000, 200_000]),
        duplicate=chance.choice([0.0, 0.3]),
        connected=parted(chance),
    )
    scene = world.Scene(**{**EASY.__dict__, "seconds": SECONDS})
    late = chance.randrange(3)
    on = tuple(robot for robot in range(3) if robot != late)
    team = VirtualTeam(scene, seed, network, RARELY, on, tuning=THINNED)
    begins, same = chance.uniform(40, 60), 0
    for now in np.arange(LOOK_S, SECONDS, LOOK_S).tolist():
        team.run(now)
        if now >= begins and late not in team.simulator.members:
            team.start(late)
        same += compare(list(team.simulator.members.values()))
    team.run(SECONDS + 30)
    return team, same


@pytest.mark.row("N3")
@pytest.mark.row("N4")
@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 8)]
)
def test_robots_that_hold_the_same_have_one_graph_and_come_to_the_same_paths(seed: int) -> None:
    team, same = played(seed)
    robots = [member.robot for member in team.simulator.members.values()]
    assert len(robots) == 3
    assert same > 20
    assert not any(robot.team.logs.lacks_any() for robot in robots)
    assert compare(list(team.simulator.members.values())) == 3
    graph = robots[0].back.graph
    # who came late may have nothing old yet
    assert sum(len(view.keyframes) < len(view.held) for view in graph.view.chains.values()) >= 2
    estimates = [robot.back.estimate for robot in robots]
    for one, other in itertools.combinations(estimates, 2):
        assert one is not None
        assert other is not None
        assert one.frame == other.frame
        for robot, path in one.trajectories.items():
            there = other.trajectories[robot]
            assert np.array_equal(path.n, there.n)
            assert np.abs(path.poses - there.poses).max() < 1e-6
