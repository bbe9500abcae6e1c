"""How the clocks of robots differ, from what they measured with each other."""

from __future__ import annotations

import random

import pytest

from drslamd.slam.graph import timed_rows
from drslamd.slam.graph.clocks import SAME_TIME, Ahead, ClockDifferences, shifts
from drslamd.slam.graph.timed_rows import BLOCK, TimedRows


def table_of(pairs: list[tuple[int, int]]) -> TimedRows:
    """Measurements between keyframes a_n and b_n."""
    table = TimedRows(3, identity=2, most=1_000)
    for place, (a_n, b_n) in enumerate(pairs):
        table.add([float(a_n), float(place), float(b_n)])
    return table


def difference(*tables: TimedRows) -> Ahead | None:
    found = [ClockDifferences(), ClockDifferences()]
    for one, table in zip(found, tables, strict=False):
        one.take(table, 2)
    return found[0].together(found[1])


def test_most_measurements_tell_the_clock_and_those_of_a_robot_that_stood_do_not() -> None:
    drove = [(10 * k, 5_000 + 10 * k + k % 3) for k in range(20)]
    stood = [(200 + 10 * k, 5_190) for k in range(60)]
    found = difference(table_of(drove + stood))
    assert found is not None
    assert found.witnesses == 20
    assert found.samples == pytest.approx(5_000 + sum(k % 3 for k in range(20)) / 20)


def test_closures_count_as_well_as_ranges() -> None:
    ranges = table_of([(0, 100), (10, 110), (20, 700)])
    closures = table_of([(50, 731), (60, 742)])
    found = difference(ranges, closures)
    assert found == Ahead(samples=(680 + 681 + 682) / 3, witnesses=3)
    assert difference(ranges) == Ahead(100.0, 2)


def test_of_a_pair_that_measured_nothing_nothing_is_known() -> None:
    assert difference(table_of([])) is None


@pytest.mark.parametrize(("apart", "witnesses"), [(SAME_TIME - 1, 2), (SAME_TIME, 1)])
def test_what_is_two_seconds_apart_is_not_of_one_time(apart: int, witnesses: int) -> None:
    found = difference(table_of([(0, 100), (0, 100 + apart)]))
    assert found is not None
    assert found.witnesses == witnesses


def test_counting_on_is_counting_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks come late, change, and are dropped."""
    monkeypatch.setattr(timed_rows, "HELD_BLOCKS", 3)
    chance = random.Random(1)
    rows = [(k, k + chance.choice([0, 7, 500, 500, 900])) for k in range(0, 6 * BLOCK, 40)]
    chance.shuffle(rows)
    table, going_on = table_of([]), ClockDifferences()
    for place, (a_n, b_n) in enumerate(rows):
        table.add([float(a_n), float(place % 2), float(b_n)])
        if chance.random() < 0.5:
            going_on.take(table, 2)
    anew = ClockDifferences()
    for one in (going_on, anew):
        one.take(table, 2)
    assert going_on.together(ClockDifferences()) == anew.together(ClockDifferences())
    assert going_on._count == anew._count
    assert going_on._sum == anew._sum
    assert 0 not in going_on._count.values()


def test_clocks_follow_from_pair_to_pair() -> None:
    ahead = {(0, 1): Ahead(100.0, 9), (2, 1): Ahead(-50.0, 9), (4, 5): Ahead(7.0, 9)}
    assert shifts({0, 1, 2, 3, 4, 5}, ahead) == [
        {0: 0.0, 1: 100.0, 2: 150.0},
        {3: 0.0},
        {4: 0.0, 5: 7.0},
    ]


@pytest.mark.parametrize(("witnesses", "of_two"), [(63, 300.0), (64, 150.0)])
def test_many_witnesses_are_believed_before_few(witnesses: int, of_two: float) -> None:
    """Three pairs contradict each other; as long as counts are alike the lowest pairs count."""
    ahead = {(0, 1): Ahead(100.0, 63), (0, 2): Ahead(300.0, 40), (1, 2): Ahead(50.0, witnesses)}
    assert shifts({0, 1, 2}, ahead) == [{0: 0.0, 1: 100.0, 2: of_two}]
