"""What every robot tells of itself and of its peers, second by second, against the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drslamd.gossip.message_types import PoseState
from drslamd.near.near_message import Near
from drslamd.slam import se2
from lab.play import virtual_team
from lab.play.simulator import Member, Simulator
from lab.recordings.recording import Array, Recording
from lab.recordings.seat import on_axle
from lab.reproduce.tally import Tally
from lab.score import metrics
from lab.score.claims import claim, mahalanobis

MOST_MPS = 3.0
"""No robot of ours is so fast: what moves further in odom has jumped."""
LOOKS_HZ = 10


def honesty(recording: Recording, seed: int) -> Tally:
    """One run: `pair/nees` and `own/nees` per degree of freedom, `pair/inside` is the share of
    positions in their 95 % ellipses, `odom/step` in m/s."""
    tally = Tally()
    played(tally, recording, seed)
    return tally


def played(tally: Tally, recording: Recording, seed: int) -> Simulator:
    """The same run, and the team at its end."""
    simulator = virtual_team.start(recording, seed)
    last: dict[int, Near] = {}
    for look in range(1, LOOKS_HZ * int(recording.duration) + 1):
        simulator.run(look / LOOKS_HZ)
        for robot, member in simulator.members.items():
            near = member.robot.near.look(member.clock.local(simulator.now))
            if near is None:
                continue
            if robot in last and near.utime > last[robot].utime:
                tally.add("odom/step", _speed(last[robot], near))
            last[robot] = near
            if look % LOOKS_HZ == 0 and near.state == PoseState.LOCALISED:
                _add(tally, recording, simulator, robot, near)
    simulator.run(recording.duration + virtual_team.SETTLE_S)
    return simulator


def on_axles(recording: Recording) -> Recording:
    """The same with true poses of what odometry speaks of, whatever frames motion capture gave."""
    trails = {
        robot: replace(trail, truth=on_axle(trail.t, trail.truth))
        for robot, trail in recording.trails.items()
    }
    return replace(recording, trails=trails)


def _speed(before: Near, after: Near) -> float:
    way = np.hypot(after.odom[0] - before.odom[0], after.odom[1] - before.odom[1])
    return float(way / (after.utime - before.utime) * 1e6)


def _add(tally: Tally, recording: Recording, simulator: Simulator, robot: int, near: Near) -> None:
    member = simulator.members[robot]
    here = _true(recording, robot, member, near.utime)
    origin = recording.trails[near.frame].truth[0]
    stated, true = se2.unpacked(near.covariance), metrics.relative(origin, here)
    tally.add("own/nees", mahalanobis(near.pose, stated, true) / 3)
    peers = near.peers
    for k, peer in enumerate(peers.robots):
        if peers.states[k] != PoseState.LOCALISED:
            continue
        there = _true(recording, peer, member, peers.utimes[k])
        covariance = se2.unpacked(peers.covariance[:, k])
        claimed = claim(peers.a_T_b[k], covariance, metrics.relative(here, there))
        tally.add("pair/nees", claimed.squared / 3)
        tally.add("pair/inside", float(claimed.is_inside))
        tally.add("pair/age", (near.utime - peers.utimes[k]) / 1e6)


def _true(recording: Recording, robot: int, member: Member, utime: int) -> Array:
    """(3,) where a robot was at a time of a member's clock."""
    trail, t = recording.trails[robot], np.array([member.clock.world(utime) / 1e6])
    return np.asarray(metrics.at_times(trail.t, trail.truth, t)[0])
