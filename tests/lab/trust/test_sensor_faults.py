"""Each fault makes sensors as wrong as it says, and no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.recordings import world
from lab.recordings.recording import Array, Recording, Trail
from lab.recordings.world import OdometryModel, RangeModel, Scene
from lab.score import metrics
from lab.trust import paths, sensor_faults
from lab.trust.sensor_faults import Fault

EXACT = RangeModel(bias=0.0, slow=0.0, white=0.0, burst_share=0.0, lost=0.0)
PERFECT = OdometryModel(0.0, 0.0, 0.0, 0.0)
SCENE = Scene(2, 400.0, ranges=EXACT, odometry=PERFECT, range_hz=10, odometry_hz=10)
RECORDING = world.simulate(SCENE, 1)


def faulty(fault: Fault, recording: Recording = RECORDING, seed: int = 3) -> Recording:
    return fault(np.random.default_rng(seed), recording)


def extra(fault: Fault, recording: Recording = RECORDING, seed: int = 3) -> Array:
    """How much longer each range has become, m."""
    return np.asarray(faulty(fault, recording, seed).ranges[:, 3] - recording.ranges[:, 3])


def driven(trail: Trail) -> Array:
    """(m, 2) forward, m, and turned, rad, from stamp to stamp by odometry."""
    step = metrics.relative(trail.odometry[:-1], trail.odometry[1:])
    return np.column_stack([np.hypot(step[:, 0], step[:, 1]), step[:, 2]])


# wheels


def test_wheels_that_slip_say_by_half_more_in_the_share_that_is_stated() -> None:
    slipped = faulty(sensor_faults.slipping)
    shares = []
    for robot, trail in RECORDING.trails.items():
        before, after = driven(trail)[:, 0], driven(slipped.trails[robot])[:, 0]
        moves = before > 0.01
        times = after[moves] / before[moves]
        slips = times > 1.25
        assert times[slips] == pytest.approx(1 + sensor_faults.SLIP_MORE, abs=0.02)
        assert times[~slips] == pytest.approx(1.0, abs=0.02)
        shares.append(slips.mean())
    assert np.mean(shares) == pytest.approx(sensor_faults.SLIP_SHARE, abs=0.03)


def test_bases_that_are_pushed_turn_by_as_much_as_often_as_is_stated() -> None:
    slipped = faulty(sensor_faults.slipping)
    for robot, trail in RECORDING.trails.items():
        turned = driven(slipped.trails[robot])[:, 1] - driven(trail)[:, 1]
        total = np.degrees(np.abs(turned).sum())
        times = SCENE.seconds / 60 * sensor_faults.JERKS_PER_MINUTE
        assert total == pytest.approx(times * sensor_faults.JERK_DEG, rel=0.1)
        assert np.count_nonzero(np.abs(turned) > 1e-6) <= 3 * times


def test_wheels_that_slip_leave_truth_and_ranges() -> None:
    slipped = faulty(sensor_faults.slipping)
    assert np.array_equal(slipped.ranges, RECORDING.ranges)
    for robot, trail in RECORDING.trails.items():
        assert np.array_equal(slipped.trails[robot].truth, trail.truth)


# ranges


def test_sight_is_blocked_in_the_share_of_time_and_for_as_long_as_is_stated() -> None:
    found = np.concatenate([extra(sensor_faults.blocked, seed=seed) for seed in range(8)])
    inside = found > 0
    assert inside.mean() == pytest.approx(sensor_faults.BLOCKED_SHARE, abs=0.08)
    assert found[inside].min() >= sensor_faults.BLOCKED_LEAST_M
    assert found.min() == 0
    mean = sensor_faults.BLOCKED_LEAST_M + sensor_faults.BLOCKED_MEAN_M
    assert found[inside].mean() == pytest.approx(mean, abs=0.3)
    one = found[:: 2 * SCENE.range_hz] > 0  # both modules measure, so this is once a second
    begins = np.count_nonzero(one[1:] & ~one[:-1])
    assert one.sum() / begins == pytest.approx(sensor_faults.BLOCKED_S, rel=0.3)


def test_both_modules_of_a_pair_are_blocked_alike() -> None:
    found = faulty(sensor_faults.blocked)
    sides = [found.ranges[found.ranges[:, 1] == robot][:, [0, 3]] for robot in (0, 1)]
    assert np.array_equal(sides[0], sides[1])


def test_a_wall_hides_one_pair_from_some_moment_on() -> None:
    scene = replace(SCENE, robots=3, seconds=60.0)
    before = world.simulate(scene, 3)
    after = sensor_faults.walled(np.random.default_rng(5), before)
    more = after.ranges[:, 3] - before.ranges[:, 3]
    hidden = more > 0
    assert np.unique(np.sort(after.ranges[hidden, 1:3], axis=1), axis=0).shape == (1, 2)
    size, since = np.unique(more[hidden].round(9)), after.ranges[hidden, 0].min()
    assert len(size) == 1
    assert sensor_faults.WALL_M[0] <= size[0] <= sensor_faults.WALL_M[1]
    assert sensor_faults.WALL_S[0] <= since <= sensor_faults.WALL_S[1] + 1 / scene.range_hz
    pair = (np.sort(after.ranges[:, 1:3], axis=1) == np.sort(after.ranges[hidden][0, 1:3])).all(1)
    assert (hidden == (pair & (after.ranges[:, 0] >= since))).all()


def test_heavy_tails_are_as_wide_as_stated_and_know_no_bounds() -> None:
    found = extra(sensor_faults.heavy_tailed)
    # half of Student's t of 2 degrees is within 0.816
    assert np.median(np.abs(found)) == pytest.approx(0.816 * sensor_faults.TAILS_M, rel=0.1)
    assert np.abs(found).max() > 10 * sensor_faults.TAILS_M
    assert abs(np.median(found)) < 0.005


@pytest.mark.parametrize("configured", [True, False])
def test_an_antenna_off_the_axle_is_where_it_is_said_to_be(configured: bool) -> None:
    places = {0: (0.3, 0.0), 1: (-0.45, 0.2)}
    moved = faulty(sensor_faults.off_axle(places, configured))
    t = moved.ranges[:, 0]
    antennas = []
    for robot, (x, y) in places.items():
        truth = metrics.at_times(RECORDING.trails[robot].t, RECORDING.trails[robot].truth, t)
        c, s = np.cos(truth[:, 2]), np.sin(truth[:, 2])
        antennas.append(truth[:, :2] + np.column_stack([c * x - s * y, s * x + c * y]))
    assert moved.ranges[:, 3] == pytest.approx(np.hypot(*(antennas[0] - antennas[1]).T), abs=0.02)
    assert moved.antennas == (places if configured else {})


def test_a_bias_that_moves_with_bearing_moves_by_as_much_as_is_stated() -> None:
    spots = paths.on_the_spot(np.random.default_rng(2), SCENE)
    spots[1][:, 2] = 0.0  # one turns, so the other's share is constant
    recording = world.recorded("spots", np.random.default_rng(2), SCENE, spots)
    least, most = sensor_faults.SWING_M
    swings = [np.ptp(extra(sensor_faults.bearing_biased, recording, seed)) for seed in range(30)]
    assert least - 1e-6 <= min(swings)
    assert max(swings) <= most + 1e-6
    assert np.ptp(swings) > 0.6 * (most - least)


def test_a_bias_that_moves_with_bearing_is_the_same_after_a_whole_turn() -> None:
    spots = paths.on_the_spot(np.random.default_rng(2), SCENE)
    spots[0][:, 2] = np.arange(len(spots[0])) * 0.02 * 2 * np.pi / 20  # a turn in 20 s
    spots[1][:, 2] = 0.0
    recording = world.recorded("spots", np.random.default_rng(2), SCENE, spots)
    found = extra(sensor_faults.bearing_biased, recording)
    turn = 20 * 2 * SCENE.range_hz
    assert found[turn:] == pytest.approx(found[:-turn], abs=1e-6)
    assert np.ptp(found[: turn // 2]) > 0.01


def test_standing_nodes_and_other_pairs_are_left_alone() -> None:
    rows = np.array([[0.0, 0, 1, 2.0], [0.1, 1, 0, 2.0], [0.1, 0, 2, 3.0]])
    found = sensor_faults.lengthened(
        replace(RECORDING, ranges=rows), lambda a, b, t: (10 * b + t) * (a == 0)
    )
    assert found.ranges[:, 3] == pytest.approx([12.0, 12.1, 23.1])
