"""Which pairs of a large team are solved."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray
from slam_problems import no_ranges

from drslamd.slam.optimizer import near_pairs
from drslamd.slam.optimizer.factors import Numbering
from drslamd.slam.optimizer.near_pairs import FEW, MOST, near_ones
from drslamd.slam.optimizer.problem import RangeFactors

Pair = tuple[int, int]
Flags = NDArray[np.bool_]


def ranges_of(seconds: list[list[Pair]], robots: int) -> tuple[RangeFactors, list[Pair]]:
    """Each second every robot has a pose, and some pairs measure each other.

    Returns:
        the ranges, and the pairs that they number.
    """
    names = sorted({pair for pairs in seconds for pair in pairs})
    rows = [
        (robots * t + i, robots * t + j, names.index((i, j)), i, j)
        for t, pairs in enumerate(seconds)
        for i, j in pairs
    ]
    i, j, pair, one, other = np.array(rows, dtype=np.int64).T
    there = replace(no_ranges(), i=i, j=j, pair=pair, robots=np.stack([one, other], axis=-1))
    return there, names


def taken(seconds: list[list[Pair]], robots: int, most: int, recent_from: int = 0) -> set[Pair]:
    ranges, names = ranges_of(seconds, robots)
    recent = np.arange(robots * len(seconds)) >= robots * recent_from
    stays = near_ones(ranges, len(names), recent, most)
    return {pair for pair, is_in in zip(names, stays.tolist(), strict=True) if is_in}


def count(pairs: set[Pair], robot: int) -> int:
    return sum(robot in pair for pair in pairs)


def everybody(robots: int) -> list[Pair]:
    return list(combinations(range(robots), 2))


@pytest.mark.parametrize(("robots", "most"), [(30, 120), (30, 200), (40, 120)])
def test_of_a_crowd_each_robot_keeps_some_and_all_together_no_more_than_there_is_room_for(
    robots: int, most: int
) -> None:
    found = taken([everybody(robots)], robots, most)
    assert most / 2 < len(found) <= most + robots * FEW / 2
    assert min(count(found, robot) for robot in range(robots)) >= FEW


def test_those_who_no_longer_meet_make_room() -> None:
    """All have met once; since nothing is thinned two halves of the team are apart."""
    halves = [(i, j) for i, j in everybody(24) if (i < 12) == (j < 12)]
    found = taken([everybody(24), halves, halves], 24, most=200, recent_from=1)
    assert found <= set(halves)
    assert len(found) > 100
    assert not taken([everybody(24), halves, halves], 24, most=200) <= set(halves)


def test_who_is_near_nobody_keeps_whom_it_left_last() -> None:
    """Robot 9 met one after the other and drove away; robots 0 to 8 are together."""
    together = everybody(9)
    before = [[*together, (k, 9)] for k in range(9)]
    found = taken([*before, together, together], 10, most=30, recent_from=9)
    assert {pair for pair in found if 9 in pair} == {(k, 9) for k in range(9 - FEW, 9)}


def test_who_meets_later_pushes_nobody_out_before_time_steps() -> None:
    """One more pair each second, of a team that has no room for all."""
    pairs = np.random.default_rng(2).permutation(everybody(30)).tolist()
    met = [tuple(pair) for pair in pairs]
    seconds = [met[: 150 + 5 * t] for t in range(40)]
    before: set[Pair] = set()
    for t in range(1, 40, 6):
        now = taken(seconds[:t], 30, most=150)
        assert before <= now
        before = now
    assert len(before) < len(seconds[-1])


class _AsSaid:
    """A graph that nobody asks."""


@pytest.mark.parametrize("robots", [50, 51])
def test_all_are_solved_of_as_many_robots_as_there_is_room_for(
    robots: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def none(ranges: RangeFactors, pairs: int, recent: Flags, most: int) -> Flags:
        asked.append(pairs)
        return np.asarray(np.arange(pairs) % 3 == 1)

    monkeypatch.setattr(near_pairs, "near_ones", none)
    ranges, names = ranges_of([everybody(robots)], robots)
    two, one = np.zeros((len(ranges), 2)), np.arange(1.0 * len(ranges))
    ranges = replace(ranges, q_i=two, q_j=two, turned=two, measured=one, sigma=one)
    places = Numbering(np.zeros(robots, dtype=int), np.arange(robots), {})
    found, pairs = near_pairs.solvable(_AsSaid(), places, ranges, names)  # type: ignore[arg-type]
    if robots == 50:
        assert len(names) == MOST
        assert found is ranges
        assert pairs is names
        assert not asked
        return
    assert asked == [len(names)]
    assert pairs == names[1::3]
    assert [names[int(k)] for k in found.measured] == [pairs[k] for k in found.pair]
