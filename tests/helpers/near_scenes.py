"""A robot in a team of three that module 3 has solved, and one message of what it tells."""

from __future__ import annotations

import numpy as np
from lab.near.busy_daemon import known_here, team
from slam_scenes import config

from drslamd.gossip.message_types import PoseState
from drslamd.gossip.seal import team_key
from drslamd.near.near_message import Near, Neighbours
from drslamd.robot import Robot
from drslamd.sensors.samples import Motion
from drslamd.slam.graph.estimate import TeamEstimate

BEGAN_US = 1_000_000
STEP_US = 20_000
OK, STALE = PoseState.LOCALISED, PoseState.STALE
PEERS = Neighbours(
    robots=(1, 2),
    states=(OK, STALE),
    utimes=(4_900_000, 4_000_000),
    uncertainties=(10, 20),
    a_T_b=np.array([[1.0, 2.0, 0.25], [-3.0, 0.5, -2.0]]),
    covariance=np.arange(1, 13).reshape(6, 2) / 64,
    speeds=(0.25, 0.0),
    turn_rates=(0.125, 0.0),
)
NEAR = Near(
    utime=5_000_000,
    odom=(1.0, 2.0, 0.5),
    speed_mps=0.5,
    turn_radps=0.125,
    utc_minus_clock_us=1_700_000_000_000_000,
    utc_uncertainty_us=500,
    state=OK,
    frame=0,
    frame_epoch=7,
    correction=(3.0, -1.0, 1.0),
    covariance=(0.0625, 0.015625, 0.0, 0.125, 0.0, 0.03125),
    resets=259,
    peers=PEERS,
)


class Steered:
    """A robot that drives fifty steps a second."""

    def __init__(self, extra: str = "") -> None:
        self.robot = Robot(config(0, extra), team_key(None), 1, {})
        self.utime = BEGAN_US
        back, job = team(3, self.robot.own)
        self.solved: TeamEstimate = job()
        self.robot.back.graph.chains.update(back.graph.chains)

    def drive(self, steps: int, way_m: float = 0.01, turn_rad: float = 0.004) -> None:
        for _ in range(steps):
            self.utime += STEP_US
            self._on(Motion(self.utime, way_m, turn_rad))

    def gap(self) -> None:
        """A silence across which nobody knows the way."""
        self.utime += 500_000
        self._on(Motion(self.utime, 0.0, 0.0, gap=True))

    def _on(self, motion: Motion) -> None:
        self.robot.front.on_motion(motion)
        self.robot.near.on_motion(motion)

    def solve(self) -> None:
        """As if module 3 had just answered, for the newest sample of our track."""
        n = self.robot.front.reckoning.track.end - 1
        self.robot.back.estimate = known_here(self.solved, self.robot.own, n)

    def look(self) -> Near:
        near = self.robot.near.look(self.utime)
        assert near is not None
        return near
