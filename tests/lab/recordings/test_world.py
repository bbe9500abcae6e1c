"""Simulated sensors are as wrong as their models say, each kind of error by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.recordings import world
from lab.recordings.recording import Array, Recording
from lab.recordings.world import OdometryModel, RangeModel, Scene
from lab.score import metrics

EXACT = RangeModel(bias=0.0, slow=0.0, white=0.0, burst_share=0.0, lost=0.0)
PERFECT = OdometryModel(0.0, 0.0, 0.0, 0.0)
SCENE = Scene(robots=2, seconds=100.0, ranges=EXACT, odometry=PERFECT)


def errors(recording: Recording) -> Array:
    """Measured minus true distance of robots 0 and 1 of all ranges, m."""
    t = recording.ranges[:, 0]
    places = [metrics.at_times(x.t, x.truth, t)[:, :2] for x in recording.trails.values()]
    return np.asarray(recording.ranges[:, 3] - np.hypot(*(places[0] - places[1]).T))


def with_ranges(seed: int = 1, seconds: float = 100.0, **model: float) -> Array:
    scene = replace(SCENE, seconds=seconds, ranges=replace(EXACT, **model))
    return errors(world.simulate(scene, seed))


def test_without_noise_ranges_and_odometry_are_true() -> None:
    recording = world.simulate(SCENE, 1)
    assert np.abs(errors(recording)).max() < 1e-9
    for trail in recording.trails.values():
        moved = metrics.compose(trail.truth[:1], trail.odometry)
        # an arc of one step is taken for its chord
        assert np.hypot(*(moved - trail.truth)[:, :2].T).max() < 0.02


def test_both_modules_measure_as_often_as_was_said() -> None:
    for hz, both in ((50, True), (10, True), (10, False)):
        scene = replace(SCENE, seconds=20.0, range_hz=hz, both_measure=both)
        observers = world.simulate(scene, 1).ranges[:, 1]
        assert np.sum(observers == 0) == 20 * hz
        assert np.sum(observers == 1) == (20 * hz if both else 0)


def test_a_bias_is_one_number_for_a_pair_and_another_for_each_seed() -> None:
    found = np.array([with_ranges(seed, 2.0, bias=0.1)[[0, -1]] for seed in range(40)])
    assert found[:, 0] == pytest.approx(found[:, 1])
    assert 0.07 < found[:, 0].std() < 0.13


def test_white_noise_has_its_sigma_and_no_memory() -> None:
    found = with_ranges(white=0.02)
    one = found.reshape(-1, 2)[:, 0]
    assert one.std() == pytest.approx(0.02, rel=0.05)
    assert abs(np.corrcoef(one[:-1], one[1:])[0, 1]) < 0.05


def test_slow_bias_is_forgotten_by_1_over_e_in_its_time() -> None:
    series = [with_ranges(seed, slow=0.06, slow_s=2.5).reshape(-1, 2)[:, 0] for seed in range(8)]
    lag = round(2.5 / world.STEP_S)
    assert np.std(series) == pytest.approx(0.06, rel=0.2)
    kept = np.mean([np.corrcoef(x[:-lag], x[lag:])[0, 1] for x in series])
    assert kept == pytest.approx(np.exp(-1), abs=0.12)


def test_bursts_are_long_and_as_rare_as_was_said() -> None:
    found = np.concatenate([with_ranges(seed, burst_share=0.05) for seed in range(8)])
    inside = found > 1e-9
    assert 0.03 < inside.mean() < 0.07
    assert found[inside].min() >= EXACT.burst_least
    assert found[inside].mean() == pytest.approx(0.6, abs=0.1)


def test_a_share_of_ranges_is_lost() -> None:
    assert len(with_ranges(lost=0.2)) == pytest.approx(0.8 * 2 * 5000, rel=0.03)


@pytest.mark.parametrize("sigma", [0.03, 0.1])
def test_a_wrong_scale_makes_every_way_as_much_longer_or_shorter(sigma: float) -> None:
    ratios = []
    for seed in range(20):
        scene = replace(SCENE, seconds=20.0, odometry=replace(PERFECT, scale=sigma))
        for trail in world.simulate(scene, seed).trails.values():
            ways = (np.hypot(*np.diff(p[:, :2], axis=0).T) for p in (trail.odometry, trail.truth))
            seen, true = (way.sum() for way in ways)
            ratios.append(seen / true - 1)
    assert np.std(ratios) == pytest.approx(sigma, rel=0.35)


def test_the_same_seed_gives_the_same_recording() -> None:
    scene = Scene(robots=2, seconds=5.0)
    one, same, other = (world.simulate(scene, seed).ranges for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert len(one) != len(other) or not np.array_equal(one, other)


def test_a_gyro_errs_by_a_constant_rate_and_at_random() -> None:
    """Over many robots: 10 deg/h are 1 degree in 353 s, 0.01 deg/sqrt(s) are 0.19."""
    scene = world.Scene(robots=1, seconds=60.0, odometry_hz=10, range_hz=1)
    plain = world.simulate(scene, 3)
    ends = []
    for seed in range(300):
        trail = world.with_gyros(plain, seed).trails[0]
        assert trail.gyro is not None
        turned = np.unwrap(trail.truth[:, 2])
        ends.append(np.degrees(trail.gyro[-1] - (turned[-1] - turned[0])))
    expected = np.hypot(10 * 60 / 3600, 0.01 * np.sqrt(60))
    assert np.std(ends) == pytest.approx(expected, rel=0.15)
    assert plain.trails[0].gyro is None
