"""Where wheels may have stood or spun, and what a problem with that freed is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lapse_scenes import COUNT, ROBOTS, STEP_M, a_team, driven
from slam_problems import IDS, links_of

from drslamd.slam.odometry.jumps import JUMP_MPS
from drslamd.slam.optimizer.banded.lapses.stretches import (
    APART_S,
    FASTER,
    LEAST_MPS,
    MOST_RADPS,
    MOST_TRIED,
    SHARE,
    UNKNOWN_M,
    has_short_links,
    likely_stretches,
    under,
    with_freed,
)
from drslamd.slam.optimizer.problem import Freed, Problem


def found(problem: Problem) -> list[tuple[int, int, bool]]:
    """The first and the last keyframe of each candidate, which are all of robot 1."""
    out = []
    for freed in likely_stretches(problem):
        assert freed.robot == 1
        ends = problem.odometry.i[freed.links[0]], problem.odometry.j[freed.links[-1]]
        out.append((int(ends[0]) // ROBOTS, int(ends[1]) // ROBOTS, freed.stands))
    return out


# where it may have been


def test_who_drives_as_ever_has_no_lapse() -> None:
    assert likely_stretches(driven({})) == []
    assert likely_stretches(a_team()[0]) == []


def test_wheels_that_stand_for_two_seconds_may_have_stood_a_little_sooner_and_longer() -> None:
    assert found(driven({10: 0.0})) == []
    assert found(driven({10: 0.0, 11: 0.0})) == [(9, 13, True)]


@pytest.mark.parametrize(("way", "turn", "stands"), [(0.04, 0.09, 1), (0.06, 0.0, 0), (0, 0.11, 0)])
def test_who_turns_or_creeps_does_not_stand(way: float, turn: float, stands: int) -> None:
    assert len(found(driven({10: way, 11: way}, turn))) == stands


def arcs(*radii: float, turn: float = 0.9, half_track: float | None = 0.2) -> Problem:
    """Robot 1 turns about a point beside it in some seconds, as far away as is said, or drives
    straight on."""
    problem = driven({})
    measured = problem.odometry.measured.copy()
    for second, radius in enumerate(radii, start=10):
        if np.isnan(radius):
            continue  # straight on
        chord = 2 * radius * math.sin(turn / 2)
        ahead = [chord * math.cos(turn / 2), chord * math.sin(turn / 2), turn]
        measured[links_of(problem, 1, second, second + 1)] = ahead
    odometry = replace(problem.odometry, measured=measured)
    tracks = None if half_track is None else np.array([0.3, half_track, 0.1])
    return replace(problem, odometry=odometry, half_track=tracks)


@pytest.mark.parametrize(("seconds", "stands"), [(2, False), (3, True), (6, True)])
def test_who_turns_about_one_wheel_for_three_seconds_has_a_counter_that_stands(
    seconds: int, stands: bool
) -> None:
    for turn in (-0.9, 0.9):
        ends = found(arcs(*seconds * [0.2], turn=turn))
        assert ends == ([(9, 11 + seconds, True)] if stands else [])


@pytest.mark.parametrize(
    ("radii", "turn", "stands"),
    [
        ((0.189, 0.189, 0.189), 0.9, False),  # about no wheel
        ((0.191, 0.191, 0.191), 0.9, True),
        ((0.211, 0.211, 0.211), 0.9, False),
        ((0.209, 0.209, 0.209), 0.9, True),
        ((0.2, 0.2, 0.2), 0.19, False),  # so slowly anybody turns
        ((0.2, 0.2, 0.2), 0.21, True),
    ],
)
def test_such_a_counter_has_only_who_turns_about_its_wheel(
    radii: tuple[float, ...], turn: float, stands: bool
) -> None:
    assert bool(found(arcs(*radii, turn=turn))) is stands


@pytest.mark.parametrize("half_track", [0.0, None])
def test_nor_has_a_base_whose_wheels_have_no_sides(half_track: float | None) -> None:
    assert found(arcs(0.2, 0.2, 0.2, half_track=half_track)) == []


@pytest.mark.parametrize(
    ("lane", "ends"), [(2, [(9, 17, True)]), (3, []), (1, [(9, 16, True)])], ids=str
)
def test_turns_about_a_wheel_with_a_lane_between_are_two(
    lane: int, ends: list[tuple[int, int, bool]]
) -> None:
    """Of two seconds each: too short alone, and long enough together."""
    assert found(arcs(0.2, 0.2, *lane * [np.nan], 0.2, 0.2)) == ends


def test_the_lane_itself_is_no_turn_about_a_wheel() -> None:
    assert found(arcs(0.2, np.nan, 0.2, np.nan)) == []


def test_of_such_turns_and_later_spins_the_latest_are_looked_at() -> None:
    problem = arcs(0.2, 0.2, 0.2)
    measured = problem.odometry.measured.copy()
    for second in range(17, 42, 6):
        measured[links_of(problem, 1, second, second + 1)] = [0.8, 0.0, 0.0]
    odometry = replace(problem.odometry, measured=measured)
    kinds = [stands for _, _, stands in found(replace(problem, odometry=odometry))]
    assert kinds == MOST_TRIED * [False]


def test_what_one_wheel_made_of_a_turn_may_be_none_of_it() -> None:
    (freed,) = likely_stretches(arcs(*3 * [0.2]))
    turned = MOST_RADPS**2 + 0.9**2
    assert freed.added[:, 2, 2] == pytest.approx([MOST_RADPS**2, *3 * [turned], MOST_RADPS**2])
    assert freed.added[:, 0, 0] == pytest.approx(STEP_M**2)


@pytest.mark.parametrize(("late", "stands"), [(0, 0), (9, 0), (10, 1)])
def test_a_second_without_a_keyframe_is_one_in_which_wheels_stood(late: int, stands: int) -> None:
    problem = driven({})
    n = problem.n.copy()
    n[problem.odometry.j[links_of(problem, 1, 20, COUNT)]] += late
    assert len(likely_stretches(replace(problem, n=n))) == stands


@pytest.mark.parametrize(("times", "spins"), [(0.99, 0), (1.01, 1)])
def test_wheels_spin_that_are_a_quarter_faster_than_usual(times: float, spins: int) -> None:
    way = times * FASTER * STEP_M
    assert found(driven({10: way, 11: way})) == [(9, 13, False)][:spins]


def test_how_fast_a_robot_usually_is_is_told_by_the_seconds_in_which_it_drives() -> None:
    """It stands half of the time: 0.5 m/s are as usual as before."""
    ways = dict.fromkeys(range(0, 24, 2), 0.0)
    assert found(driven({**ways, 30: 0.49})) == []


@pytest.mark.parametrize(("between", "is_one"), [(4, True), (5, False)])
def test_who_slows_down_to_turn_while_its_wheels_spin_spins_on(between: int, is_one: bool) -> None:
    assert APART_S == 4
    second = 11 + between
    ends = found(driven({10: 0.8, second: 0.8}))
    whole = [(9, second + 2, False)]
    assert ends == (whole if is_one else [(9, 12, False), (second - 1, second + 2, False)])


def test_stretches_at_both_ends_of_a_drive_have_nothing_beside() -> None:
    assert found(driven({0: 0.0, 1: 0.0, COUNT - 2: 0.8})) == [
        (0, 3, True),
        (COUNT - 3, COUNT - 1, False),
    ]


def test_of_many_stretches_the_latest_are_looked_at() -> None:
    ways = dict.fromkeys(range(1, 41, 8), 0.8)
    assert [first for first, _, _ in found(driven(ways))] == [8, 16, 24, 32]
    assert MOST_TRIED == 4


@pytest.mark.parametrize(
    ("samples", "speed_mps", "is_abrupt"),
    [(2, 0.26, True), (2, 0.23, False), (3, 0.26, False), (2, -0.26, True)],
)
@pytest.mark.parametrize("is_end", [False, True])
def test_a_stretch_is_abrupt_where_a_short_link_leads_to_another_speed(
    samples: int, speed_mps: float, is_abrupt: bool, is_end: bool
) -> None:
    """Robot 1 stands in seconds 10 to 12 but for the first or the last samples of that, before or
    behind which it drives at some speed."""
    problem = driven(dict.fromkeys((10, 11, 12), 0.0))
    n = problem.n.copy()
    short, beside = (12, 13) if is_end else (10, 9)
    (end,) = problem.odometry.j[links_of(problem, 1, short, short + 1)]
    n[np.flatnonzero((problem.robot_id == IDS[1]) & (n >= n[end]))] -= 10 - samples
    measured = problem.odometry.measured.copy()
    measured[links_of(problem, 1, beside, beside + 1)] = [speed_mps, 0.0, 0.0]
    odometry = replace(problem.odometry, measured=measured)
    assert has_short_links(replace(problem, n=n)) is (samples == 2)
    assert not has_short_links(problem)
    (freed,) = likely_stretches(replace(problem, odometry=odometry, n=n))
    assert freed.stands
    assert freed.is_abrupt is is_abrupt
    assert pytest.approx(0.245) == SHARE * JUMP_MPS


def test_where_wheels_stand_a_robot_may_have_gone_anywhere_at_its_speed() -> None:
    (freed,) = likely_stretches(driven({10: 0.0, 11: 0.0}))
    assert freed.added == pytest.approx(
        np.tile(np.diag([STEP_M**2, STEP_M**2, MOST_RADPS**2]), (4, 1, 1))
    )


def test_a_robot_that_hardly_drove_may_have_been_as_fast_as_any() -> None:
    problem = driven({})
    odometry = replace(problem.odometry, measured=0.0 * problem.odometry.measured)
    every = likely_stretches(replace(problem, odometry=odometry))
    assert [freed.robot for freed in every] == [0, 1, 2]
    assert every[0].added[:, 0, 0] == pytest.approx(LEAST_MPS**2)


def test_where_wheels_spin_the_way_may_have_been_another_and_not_its_direction() -> None:
    """A second that turns by 60 degrees: its chord lies 30 degrees to the left."""
    problem = driven({10: 0.8, 11: 0.8})
    measured = problem.odometry.measured.copy()
    (link,) = links_of(problem, 1, 11, 12)
    cos, sin = math.cos(math.pi / 6), math.sin(math.pi / 6)
    measured[link] = [0.8 * cos, 0.8 * sin, math.pi / 3]
    (freed,) = likely_stretches(
        replace(problem, odometry=replace(problem.odometry, measured=measured))
    )
    added = freed.added[freed.links.tolist().index(link)]
    assert added[:2, :2] == pytest.approx(
        STEP_M**2 * np.array([[cos * cos, cos * sin], [cos * sin, sin * sin]])
    )
    assert (added[2] == 0).all()
    assert freed.added[0] == pytest.approx(np.diag([STEP_M**2, 0, 0]))


# freed


def freed_team() -> tuple[Problem, Freed]:
    problem = driven({10: 0.0, 11: 0.0})
    (freed,) = likely_stretches(problem)
    return problem, freed


def test_what_is_freed_has_both_noises() -> None:
    problem, freed = freed_team()
    wider = with_freed(problem, freed)
    assert wider.freed == (freed,)
    assert wider.odometry.covariance[freed.links] == pytest.approx(
        problem.odometry.covariance[freed.links] + freed.added
    )
    others = np.setdiff1d(np.arange(len(problem.odometry)), freed.links)
    assert np.array_equal(wider.odometry.covariance[others], problem.odometry.covariance[others])
    assert problem.freed == ()


def test_ranges_to_a_keyframe_whose_robot_may_have_gone_on_count_for_nothing() -> None:
    """Robot 1 made no keyframe after number 20 for three seconds, and ranges were told all the time
    as between that one and keyframes 20 to 23 of robot 0."""
    problem = driven({})
    ranges = problem.ranges
    gone = np.isin(problem.odometry.j, [ROBOTS * k + 1 for k in (21, 22, 23)])
    odometry = problem.odometry.chosen(~gone)
    (link,) = np.flatnonzero((odometry.robot == 1) & (odometry.i == ROBOTS * 20 + 1 + 3 * ROBOTS))
    i = odometry.i.copy()
    i[link] = ROBOTS * 20 + 1
    j = ranges.j.copy()
    told = [
        np.flatnonzero((ranges.i == ROBOTS * k) & (ranges.j == ROBOTS * k + 1))
        for k in range(20, 24)
    ]
    j[np.concatenate(told)] = ROBOTS * 20 + 1
    problem = replace(problem, odometry=replace(odometry, i=i), ranges=replace(ranges, j=j))
    (freed,) = likely_stretches(problem)
    sigma = with_freed(problem, freed).ranges.sigma
    silent = np.flatnonzero(sigma != ranges.sigma)
    # those of the first second are as good as any: robot 0 makes its keyframe 21 after it
    assert silent.tolist() == [int(rows[0]) for rows in told[2:]]
    assert (sigma[silent] == UNKNOWN_M).all()
    spun = with_freed(problem, replace(freed, stands=False))
    assert spun.ranges is problem.ranges


def test_links_under_a_stretch_are_those_of_its_robot_while_it_lasts_and_a_while_after() -> None:
    problem, freed = freed_team()
    assert np.flatnonzero(under(problem, (freed,))).tolist() == sorted(freed.links.tolist())
    after = np.flatnonzero(under(problem, (freed,), 2.0))
    assert after.tolist() == sorted(links_of(problem, 1, 9, 15).tolist())
    assert not under(problem, ()).any()
