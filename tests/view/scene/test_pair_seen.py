"""What two robots measured, held against their paths."""

from __future__ import annotations

import math

import numpy as np
import pytest
from onlooked_team import two

from drslamd.slam.graph.measurements import RangeMeasurement
from drslamd.view.scene.pair_seen import (
    CLOSURES,
    FEWEST,
    LATELY_S,
    RESIDUALS,
    ClosureSeen,
    PairSeen,
    closure_seen,
    residual,
)


def a_closure(number: int, kept: bool = True) -> ClosureSeen:
    return ClosureSeen(number, 1.0, kept, ((0.0, 0.0), (1.0, 1.0)), 0.0)


def test_a_residual_is_the_distance_of_the_antennas_minus_the_range() -> None:
    _, b = two()
    r = RangeMeasurement(0, b.chain, 0, (1.0, 0.0), (0.0, 2.0), 4.0, 0.1)
    # a looks along x from the origin, b along y from (4, 5): its left is the negative x
    w_T_a, w_T_b = np.array([0.0, 0.0, 0.0]), np.array([4.0, 5.0, math.pi / 2])
    assert residual(r, w_T_a, w_T_b) == pytest.approx(math.hypot(2 - 1, 5) - 4)


def test_the_constant_part_is_the_bias_and_the_rest_the_scatter() -> None:
    pair = PairSeen()
    for k in range(200):
        pair.add_residual(0.1 * k, 0.3 + (0.05 if k % 2 else -0.05))
    found = pair.scatter(20.0)
    assert found is not None
    assert found.bias_m == pytest.approx(0.3, abs=0.051)
    assert found.rms_m == pytest.approx(math.sqrt((0.05**2 + 0.05**2) / 2), rel=0.5)


def test_the_scatter_is_that_of_late_against_the_bias_of_all() -> None:
    pair = PairSeen()
    for k in range(100):
        pair.add_residual(k, 0.1)
    for k in range(10):
        pair.add_residual(100 + k, 0.7)
    found = pair.scatter(110.0)
    assert found is not None
    assert found.bias_m == pytest.approx(0.1)
    # 10 of the last 20 s are 0.6 m off, the other 9 not at all
    assert found.rms_m == pytest.approx(0.6 * math.sqrt(10 / 19))


@pytest.mark.parametrize(("count", "is_said"), [(FEWEST - 1, False), (FEWEST, True)])
def test_too_few_ranges_say_nothing(count: int, is_said: bool) -> None:
    pair = PairSeen()
    for k in range(count):
        pair.add_residual(k, 0.0)
    assert (pair.scatter(count) is not None) is is_said
    assert pair.scatter(count + LATELY_S) is None


def test_a_scatter_is_told_once_and_kept_every_five_seconds() -> None:
    pair = PairSeen()
    told = []
    for k in range(60):
        pair.add_residual(k, float(k % 3))
        told.append(pair.renew(k))
    assert told[0] is None
    assert told[-3:] != [None] * 3
    assert pair.renew(59) is None
    assert 10 <= len(pair.past) <= 13


def test_residuals_and_closures_are_bounded() -> None:
    pair = PairSeen()
    for k in range(2 * RESIDUALS):
        pair.add_residual(k, 0.0)
        pair.add_closure(0, a_closure(k))
    assert len(pair._residuals) == RESIDUALS
    assert next(c.number for c in pair.closures.values()) == 2 * RESIDUALS - CLOSURES


def test_a_withdrawal_takes_the_place_of_its_closure() -> None:
    pair = PairSeen()
    pair.add_closure(0, a_closure(4))
    pair.add_closure(1, a_closure(4))
    pair.add_closure(0, a_closure(4, kept=False))
    assert {key: c.kept for key, c in pair.closures.items()} == {(0, 4): False, (1, 4): True}
    pair.forget_closures(0)
    assert list(pair.closures) == [(1, 4)]


@pytest.mark.parametrize("off_m", [0.0, 0.8])
def test_a_closure_is_as_far_off_as_it_contradicts_the_paths(off_m: float) -> None:
    a, b = two()
    seen = closure_seen(a.closure_to(b, 3.0, 7, off_m=off_m), 3.5, a.truth(3), b.truth(3))
    assert seen.off_m == pytest.approx(off_m, abs=1e-9)
    assert seen.ends == (tuple(a.truth(3)[:2]), tuple(b.truth(3)[:2]))
    assert (seen.number, seen.kept, seen.t) == (7, True, 3.5)
