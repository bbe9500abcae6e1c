"""Worlds are repeatable, and those without faults are the simulator's own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lab.recordings import world
from lab.trust import sensor_faults, worlds
from lab.trust.worlds import World
from slam_scenes import inverted, product

SLIPS_LATE = 3
"""A seed."""


def test_a_world_without_faults_is_the_scene_as_it_is_simulated() -> None:
    found, simulated = World(worlds.RECORDED).recording(4), world.simulate(worlds.RECORDED, 4)
    assert np.array_equal(found.ranges, simulated.ranges)
    for robot, trail in simulated.trails.items():
        assert np.array_equal(found.trails[robot].odometry, trail.odometry)


@pytest.mark.parametrize("made", [worlds.SLIP, worlds.BLOCKED, worlds.HEAVY_TAILS, worlds.LINE])
def test_the_same_seed_gives_the_same_world_and_another_one_another(made: World) -> None:
    one, same, other = (made.recording(seed) for seed in (1, 1, 2))
    assert np.array_equal(one.ranges, same.ranges)
    assert np.array_equal(one.trails[0].odometry, same.trails[0].odometry)
    assert not np.array_equal(one.trails[0].truth, other.trails[0].truth)


def test_who_turns_on_the_spot_has_an_antenna_off_the_axle_and_knows_it() -> None:
    recording = worlds.ON_THE_SPOT.recording(0)
    assert recording.antennas == {0: (0.31, 0.0), 1: (0.31, 0.0)}
    apart = np.hypot(*(recording.trails[0].truth - recording.trails[1].truth)[0, :2])
    swing = np.abs(recording.ranges[:, 3] - apart)
    assert np.percentile(swing, 95) > 0.2


def test_corridors_are_long_and_narrow() -> None:
    trails = worlds.CORRIDOR.recording(1).trails.values()
    places = np.concatenate([trail.truth[:, :2] for trail in trails])
    spread = np.ptp(places, axis=0)
    assert spread[0] > 15
    assert spread[1] < 2.7


def test_wheels_that_slip_can_be_known_to_once_they_have() -> None:
    """A quarter of a metre too much, or ten degrees, of one robot since it has a pose."""
    slips = replace(worlds.SLIP, scene=replace(worlds.SLIP.scene, seconds=20.0))
    right, wrong = replace(slips, faults=()).recording(SLIPS_LATE), slips.recording(SLIPS_LATE)
    since, soonest = 8.0, np.inf
    for robot, trail in wrong.trails.items():
        way = turned = 0.0
        odometries = trail.odometry, right.trails[robot].odometry
        for k in np.flatnonzero(trail.t > since):
            steps = [product(inverted(poses[k - 1]), poses[k]) for poses in odometries]
            off = steps[0] - steps[1]
            way, turned = way + np.hypot(off[0], off[1]), turned + math.degrees(off[2])
            if way > 0.25 or abs(turned) > 10:
                soonest = min(soonest, trail.t[k])
                break
    assert slips.evident_s(SLIPS_LATE, since) == pytest.approx(soonest)
    assert sensor_faults.evident_in_wheels(right, wrong, 0.0) < since < soonest < np.inf
    assert sensor_faults.evident_in_wheels(right, wrong, np.inf) == np.inf
    assert worlds.BENT.evident_s(0, since) == since


def test_a_wall_can_be_known_to_be_there_once_it_is() -> None:
    """By ranges that are a quarter of a metre too long, of whichever pair."""
    right, wrong = replace(worlds.WALLED, faults=()).recording(4), worlds.WALLED.recording(4)
    built = wrong.ranges[wrong.ranges[:, 3] != right.ranges[:, 3], 0].min()
    assert 35 < built < 55
    assert worlds.WALLED.evident_s(4, built - 20.0) == built
    assert built + 20 < sensor_faults.evident_in_ranges(right, wrong, built + 20.0) < built + 20.2
    slightly = replace(right, ranges=right.ranges + [0, 0, 0, 0.249])
    assert sensor_faults.evident_in_ranges(right, slightly, 0.0) == np.inf
    more = replace(right, ranges=right.ranges + [0, 0, 0, 0.251])
    assert sensor_faults.evident_in_ranges(right, more, 0.05) == pytest.approx(0.1)
