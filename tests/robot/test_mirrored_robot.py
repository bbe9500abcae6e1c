"""The sides of one robot's wheels are swapped: what it is to itself, and to the two others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.score import metrics
from lab.trust import mountings
from teams import EASY, VirtualTeam

from drslamd.gossip.message_types import PoseState

SWAPPED = 0


class Team(VirtualTeam):
    """Wheels of the lowest robot are swapped, whose frame would be the team's."""

    def __init__(self) -> None:
        super().__init__(replace(EASY, odometry_hz=10, seconds=40.0), seed=3, on=())
        self.hardware[SWAPPED].wiring = mountings.swapped
        for robot in self.hardware:
            self.start(robot)

    def state(self, robot: int) -> PoseState:
        member = self.member(robot)
        return member.robot.whereabouts(member.clock.local(self.simulator.now)).state

    def off_m(self, robot: int) -> float:
        """How far from where it is, in the frame of robot 1, it says that it is."""
        member = self.member(robot)
        found = member.robot.whereabouts(member.clock.local(self.simulator.now)).pose
        assert found is not None
        t = member.clock.world(found.utime) / 1e6
        trails = self.recording.trails
        true = metrics.at_times(trails[robot].t, trails[robot].truth, np.array([t]))[0]
        return float(np.hypot(*(found.pose - metrics.relative(trails[1].truth[0], true))[:2]))


@pytest.mark.slow
def test_it_has_a_place_and_no_heading_and_its_ranges_serve_the_others() -> None:
    team = Team()
    team.run(40.0)
    assert team.frames() == {0: 1, 1: 1, 2: 1}
    states = {robot: team.state(robot) for robot in team.hardware}
    assert states == {0: PoseState.POSITION, 1: PoseState.LOCALISED, 2: PoseState.LOCALISED}
    assert max(team.off_m(robot) for robot in team.hardware) < 0.3
    assert "wheels.swap_channels" in team.problems(SWAPPED)
    estimate = team.member(2).robot.back.estimate
    assert estimate is not None
    assert estimate.bias_m.keys() == {(0, 1), (0, 2), (1, 2)}
    # equal logs are equal graphs, whoever it is that turns the other way
    team.run(45.0)
    assert len(team.digests()) == 1
    paths = [m.robot.back.estimate.trajectories for m in team.simulator.members.values()]  # type: ignore[union-attr]
    for robot in team.hardware:
        for other in paths[1:]:
            assert other[robot].poses == pytest.approx(paths[0][robot].poses, abs=1e-6)
