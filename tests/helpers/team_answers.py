"""What a robot answers that drove with its team: made once, read by the tests of all formats."""

from __future__ import annotations

import copy
import json
from functools import lru_cache
from typing import Any

from lab.recordings import world
from lab.recordings.recording import Recording
from teams import EASY, VirtualTeam

from drslamd import report
from drslamd.reports import graph_report

SCENE = world.Scene(
    robots=3, seconds=40.0, ranges=EASY.ranges, odometry=EASY.odometry, odometry_hz=20, range_hz=10
)
ASKED = 1
BEGAN_US = 1_790_000_000_000_000
"""UNIX time at which the recording began; every robot's clock says something else."""


@lru_cache(maxsize=1)
def _team() -> tuple[VirtualTeam, str]:
    team = VirtualTeam(SCENE, seed=3)
    team.run(SCENE.seconds + 2.0)
    member = team.member(ASKED)
    now = member.clock.local(team.simulator.now)
    wall = {
        "utc_minus_clock_us": BEGAN_US + team.simulator.now - now,
        "uncertainty_us": 1_500,
    }
    windows = report.closures(member.robot)["closures"]
    answers = {
        "graph": {**graph_report.graph(member.robot, now), "windows": windows, "wall": wall},
        "trajectory": {**report.trajectories(member.robot, now), "wall": wall},
        "status": report.status(member.robot, now),
    }
    return team, json.dumps(answers)


def answers() -> dict[str, Any]:
    """By question, as they come over the socket; each caller may change his own."""
    found: dict[str, Any] = json.loads(_team()[1])
    return found


def recording() -> Recording:
    """What was played."""
    return _team()[0].recording


def team() -> VirtualTeam:
    """Who played it; not to be changed."""
    return _team()[0]


def unlocalised() -> dict[str, Any]:
    """Of a robot in no group."""
    found = copy.deepcopy(answers())
    for table in ("keyframes", "odometry", "closures", "ranges"):
        del found["graph"][table]
    found["graph"] |= {"frame": None}
    found["trajectory"] |= {"frame": None, "robots": {}}
    return found
