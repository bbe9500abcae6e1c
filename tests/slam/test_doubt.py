"""Who speaks against a pose, and against whom it is held."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drslamd.conventions import Segment
from drslamd.slam.doubt import (
    BOLD,
    ODD_SCALE,
    Doubt,
    Partners,
    Reason,
    doubt_of,
    doubted_partners,
)
from drslamd.slam.graph.estimate import MUCH_WORSE, Learned, TeamEstimate

NOBODY: frozenset[int] = frozenset()


def team(
    *contradicted: tuple[int, int],
    pairs: tuple[tuple[int, int], ...] = ((0, 1), (0, 2), (1, 2)),
    level: dict[int, float] | None = None,
) -> TeamEstimate:
    """What module 3 said of pairs that have ranges."""
    return TeamEstimate(
        Segment(0, 1, 0),
        {},
        bias_m={pair: Learned(0.0, 0.1) for pair in pairs},
        contradicted=frozenset(contradicted),
        late_level=level or {},
        # what it must be feared to be is no doubt of now
        odometry_level={0: 9.0, 1: 9.0, 2: 9.0},
    )


def test_without_a_solution_there_is_nothing_to_doubt() -> None:
    assert doubt_of(0, None, Partners(frozenset({1}), frozenset({1}))) is None
    assert doubted_partners(0, None, frozenset({1})) == NOBODY


def test_where_all_fits_nothing_is_doubted() -> None:
    assert doubt_of(0, team()) is None
    assert doubt_of(0, team(pairs=())) is None
    assert doubted_partners(0, team()) == NOBODY


@pytest.mark.parametrize(
    ("level", "found"),
    [
        (MUCH_WORSE - 0.01, None),
        (MUCH_WORSE, Doubt(1, Reason.ODOMETRY, level=MUCH_WORSE)),
        (7.5, Doubt(1, Reason.ODOMETRY, level=7.5)),
    ],
)
def test_odometry_that_must_be_feared_is_doubt_of_its_robot_alone(
    level: float, found: Doubt | None
) -> None:
    estimate = team(level={1: level})
    assert doubt_of(1, estimate) == found
    assert doubt_of(0, estimate) is None


def test_odometry_is_named_before_the_ranges_that_it_makes_wrong() -> None:
    found = doubt_of(1, team((0, 1), (1, 2), level={1: 4.0}))
    assert found == Doubt(1, Reason.ODOMETRY, level=4.0)


def test_a_robot_that_all_its_partners_contradict_is_doubtful_and_they_are_not() -> None:
    estimate = team((0, 1), (1, 2))
    assert doubt_of(1, estimate) == Doubt(1, Reason.RANGES, (0, 2))
    assert doubt_of(0, estimate) is None
    assert doubt_of(2, estimate) is None
    assert [doubted_partners(robot, estimate) for robot in range(3)] == [{1}, {0, 2}, {1}]


def test_of_two_robots_alone_nobody_can_tell_and_both_are() -> None:
    estimate = team((0, 1), pairs=((0, 1),))
    assert doubt_of(0, estimate) == Doubt(0, Reason.RANGES, (1,))
    assert doubt_of(1, estimate) == Doubt(1, Reason.RANGES, (0,))


def test_who_has_no_pair_at_all_is_contradicted_by_nobody() -> None:
    assert doubt_of(3, team((0, 1), (0, 2), (1, 2))) is None


@pytest.mark.parametrize(
    ("watched", "off", "peers"),
    [
        ({1, 2}, set(), None),
        ({1, 2}, {2}, None),
        ({1, 2}, {1, 2}, (1, 2)),
        ({2}, {2}, (2,)),
        (set(), set(), None),
    ],
)
def test_ranges_of_this_second_are_doubt_where_none_of_them_fits(
    watched: set[int], off: set[int], peers: tuple[int, ...] | None
) -> None:
    found = doubt_of(0, team(), Partners(frozenset(watched), frozenset(off)))
    assert found == (None if peers is None else Doubt(0, Reason.RANGES, peers))


def test_windows_that_fit_no_motion_are_named_before_those_that_another_track_would_fit() -> None:
    wrong = Partners(frozenset({1}), frozenset({1}))
    found = doubt_of(0, team(), windows=wrong, mountings=wrong)
    assert found == Doubt(0, Reason.WINDOWS, (1,))
    assert doubt_of(0, team(), mountings=wrong) == Doubt(0, Reason.MOUNTINGS, (1,))


def test_one_pair_that_is_as_configured_speaks_for_a_robot() -> None:
    mountings = Partners(frozenset({1, 2}), frozenset({1}))
    assert doubt_of(0, team(), mountings=mountings) is None


def test_partners_are_doubted_by_what_was_solved_and_by_what_is_ranged_now() -> None:
    assert doubted_partners(0, team((0, 2), (1, 2)), frozenset({5})) == {2, 5}


@pytest.mark.parametrize(
    ("scale", "is_odd"), [(0.49, False), (0.5, True), (-0.49, False), (-0.5, True)]
)
def test_odometry_of_another_length_that_turns_as_configured_is_no_mounting(
    scale: float, is_odd: bool
) -> None:
    """A positive scale says that ways are shorter."""
    estimate = replace(team(), scale={1: Learned(scale, 0.01)})
    found = doubt_of(1, estimate)
    assert found == (Doubt(1, Reason.SCALE, level=1 - scale) if is_odd else None)
    # who miscounts both sides turns as wrongly, and that is learned
    assert doubt_of(1, replace(estimate, turn={1: Learned(scale, 0.01)})) is None


def test_a_robot_of_odd_odometry_contradicts_a_single_partner_and_not_two() -> None:
    odd = {1: Learned(ODD_SCALE, 0.01)}
    assert doubt_of(0, replace(team(), scale=odd)) is None
    found = doubt_of(0, replace(team(pairs=((0, 1),)), scale=odd))
    assert found == Doubt(0, Reason.RANGES, (1,))


def test_windows_of_all_pairs_that_disagree_are_doubt() -> None:
    some = Partners(frozenset({1, 2}), frozenset({2}))
    every = Partners(frozenset({1, 2}), frozenset({1, 2}))
    assert doubt_of(0, team(), windows=some) is None
    assert doubt_of(0, team(), windows=every) == Doubt(0, Reason.WINDOWS, (1, 2))
    # ranges of this second say it sooner
    assert doubt_of(0, team(), every, every) == Doubt(0, Reason.RANGES, (1, 2))


@pytest.mark.parametrize(("moved", "is_doubt"), [(BOLD - 0.01, False), (BOLD, True)])
def test_who_is_moved_against_all_partners_is_doubtful(moved: float, is_doubt: bool) -> None:
    estimate = replace(team(), boldness={(0, 1): BOLD, (0, 2): moved})
    assert doubt_of(0, estimate) == (Doubt(0, Reason.REVISIONS) if is_doubt else None)
    assert doubt_of(1, estimate) is None


@pytest.mark.parametrize(("boldness", "is_doubt"), [(BOLD - 0.01, False), (BOLD, True)])
def test_claims_that_solutions_moved_too_far_are_doubt(boldness: float, is_doubt: bool) -> None:
    found = doubt_of(0, team(), boldness=boldness)
    assert found == (Doubt(0, Reason.REVISIONS) if is_doubt else None)
