"""What stood is found by those who drive, and becomes a robot when it is one."""

from __future__ import annotations

import numpy as np
import pytest
from lab.play.playback import equip, robot_config
from lab.play.simulator import Clock, Member, Simulator
from lab.recordings import world
from lab.recordings.recording import Recording
from lab.score.metrics import at_times, relative
from teams import EASY

from drslamd.conventions import node_chain
from drslamd.gossip.message_types import PoseState

STANDS, DRIVES_S = 2, 30.0
NODE = node_chain(STANDS).robot


def recorded(seed: int) -> Recording:
    """Two drive, and a third one stands between them and drives off after half a minute."""
    rng, scene = np.random.default_rng(seed), world.Scene(**{**EASY.__dict__, "seconds": 50.0})
    truths = [world.drive(rng, scene) for _ in range(2)]
    place, count = np.array([5.0, 6.0, 0.7]), round(DRIVES_S / world.STEP_S)
    off = world.drive(rng, scene, place)
    truths.append(np.concatenate([np.tile(place, (count, 1)), off])[: len(off)])
    return world.recorded("one stands", rng, scene, truths)


class Team:
    """Robots that are switched on when they are told to."""

    def __init__(self, seed: int, *on: int) -> None:
        self.recording, self.simulator = recorded(seed), Simulator(seed, solve_us=20_000)
        self._hardware = equip(self.recording)
        for robot in on:
            self.start(robot)

    def start(self, robot: int) -> Member:
        device, clock = self._hardware[robot], Clock(offset_us=robot * 1_000_000)
        member = self.simulator.add(robot_config(device, ""), clock, device)
        now = self.simulator.now / 1e6
        self.simulator.play(member, [chunk for chunk in device.chunks() if chunk.t >= now])
        return member

    def state(self) -> PoseState:
        """Of who stands."""
        member = self.simulator.members[STANDS]
        return member.robot.whereabouts(member.clock.local(self.simulator.now)).state

    def off(self) -> tuple[float, float]:
        """How far its pose is off in the frame of robot 0, m and rad."""
        member, trails = self.simulator.members[STANDS], self.recording.trails
        pose = member.robot.pose()
        assert pose is not None
        t = np.array([member.clock.world(pose.utime) / 1e6])
        true = at_times(trails[STANDS].t, trails[STANDS].truth, t)[0]
        error = pose.pose - relative(trails[0].truth[0], true)
        return float(np.hypot(*error[:2])), float(abs(np.angle(np.exp(1j * error[2]))))

    def knows_node(self) -> list[bool]:
        """Does each driver have the module as something that stands?"""
        found = [self.simulator.members[robot].robot.back.estimate for robot in (0, 1)]
        return [estimate is not None and NODE in estimate.nodes for estimate in found]


@pytest.mark.slow
def test_a_module_becomes_its_robot_when_that_is_switched_on() -> None:
    team = Team(3, 0, 1)
    team.simulator.run(22)
    assert team.knows_node() == [True, True]
    team.start(STANDS)
    team.simulator.run(30)
    assert team.knows_node() == [False, False]
    team.simulator.run(48)
    assert team.knows_node() == [False, False]
    assert team.state() is PoseState.LOCALISED
    metres, turned = team.off()
    assert metres < 0.5
    assert turned < np.radians(10)


@pytest.mark.slow
def test_a_parked_robot_becomes_whole_when_it_drives() -> None:
    team = Team(3, 0, 1, STANDS)
    team.simulator.run(DRIVES_S - 1)
    assert team.state() is PoseState.POSITION
    assert team.off()[0] < 0.5
    team.simulator.run(48)
    assert team.state() is PoseState.LOCALISED
    metres, turned = team.off()
    assert metres < 0.5
    assert turned < np.radians(10)
