"""Whoever is asked goes on as if nobody had asked: promise P7, for everything that may be asked."""

from __future__ import annotations

import pytest
from lab.play import virtual_team
from lab.play.simulator import Simulator
from lab.recordings import world

from drslamd import report
from drslamd.reports import graph_report

SCENE = world.Scene(robots=3, seconds=40.0, odometry_hz=20, range_hz=5, both_measure=False)
NEAR = "[near]\nlcm_hz = 2\nhypotheses = true\n"
ASKED_S = 0.37
"""Between two questions, so that they come at any time between two steps of a robot."""


def ask(simulator: Simulator) -> None:
    """All that a daemon answers, of every robot."""
    for member in simulator.members.values():
        robot, utime = member.robot, member.clock.local(simulator.now)
        report.status(robot, utime)
        report.trajectories(robot, utime)
        report.closures(robot)
        graph_report.graph(robot, utime)
        robot.near.look(utime)
        robot.back.digest()


def said(is_asked: bool) -> list[list[tuple[int, str, bytes]]]:
    """What each robot sent, and when."""
    simulator = virtual_team.start(world.simulate(SCENE, 3), 3, extra=NEAR)
    for k in range(1, int(SCENE.seconds / ASKED_S)):
        simulator.run(k * ASKED_S)
        if is_asked:
            ask(simulator)
    assert all(member.robot.back.estimate for member in simulator.members.values())
    return [member.traces.sent for member in simulator.members.values()]


@pytest.mark.slow
def test_a_team_that_is_asked_everything_all_the_time_says_what_it_says_unasked() -> None:
    assert said(True) == said(False)
