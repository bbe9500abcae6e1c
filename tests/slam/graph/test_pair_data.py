"""What the owner of a pair measured: what is kept of it, and what is not believed."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from slam_scenes import closure, range_item

from drslamd.conventions import Chain
from drslamd.slam.graph import pair_data, timed_rows
from drslamd.slam.graph.chapters.books import PER_ENTRY
from drslamd.slam.graph.clocks import Ahead
from drslamd.slam.graph.pair_data import BEST_SIGMA, FARTHEST_M, WORST_SIGMA, PairData

A, B = Chain(0, 5), Chain(1, 6)


def with_closures(*numbers: int) -> PairData:
    pair = PairData(A, B)
    for number in numbers:
        pair.add_closure(
            PER_ENTRY * number + 0, closure(number, 10 * number, B, 0, (0.0, 0.0, 0.0)), number
        )
    return pair


def test_ranges_of_one_keyframe_stand_in_the_order_of_the_log_and_each_place_once() -> None:
    pair = PairData(A, B)
    for seq, place, metres in ((2, 0, 5.0), (1, 1, 4.0), (1, 0, 3.0), (2, 0, 5.0)):
        pair.add_range(PER_ENTRY * seq + place, range_item(0, B, 0, metres), seq)
    assert pair.ranges.range_m.tolist() == [3.0, 4.0, 5.0]


def test_a_closure_may_be_withdrawn_whichever_word_comes_first() -> None:
    said, withdrawn = closure(4, 0, B, 0, (1, 0, 0)), closure(4, 0, B, 0, (1, 0, 0), kept=False)
    for order in (((3, said), (5, withdrawn)), ((5, withdrawn), (3, said))):
        pair = PairData(A, B)
        for seq, item in order:
            pair.add_closure(PER_ENTRY * seq + 0, item, seq)
        assert pair.kept_closures() == []
    pair.add_closure(PER_ENTRY * 6 + 0, said, 6)
    assert pair.kept_closures() == [said]


def test_closures_are_given_by_their_numbers() -> None:
    assert [c.number for c in with_closures(3, 1, 2).kept_closures()] == [1, 2, 3]


@pytest.mark.parametrize("count", [9, 10, 11])
def test_so_many_ranges_and_closures_are_held(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The oldest blocks, here of one keyframe of the owner, go first."""
    monkeypatch.setattr(timed_rows, "BLOCK", 10)
    # the bounds are taken when the pair is made
    monkeypatch.setattr(pair_data, "MAX_RANGES", 10)
    monkeypatch.setattr(pair_data, "MAX_CLOSURES", 10)
    pair = with_closures(*range(count))
    for seq in reversed(range(count)):
        pair.add_range(PER_ENTRY * seq + 0, range_item(10 * seq, B, seq, 1.0), seq)
    kept = list(range(max(0, count - 10), count))
    assert pair.ranges.a_n.tolist() == [10 * seq for seq in kept]
    assert [c.number for c in pair.kept_closures()] == kept


def test_a_word_of_a_closure_counts_by_its_place_in_the_log() -> None:
    """One entry may say a closure and withdraw it."""
    said = closure(4, 0, B, 0, (1, 0, 0))
    for places, kept in (((0, 1), []), ((1, 0), [said])):
        pair = PairData(A, B)
        pair.add_closure(PER_ENTRY * 3 + places[0], said, 3)
        pair.add_closure(PER_ENTRY * 3 + places[1], replace(said, kept=False), 3)
        assert pair.kept_closures() == kept


def test_measurements_say_how_the_clocks_of_the_two_differ() -> None:
    pair = PairData(A, B)
    assert pair.ahead() is None
    for k in range(4):
        pair.add_range(PER_ENTRY * k + 0, range_item(10 * k, B, 10 * k + 700, 5.0), k)
    pair.add_closure(PER_ENTRY * 4 + 0, closure(0, 40, B, 741, (1, 0, 0)), 4)
    assert pair.ahead() == Ahead(700.2, 5)
    # robot b stood still for a while
    pair.add_range(PER_ENTRY * 5 + 0, range_item(50, B, 110, 5.0), 5)
    assert pair.ahead() == Ahead(700.2, 5)


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
    pair.add_range(PER_ENTRY * 0 + 0, range_item(0, B, 0, metres), 0)
    assert (len(pair.ranges) == 1) is is_taken


@pytest.mark.parametrize(("sigma", "is_taken"), [(1e-3, True), (0.0, False), (-0.1, False)])
def test_a_range_without_a_sigma_is_none(sigma: float, is_taken: bool) -> None:
    pair = PairData(A, B)
    pair.add_range(PER_ENTRY * 0 + 0, range_item(0, B, 0, 5.0, sigma=sigma), 0)
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
    pair.add_closure(PER_ENTRY * 0 + 0, item, 0)
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
    pair.add_closure(PER_ENTRY * 0 + 0, closure(0, 0, B, 0, pose), 0)
    assert bool(pair.kept_closures()) is is_taken
