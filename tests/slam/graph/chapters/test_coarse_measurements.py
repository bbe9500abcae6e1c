"""Measurements in steps of what they can tell."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from drslamd.conventions import Chain
from drslamd.gossip import bounds
from drslamd.slam.graph.chapters.coarse_measurements import (
    WHOLE_WAY_STEPS,
    coarse_closure,
    coarse_keyframe,
    coarse_range,
)
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe, RangeMeasurement

PEER = Chain(1, 1)
COVARIANCE = (0.013, 0.001, 0.0002, 0.021, -0.003, 0.0077)


def a_range(sigma_m: float, chance: random.Random) -> RangeMeasurement:
    arms = [(round(chance.uniform(-2, 2), 3), round(chance.uniform(-2, 2), 3)) for _ in "ab"]
    turns = [round(chance.uniform(-1, 1), 4) for _ in "ab"]
    metres = round(chance.uniform(0, 60), 4)
    return RangeMeasurement(10, PEER, 20, arms[0], arms[1], metres, sigma_m, *turns)


@pytest.mark.parametrize(("sigma_m", "step_m"), [(0.1, 0.008), (0.064, 0.008), (0.063, 0.004)])
def test_a_range_is_said_in_steps_of_an_eighth_of_its_sigma_or_less(
    sigma_m: float, step_m: float
) -> None:
    chance = random.Random(1)
    errors = []
    for _ in range(200):
        item = a_range(sigma_m, chance)
        said = coarse_range(item)
        for value in (said.range_m, *said.q_a, *said.q_b):
            assert value / step_m == pytest.approx(round(value / step_m), abs=1e-6)
        errors += [said.range_m - item.range_m, said.q_a[0] - item.q_a[0]]
        errors += [0.3 * (said.turn_a - item.turn_a)]
        assert replace(said, q_a=(0, 0), q_b=(0, 0), range_m=0, turn_a=0, turn_b=0) == replace(
            item, q_a=(0, 0), q_b=(0, 0), range_m=0, turn_a=0, turn_b=0
        )
    assert np.abs(errors).max() <= step_m / 2 + 1e-9
    assert np.std(errors) < sigma_m / 20


@pytest.mark.parametrize("sigma_m", [0.001, 0.008, 0.015])
def test_a_range_as_sure_as_its_last_digit_stays_as_it_is(sigma_m: float) -> None:
    item = replace(a_range(sigma_m, random.Random(2)), turn_a=0.0, turn_b=0.0)
    said = coarse_range(item)
    assert abs(said.range_m - item.range_m) <= 0.0005
    assert said.q_a == pytest.approx(item.q_a, abs=1e-9)


def test_what_is_in_steps_stays_as_it_is() -> None:
    chance = random.Random(3)
    for sigma in (0.02, 0.05, 0.1, 0.3, 2.0):
        once = coarse_range(a_range(sigma, chance))
        assert coarse_range(once) == once
    closure = ClosureMeasurement(0, True, 0, PEER, 0, (1.0, 2.0, 0.5), COVARIANCE)
    assert coarse_closure(coarse_closure(closure)) == coarse_closure(closure)
    fine = coarse_keyframe(Keyframe(7, 2, 12_343, -12_343, 31_416), WHOLE_WAY_STEPS)
    assert fine == Keyframe(7, 2, 12_345, -12_345, 31_415)
    keyframe = coarse_keyframe(Keyframe(7, 2, 12_345, -12_345, 31_416))
    assert coarse_keyframe(keyframe) == keyframe == Keyframe(7, 2, 12_340, -12_340, 31_420)


def a_closure(pose: tuple[float, float, float], covariance: object) -> ClosureMeasurement:
    numbers = tuple(np.float32(v).item() for v in covariance)  # type: ignore[attr-defined]
    return ClosureMeasurement(0, True, 0, PEER, 0, pose, numbers)


def test_a_closure_is_said_in_steps_of_an_eighth_of_what_each_number_alone_tells() -> None:
    """Of what a sigma of 0.1 m and 0.1 rad would be, 6.4 mm and 6.4 mrad: of the 12.5 mm the power
    of two tenths of millimetres below."""
    said = coarse_closure(a_closure((1.23456, -2.34567, 0.34567), (0.01, 0, 0, 0.01, 0, 0.01)))
    assert said.a_T_b == pytest.approx((193 * 0.0064, -367 * 0.0064, 54 * 0.0064))


def test_closures_are_as_uncertain_as_before_but_for_a_hundredth() -> None:
    """Also those that are sure in one direction alone, and all stay as they are said again."""
    chance = np.random.default_rng(4)
    moved = []
    for _ in range(300):
        spread = chance.normal(size=(3, 3)) * np.array([[0.3], [0.3], [0.05]])
        spread[:, 0] *= chance.uniform(0.05, 1)
        covariance = spread @ spread.T + 1e-5 * np.eye(3)
        pose = tuple(np.round(chance.uniform(-3, 3, 3), 4).tolist())
        item = a_closure(pose, covariance[np.triu_indices(3)])
        said = coarse_closure(item)
        assert coarse_closure(said) == said
        off = np.subtract(said.a_T_b, pose)
        moved.append(off @ np.linalg.solve(covariance, off))
    assert np.mean(moved) < 3 * 0.01
    assert np.mean(moved) > 3 * 0.0001


@pytest.mark.parametrize("sign", [-1, 1])
def test_what_lies_at_its_bound_stays_within_it(sign: int) -> None:
    """Half a turn, arms of 16 bits, ten kilometres: the next step would be one too far."""
    item = replace(
        a_range(0.2, random.Random(5)),
        q_a=(sign * 32.766, 0.0), range_m=sign * 9_999.999, turn_a=sign * 3.1415,
    )  # fmt: skip
    said = coarse_range(item)
    assert said.q_a[0] == pytest.approx(sign * 32.752)
    assert said.range_m == pytest.approx(sign * 9_999.984)
    assert said.turn_a == pytest.approx(sign * 490 * 0.0064)
    closure = a_closure((sign * 9_999.999, 0.0, sign * 3.1415), (0.04, 0, 0, 0.04, 0, 0.01))
    x, _, theta = coarse_closure(closure).a_T_b
    assert 9_999.95 < sign * x < 10_000
    assert 3.13 < sign * theta < np.pi


@pytest.mark.parametrize(("variance", "stays"), [(1.000001e-8, True), (1.01e-8, False)])
def test_a_variance_that_fewer_digits_bring_below_its_bound_keeps_them_all(
    variance: float, stays: bool
) -> None:
    item = a_closure((1.0, 2.0, 0.5), (variance, 0, 0, 0.04, 0, 0.01))
    assert bounds.is_sayable(item)
    assert bounds.is_sayable(coarse_closure(item))
    assert (coarse_closure(item) == item) is stays


def test_a_covariance_keeps_its_nine_first_binary_digits() -> None:
    said = coarse_closure(ClosureMeasurement(0, True, 0, PEER, 0, (1.0, 2.0, 0.5), COVARIANCE))
    assert said.covariance == pytest.approx(COVARIANCE, rel=2**-10)
    assert said.covariance != COVARIANCE
    assert all(np.float32(v) == v for v in said.covariance)
    assert all(np.array(said.covariance, np.float32).view(np.uint32) % 2**14 == 0)


def test_a_covariance_that_would_be_none_with_fewer_digits_keeps_them_all() -> None:
    edge = tuple(float(np.float32(v)) for v in (1.0, 0.99999, 0.0, 1.0, 0.0, 1.0))
    item = ClosureMeasurement(0, True, 0, PEER, 0, (1.0, 2.0, 0.5), edge)
    assert coarse_closure(item).covariance == edge
