"""How old each time is, and where its cells of time lie."""

from __future__ import annotations

import itertools

import pytest

from drslamd.slam.graph.thinning.time_cells import (
    FULL_TEAM,
    LAG_STEPS,
    RECENT_S,
    STEP,
    Stretch,
    ages,
    recent_s,
    stretches,
    with_edge,
)
from drslamd.slam.graph.timed_rows import NEVER


@pytest.mark.parametrize(
    ("robots", "seconds"), [(1, 300), (10, 300), (11, 150), (20, 150), (21, 75), (50, 37)]
)
def test_a_large_team_shares(robots: int, seconds: int) -> None:
    assert recent_s(robots) == seconds
    assert robots * recent_s(robots) <= FULL_TEAM * RECENT_S
    assert recent_s(robots, 150) == seconds // 2


# stretches of time


@pytest.mark.parametrize(("step", "is_whole"), [(18, True), (19, False)])
def test_a_cell_counts_when_all_of_it_is_old(step: int, is_whole: bool) -> None:
    """At step 18 (288 s) nothing is five minutes old, at step 19 (304 s) the first four seconds."""
    found = stretches(step, RECENT_S)
    assert found[0] == Stretch(0, 0 if is_whole else 40, NEVER)
    assert found[1:] == ([] if is_whole else [Stretch(1, 0, 40)])


def test_cells_are_four_times_longer_when_the_age_doubles() -> None:
    """Three hours after zero: borders worked out by hand, in seconds."""
    found = stretches(3 * 3600 // 16, RECENT_S)
    now = 3 * 3600
    assert [s.level for s in found] == [0, 1, 2, 3, 4, 5]
    borders = [(now - 300) // 4 * 4, (now - 600) // 16 * 16, (now - 1200) // 64 * 64]
    borders += [(now - 2400) // 256 * 256, (now - 4800) // 1024 * 1024, 0]
    assert [s.first // 10 for s in found] == borders
    assert [s.end for s in found] == [NEVER, *(10 * b for b in borders[:-1])]


@pytest.mark.parametrize("recent", [300, 75, 37, 18])
def test_cells_nest_and_no_time_grows_young(recent: int) -> None:
    level_of: dict[int, int] = {}
    for step in range(0, 2_500, 7):
        found = stretches(step, recent)
        for newer, older in itertools.pairwise(found):
            assert older.end == newer.first
            assert older.level > newer.level
            # a border lies between two cells of the coarser side
            assert older.end % (10 * 4**older.level) == 0
        assert found[-1].first == 0
        for level, first, end in found:
            if level:
                for second in (first // 10, end // 10 - 1):
                    assert level >= level_of.get(second, 0)
                    level_of[second] = level
                    # all of its cell is old enough
                    cell = 4**level
                    assert 16 * step - (second // cell + 1) * cell >= recent * 2 ** (level - 1)


# ages


def at(step: float) -> int:
    """A sample so many steps after zero."""
    return round(step * STEP)


def test_a_robot_alone_is_so_many_steps_behind_its_newest_keyframe() -> None:
    assert ages({7: at(50)}, [{7: 0.0}]) == {7: 50 - LAG_STEPS}
    assert ages({7: at(50) - 1}, [{7: 0.0}]) == {7: 49 - LAG_STEPS}


def test_all_chains_of_a_team_grow_old_in_the_same_moment() -> None:
    """Clocks differ by hours and fractions of steps, keyframes come up to half a step late."""
    shift = {0: 0.0, 1: 1_000.3 * STEP, 2: -20.45 * STEP}
    before: dict[int, int] | None = None
    moments = 0
    for tenth in range(999, 1_100):
        newest = {
            robot: at(tenth / 10) + round(shift[robot]) - late
            for robot, late in ((0, 0), (1, STEP // 2), (2, STEP // 4))
        }
        found = ages(newest, [shift])
        if before is not None and found != before:
            moments += 1
            assert found == {robot: step + 1 for robot, step in before.items()}
        before = found
    assert moments == 10


def test_who_is_in_no_team_has_a_time_of_its_own() -> None:
    found = ages({0: at(100), 1: at(500)}, [{0: 0.0}, {1: 0.0}])
    assert found == {0: 100 - LAG_STEPS, 1: 500 - LAG_STEPS}


def test_a_robot_that_stands_or_is_gone_grows_no_older_than_its_newest_keyframe() -> None:
    for now in (100, 101, 110, 10_000):
        found = ages({0: at(now), 1: at(100)}, [{0: 0.0, 1: 0.0}])
        assert found == {0: now - LAG_STEPS, 1: min(now - LAG_STEPS, 100)}


@pytest.mark.parametrize("nonsense", [2**31 - 1, 0])
def test_a_robot_that_says_nonsense_of_its_time_ages_nobody_else(nonsense: int) -> None:
    found = ages({0: at(100), 1: at(100), 2: nonsense}, [{0: 0.0, 1: 0.0, 2: 0.0}])
    for robot in (0, 1):
        assert 100 - LAG_STEPS <= found[robot] <= 100


@pytest.mark.parametrize(("shift", "expected"), [(-1e9, {0: 100, 1: 98}), (1e9, {0: 98, 1: 100})])
def test_a_clock_that_is_told_wrong_holds_nobody_young(
    shift: float, expected: dict[int, int]
) -> None:
    assert ages({0: at(100), 1: at(100)}, [{0: 0.0, 1: shift}]) == expected


@pytest.mark.parametrize(("late", "step"), [(0, 98), (2, 98), (3, 97), (9, 91)])
def test_who_is_late_by_more_than_the_lag_goes_by_its_own_time(late: int, step: int) -> None:
    assert ages({0: at(100), 1: at(100 - late)}, [{0: 0.0, 1: 0.0}])[1] == step


def test_a_robot_without_a_keyframe_has_no_age() -> None:
    assert ages({}, [{0: 0.0}]) == {}
    assert ages({1: at(9)}, [{0: 0.0, 1: 0.0}]) == {1: 9 - LAG_STEPS}


def test_the_oldest_half_minute_that_stays_whole_is_a_stretch_of_its_own() -> None:
    found = stretches(100, RECENT_S)
    newest, edge, *old = with_edge(found)
    assert (newest.level, newest.end, edge.level) == (0, NEVER, 0)
    assert (edge.first, edge.end, newest.first) == (found[0].first, newest.first, edge.first + 320)
    assert old == found[1:]
    assert len({s.kind for s in (newest, edge, *old)}) == 2 + len(old)
    # while nothing is old there is no edge
    assert with_edge(stretches(3, RECENT_S)) == stretches(3, RECENT_S)
