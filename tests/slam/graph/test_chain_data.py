"""One chain: its keyframes, the sums along it, and what its robot says of its sensors."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, keyframes, model_of, wander

from drslamd.conventions import Chain
from drslamd.slam.graph import chain_data, timed_rows
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.odometry.noise import GYRO, growth
from drslamd.slam.robot_model import UNTOLD, RobotModel

A = Chain(0, 5)


def test_keyframes_come_in_steps_and_are_kept_in_metres_and_radians() -> None:
    data = ChainData(A)
    data.add(Keyframe(40, 2, 10_000, -20_000, 31_416))
    assert data.keyframes.n.tolist() == [40]
    assert data.keyframes.segment.tolist() == [2]
    assert data.keyframes.poses[0] == pytest.approx([1.0, -2.0, math.pi], abs=1e-5)


def sums_between(items: ChainData, i: int, k: int) -> np.ndarray:
    at, there = items.keyframes.find(np.array([i, k], dtype=float))
    assert there.all()
    return np.asarray(items.sums[at[1]] - items.sums[at[0]])


@pytest.fixture
def forty_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chains hold the newest four blocks of ten samples."""
    monkeypatch.setattr(timed_rows, "BLOCK", 10)
    monkeypatch.setattr(timed_rows, "HELD_BLOCKS", 4)


@pytest.mark.usefixtures("forty_held")
def test_a_chain_holds_the_newest_blocks_of_keyframes() -> None:
    items = ChainData(A)
    for k in keyframes(range(85), wander(np.random.default_rng(3), 85, 0.4)):
        items.add(k)
        first = max(0, k.n // 10 - 3) * 10
        assert items.keyframes.n.tolist() == list(range(first, k.n + 1))


def test_a_chain_that_says_more_than_fits_gives_up_its_oldest_blocks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(timed_rows, "BLOCK", 10)
    # the bound is taken when the chain is made
    monkeypatch.setattr(chain_data, "MAX_KEYFRAMES", 30)
    items = ChainData(A)
    for k in keyframes(range(80), wander(np.random.default_rng(3), 80, 0.4)):
        items.add(k)
    assert items.keyframes.n.tolist() == list(range(50, 80))


@pytest.mark.usefixtures("forty_held")
def test_sums_are_those_of_the_whole_chain_however_it_came() -> None:
    path = wander(np.random.default_rng(4), 60, 0.4)
    frames = keyframes(range(60), path)
    expected = growth(np.array([[k.x, k.y, k.theta] for k in frames]) * 1e-4)
    shuffle = random.Random(5)
    for _ in range(10):
        order = list(frames)
        shuffle.shuffle(order)
        items = ChainData(A)
        for k in order:
            items.add(k)
            if shuffle.random() < 0.5:
                assert len(items.sums) == len(items.keyframes.rows)
        assert items.keyframes.n.tolist() == list(range(20, 60))
        assert np.allclose(sums_between(items, 25, 55), expected[55] - expected[25])


@pytest.mark.usefixtures("forty_held")
def test_what_came_late_or_was_dropped_does_not_move_the_sums() -> None:
    """Candidates of module 2 remember them."""
    frames = keyframes(range(70), wander(np.random.default_rng(6), 70, 0.4))
    items = ChainData(A)
    for k in frames[20:45]:
        items.add(k)
    remembered = items.sums[items.keyframes.find(np.array([30.0]))[0][0]].copy()
    for part in (frames[15:20], frames[45:60], frames[10:15], frames[60:]):
        for k in part:
            items.add(k)
        now = items.sums[items.keyframes.find(np.array([30.0]))[0][0]]
        assert np.allclose(now, remembered, atol=1e-9)
    assert items.keyframes.n[0] == 30


def test_keyframes_that_somebody_took_stay_as_they_were_when_others_come_late() -> None:
    """A job of another thread may still read them."""
    frames = keyframes(range(0, 100, 10), wander(np.random.default_rng(7), 10, 0.4))
    items = ChainData(A)
    for k in frames[:4] + frames[5:]:
        items.add(k)
    taken, sums = items.keyframes.rows, items.sums
    before, sums_before = taken.copy(), sums.copy()
    items.add(frames[4])
    assert len(items.keyframes) == 10
    assert len(items.sums) == 10
    assert np.array_equal(taken, before)
    assert np.array_equal(sums, sums_before)


def test_a_segment_never_comes_back_whatever_a_robot_says() -> None:
    items = ChainData(A)
    for n, segment in enumerate([0, 3, 1, 1, 5, 0]):
        items.add(Keyframe(n, segment, 0, 0, 0))
    assert items.keyframes.rows[:, 1].tolist() == [0, 3, 3, 3, 5, 5]
    assert [items.keyframes.of_segment(s) for s in (0, 3, 5)] == [
        slice(0, 1),
        slice(1, 4),
        slice(4, 6),
    ]


def test_a_segment_that_ended_minutes_ago_does_not_come_back_either() -> None:
    """However often somebody looked in between."""
    items = ChainData(A)
    for n, segment, expected in ((0, 4, [4]), (9_000, 2, [4, 4]), (18_000, 5, [4, 4, 5])):
        items.add(Keyframe(n, segment, 0, 0, 0))
        assert items.keyframes.segment.tolist() == expected


def test_until_it_has_spoken_a_robot_is_like_any_other() -> None:
    assert ChainData(A).model == UNTOLD


def test_the_latest_entry_says_what_the_sensors_are_like() -> None:
    data = ChainData(A)
    for seq in (3, 9, 5):
        data.take_model(seq, model_of(NOISE, (0.1 * seq, 0.0)))
    assert data.model.antenna == pytest.approx([0.9, 0.0])


@pytest.mark.parametrize(
    ("model", "is_believed"),
    [
        (model_of(replace(NOISE, scale=0.4)), True),
        (model_of(replace(NOISE, scale=9.0)), False),
        (model_of(replace(NOISE, translation_per_sqrt_m=0.0)), False),
        (model_of(NOISE, (4.9, 0.0)), True),
        (model_of(NOISE, (9.0, 0.0)), False),
        (model_of(NOISE, (0.0, math.nan)), False),
    ],
)
def test_a_model_that_no_configuration_allows_is_not_believed(
    model: RobotModel, is_believed: bool
) -> None:
    data = ChainData(A)
    data.take_model(0, model)
    assert data.model == (model if is_believed else UNTOLD)


def test_sums_are_those_of_the_gyro_that_the_robot_last_spoke_of() -> None:
    data = ChainData(A)
    path = wander(np.random.default_rng(5), 30, 0.4)
    for k in keyframes(range(20), path[:20]):
        data.add(k)
    by_wheels = data.sums
    assert by_wheels[-1, GYRO.start] == 0.0
    gyro = GyroNoise(0.01, 0.001, 5)
    data.take_model(1, replace(UNTOLD, noise=replace(NOISE, gyro=gyro)))
    n, poses = data.keyframes.rows[:, 0], data.keyframes.poses
    assert data.sums == pytest.approx(growth(poses, gyro.seconds(n, poses)))
    assert data.sums[-1, GYRO.start] == pytest.approx((n[-1] - 5) / 10)
    for k in keyframes(range(30), path)[20:]:
        data.add(k)
    assert data.sums[-1, GYRO.start] == pytest.approx((data.keyframes.n[-1] - 5) / 10)
    data.take_model(2, replace(UNTOLD, noise=NOISE))
    assert data.sums[:20] == pytest.approx(by_wheels)
