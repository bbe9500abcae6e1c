"""A cable is out for twenty seconds: what a robot says of itself meanwhile, and afterwards."""

from __future__ import annotations

import numpy as np
import pytest
from lab.recordings import world
from slam_scenes import NOISE
from teams import EASY, VirtualTeam

from drslamd import report
from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.gossip.message_types import PoseState
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.odometry.track import Track
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relocation import relocation
from drslamd.slam.relocation.relocation import ANY_HEADING_RAD, FIRST_NUMBER
from drslamd.slam.relocation.sightings import Own
from drslamd.slam.robot_model import RobotModel


@pytest.mark.slow
def test_it_has_a_position_without_a_heading_and_is_back_within_seconds() -> None:
    """Of its own segment after the hole a closure of its own tells the team."""
    scene = world.Scene(**{**EASY.__dict__, "seconds": 60.0})
    team = VirtualTeam(scene, seed=3, on=())
    team.cut = lambda robot, port, t: robot == 1 and port == "wheels" and 30 < t < 45
    for robot in range(3):
        team.start(robot)
    team.run(40)
    member = team.member(1)

    def now() -> int:
        return member.clock.local(team.simulator.now)

    where = member.robot.whereabouts(now())
    assert where.state is PoseState.STALE
    assert where.pose is not None
    assert where.pose.covariance[2, 2] == pytest.approx(ANY_HEADING_RAD**2)
    assert now() - where.pose.utime < 3_000_000
    assert "the heading is not known" in " ".join(report.status(member.robot, now())["problems"])
    trails = team.recording.trails
    t = member.clock.world(where.pose.utime) / 1e6
    true = [np.interp(t, trails[1].t, trails[1].truth[:, k]) for k in (0, 1)]
    origin = trails[0].truth[0]
    cos, sin = np.cos(-origin[2]), np.sin(-origin[2])
    apart = np.array([[cos, -sin], [sin, cos]]) @ (true - origin[:2])
    assert np.hypot(*(where.pose.pose[:2] - apart)) < 1.0
    team.run(55)
    assert member.robot.whereabouts(now()).state is PoseState.LOCALISED
    told = [
        c
        for pair in member.robot.back.graph.pairs.values()
        for c in pair.kept_closures()
        if c.number > FIRST_NUMBER
    ]
    assert len(told) == 1
    team.run(59.8)
    assert not member.robot.front.relocation.is_lost
    # once nobody drives all hold the same, and have the same graph and the same paths
    team.run(66)
    assert len(team.digests()) == 1
    one, *others = (m.robot.back.estimate for m in team.simulator.members.values())
    assert one is not None
    for other in others:
        assert other is not None
        for number, path in one.trajectories.items():
            assert path.poses == pytest.approx(other.trajectories[number].poses, abs=1e-6)


@pytest.mark.parametrize(("turn", "is_lost"), [(0.0, True), (-2.0, False)])
def test_who_turns_the_other_way_is_not_placed_after_a_hole_by_its_way(
    turn: float, is_lost: bool
) -> None:
    """Where it looks was not known before it either."""
    track = Track(1000)
    for n in (0, 1, 2, 6, 7):
        track.append(n, np.zeros(3))
    solved = Trajectory(Chain(4, 1), np.array([1]), np.zeros((1, 3)))
    team = TeamEstimate(Segment(4, 1, 0), {4: solved}, np.eye(3), turn={4: Learned(turn, 0.1)})
    own = Own(4, RobotModel(NOISE), 0.1, LINKTRACK)
    assert (relocation._hole(team, own, track, 7 * GRID_US) is not None) is is_lost
