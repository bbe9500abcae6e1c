"""Who holds the same has the same graph, and how one sees that."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.robot import Robot
from lab.play.simulator import Member

ON_THE_AIR_US = 5 * SECOND_US
"""What was said since may not have come everywhere, at whatever moment one looks."""


def held(robot: Robot) -> dict[int, tuple[int, frozenset[int]]]:
    """Which entries of which logs a robot holds; those in which nothing is are left out."""
    logs = robot.team.logs._logs
    return {k: (log.epoch, frozenset(log.sealed)) for k, log in logs.items() if log.sealed}


def whole_digest(robot: Robot) -> int:
    """Of the graph that all logs make, whoever lives."""
    return robot.back.graph.digest(set(robot.back.graph.chains))


def compared(robots: Iterable[Robot]) -> tuple[int, list[tuple[int, int]]]:
    """How many pairs of robots hold the same, and those among them whose graphs differ."""
    known = [(robot, held(robot)) for robot in robots]
    same, unequal = 0, []
    for (one, of_one), (other, of_other) in itertools.combinations(known, 2):
        if of_one == of_other:
            same += 1
            if whole_digest(one) != whole_digest(other):
                unequal.append((one.own.robot, other.own.robot))
    return same, unequal


def is_everywhere(members: list[Member], now_us: int) -> bool:
    """Has each of these robots the same keyframes of all of them, but for the last seconds?"""
    for owner in members:
        chain = owner.robot.own
        last = owner.clock.local(now_us - ON_THE_AIR_US) // GRID_US
        told = set()
        for member in members:
            data = member.robot.back.graph.chains.get(chain.robot)
            if data is None or data.chain != chain:
                return False
            n = data.keyframes.n
            told.add(n[n <= last].tobytes())
        if len(told) > 1:
            return False
    return True
