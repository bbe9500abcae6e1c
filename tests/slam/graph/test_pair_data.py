"""What the owner of a pair measured: what is kept of it, and what is not believed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import closure, range_item

from drslamd.conventions import Chain
from drslamd.slam.graph import pair_data
from drslamd.slam.graph.pair_data import BEST_SIGMA, FARTHEST_M, WORST_SIGMA, PairData

A, B = Chain(0, 5), Chain(1, 6)


def with_closures(*numbers: int) -> PairData:
    pair = PairData(A, B)
    for number in numbers:
        pair.add_closure(number, closure(number, 10 * number, B, 0, (0.0, 0.0, 0.0)))
    return pair


def test_ranges_stand_in_the_order_of_the_log_and_each_place_once() -> None:
    pair = PairData(A, B)
    for seq, place, metres in ((2, 0, 5.0), (1, 1, 4.0), (1, 0, 3.0), (2, 0, 5.0)):
        pair.add_range(seq, place, range_item(0, B, 0, metres))
    assert pair.ranges.range_m.tolist() == [3.0, 4.0, 5.0]


def test_a_closure_may_be_withdrawn_whichever_word_comes_first() -> None:
    said, withdrawn = closure(4, 0, B, 0, (1, 0, 0)), closure(4, 0, B, 0, (1, 0, 0), kept=False)
    for order in (((3, said), (5, withdrawn)), ((5, withdrawn), (3, said))):
        pair = PairData(A, B)
        for seq, item in order:
            pair.add_closure(seq, item)
        assert pair.kept_closures() == []
    pair.add_closure(6, said)
    assert pair.kept_closures() == [said]


def test_closures_are_given_by_their_numbers() -> None:
    assert [c.number for c in with_closures(3, 1, 2).kept_closures()] == [1, 2, 3]


@pytest.mark.parametrize("count", [9, 10, 11])
def test_the_last_ranges_and_closures_are_kept(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pair_data, "MAX_RANGES", 10)
    monkeypatch.setattr(pair_data, "MAX_CLOSURES", 10)
    pair = with_closures(*range(count))
    # the bound of ranges is taken when the pair is made
    for seq in reversed(range(count)):
        pair.add_range(seq, 0, range_item(seq, B, seq, 1.0))
    kept = list(range(max(0, count - 10), count))
    assert pair.ranges.a_n.tolist() == kept
    assert [c.number for c in pair.kept_closures()] == kept


def test_ranges_that_replace_others_are_all_there_is() -> None:
    pair = PairData(A, B)
    for seq in range(3):
        pair.add_range(seq, 0, range_item(seq, B, seq, 1.0 + seq))
    pair.replace_ranges(pair.ranges.chosen(np.array([0, 2])))
    assert pair.ranges.range_m.tolist() == [1.0, 3.0]


@pytest.mark.parametrize(
    ("metres", "is_taken"),
    [
        (0.999 * FARTHEST_M, True),
        (1.001 * FARTHEST_M, False),
        (-1.001 * FARTHEST_M, False),
        (math.nan, False),
    ],
)
def test_no_range_is_farther_than_any_radio_reaches(metres: float, is_taken: bool) -> None:
    pair = PairData(A, B)
    pair.add_range(0, 0, range_item(0, B, 0, metres))
    assert (len(pair.ranges) == 1) is is_taken


@pytest.mark.parametrize(("sigma", "is_taken"), [(1e-3, True), (0.0, False), (-0.1, False)])
def test_a_range_without_a_sigma_is_none(sigma: float, is_taken: bool) -> None:
    pair = PairData(A, B)
    pair.add_range(0, 0, range_item(0, B, 0, 5.0, sigma=sigma))
    assert (len(pair.ranges) == 1) is is_taken


@pytest.mark.parametrize("place", [0, 3, 5])
@pytest.mark.parametrize(
    ("sigma", "is_taken"),
    [
        (0.99 * BEST_SIGMA, False),
        (1.01 * BEST_SIGMA, True),
        (0.99 * WORST_SIGMA, True),
        (1.01 * WORST_SIGMA, False),
        (math.nan, False),
    ],
)
def test_every_part_of_a_closure_is_as_good_as_can_be_measured(
    place: int, sigma: float, is_taken: bool
) -> None:
    """Places of xx, yy and tt."""
    covariance = [0.01, 0.0, 0.0, 0.01, 0.0, 0.01]
    covariance[place] = sigma**2
    item = replace(closure(0, 0, B, 0, (1, 2, 3)), covariance=tuple(covariance))
    pair = PairData(A, B)
    pair.add_closure(0, item)
    assert bool(pair.kept_closures()) is is_taken


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("value", "is_taken"),
    [(0.999 * FARTHEST_M, True), (-1.001 * FARTHEST_M, False), (math.nan, False)],
)
def test_no_closure_leads_out_of_the_world(axis: int, value: float, is_taken: bool) -> None:
    pose = [1.0, 2.0, 3.0]
    pose[axis] = value
    pair = PairData(A, B)
    pair.add_closure(0, closure(0, 0, B, 0, pose))
    assert bool(pair.kept_closures()) is is_taken
