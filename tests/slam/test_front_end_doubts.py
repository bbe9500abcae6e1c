"""What a front end makes of doubt: searches for mistakes, and ranges of now."""

from __future__ import annotations

import numpy as np
import pytest
from front_scenes import SECONDS, FrontScene
from mounting_costs import AS_IT_IS, TRACK, costs
from pair_scenes import tracker
from slam_scenes import product

from drslamd.conventions import GRID_US, SECOND_US, Chain, Segment
from drslamd.sensors.samples import Motion
from drslamd.slam.closure_method import AGREEMENT
from drslamd.slam.doubt import NOBODY, Partners
from drslamd.slam.front_end import WhatIfJob
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.odometry.mounting import TRACKS
from drslamd.slam.relative_pose.estimate import Verdict
from drslamd.slam.relative_pose.mistakes.mounting_search import APART_US, MANY, MOST
from drslamd.slam.relative_pose.mistakes.what_if import CASES, Case, variants


def disagreeing(extra: str = "", windows: int = MANY) -> FrontScene:
    """So many of its windows disagree."""
    scene = FrontScene(extra=extra)
    scene.drive(SECONDS)
    scene.module1()
    for _ in range(windows):
        scene.front.pairs[1].search.on_verdict(Verdict.POOR_FIT)
    return scene


def asked(scene: FrontScene) -> list[WhatIfJob]:
    return scene.front.what_if([scene.neighbour()], scene.graph, None, scene.utime)


@pytest.mark.parametrize(("windows", "is_asked"), [(MANY - 1, False), (MANY, True)])
def test_it_is_asked_what_would_be_once_windows_disagree(windows: int, is_asked: bool) -> None:
    assert bool(asked(disagreeing(windows=windows))) is is_asked


def test_of_each_case_the_cost_is_answered_and_the_way_of_who_drove_less() -> None:
    scene = disagreeing()
    (job,) = asked(scene)
    assert job.pair is scene.front.pairs[1]
    costs, way_m = job.run()
    assert costs.shape == (len(CASES),)
    # ranges and both odometries are exact
    assert costs[0] == costs.min() < 1.0
    assert way_m == pytest.approx(0.06 * 10 * SECONDS, rel=0.05)


def test_the_same_pair_is_asked_again_only_after_a_while() -> None:
    scene = disagreeing()
    assert len(asked(scene)) == 1
    assert asked(scene) == []
    scene.drive(APART_US / SECOND_US - 0.1)
    assert asked(scene) == []
    scene.drive(0.1)
    assert len(asked(scene)) == 1


def test_what_was_found_is_asked_with_its_neighbours() -> None:
    scene = disagreeing(windows=10)
    scene.front.pairs[1].search.found = Case(b=TRACKS[0])
    (job,) = asked(scene)
    costs, _ = job.run()
    assert costs.shape == (len(variants(Case(b=TRACKS[0]))),)


def test_the_paper_asks_nothing_and_neither_does_a_pair_without_a_window() -> None:
    assert asked(disagreeing('[relative_pose]\nalgorithm = "paper"\n')) == []
    scene = disagreeing()
    scene.restart_peer()
    assert asked(scene) == []


def test_a_pair_that_waits_to_be_believed_is_asked_too() -> None:
    scene = disagreeing(windows=0)
    assert asked(scene) == []
    pair = scene.front.pairs[1]
    pair.kept = (object(), object())  # type: ignore[assignment]
    assert len(asked(scene)) == 1
    pair.connected = True
    scene.drive(5)
    assert asked(scene) == []


# windows as a witness


def test_partners_are_those_of_our_pairs_that_are_solved_and_windows_name_who_is_wrong() -> None:
    """Windows with robot 1 fit but for one too few, with 2 and 4 they do not; 4 is not solved."""
    front = FrontScene().front
    assert front.partners_by_windows({0, 1}) == (NOBODY, NOBODY)
    for robot, poor in ((1, MOST - 1), (2, MOST), (4, MOST)):
        front.pairs[robot] = tracker(Chain(robot, 1), AGREEMENT)
        for _ in range(poor):
            front.pairs[robot].search.on_verdict(Verdict.POOR_FIT)
    found, _ = front.partners_by_windows({0, 1, 2, 3})
    assert found == Partners(frozenset({1, 2}), frozenset({2}))
    assert front.partners_by_windows({0, 4})[0].all_contradict
    assert front.partners_by_windows(()) == (NOBODY, NOBODY)


def test_partners_with_whom_another_track_fits_better_are_named_beside_them() -> None:
    front = FrontScene().front
    for robot in (1, 2):
        front.pairs[robot] = tracker(Chain(robot, 1), AGREEMENT)
    search = front.pairs[2].search
    search.is_confirmed = search.is_provisional = True
    for _ in range(2):
        search.on_costs(costs({AS_IT_IS: 12.0, TRACK: 2.0}, rest=12.0), 33, is_mirror_told=False)
    assert front.partners_by_windows({0, 1, 2}) == (
        Partners(frozenset({1, 2})),
        Partners(frozenset({1, 2}), frozenset({2})),
    )


# ranges of now


def solved(scene: FrontScene, n: int, off_m: float = 0.0) -> TeamEstimate:
    """Module 3 placed both at a keyframe, the peer so far off."""
    own = np.array([1.0, 2.0, 0.3])
    peer = product(own, scene.seen(n)) + [off_m, 0.0, 0.0]
    return TeamEstimate(
        Segment(0, 1, 0),
        {
            0: Trajectory(scene.own, np.array([n]), own[None]),
            1: Trajectory(scene.peer, np.array([n]), peer[None]),
        },
        joint=1e-4 * np.eye(6),
        bias_m={(0, 1): Learned(0.0, 0.01)},
    )


def watched(scene: FrontScene, estimate: TeamEstimate | None) -> dict[int, int]:
    scene.front.watch_ranges([scene.neighbour()], scene.graph, estimate, scene.utime)
    return scene.front.watch.off


@pytest.mark.parametrize(("off_m", "seconds"), [(0.0, 0), (2.0, 1), (-2.0, 1)])
def test_ranges_of_now_are_held_against_the_last_solution(off_m: float, seconds: int) -> None:
    scene = FrontScene()
    scene.drive(8)
    assert watched(scene, solved(scene, scene.last_keyframe - 30, off_m)) == {1: seconds}


def test_who_is_not_ranged_or_of_unknown_clock_or_not_in_our_graph_is_not_watched() -> None:
    for scene in (
        FrontScene(clock_is_known=False),
        FrontScene(logs=(0,)),
        FrontScene(logs=(1,)),
    ):
        scene.drive(8)
        assert watched(scene, solved(scene, 50)) == {}
    scene = FrontScene()
    scene.drive(8)
    estimate = solved(scene, scene.last_keyframe - 30)
    assert watched(scene, estimate) == {1: 0}
    scene.front.watch_ranges([scene.neighbour(uwb_id=9)], scene.graph, estimate, scene.utime)
    assert scene.front.watch.off == {}
    late = scene.utime + 10 * SECOND_US
    scene.front.watch_ranges([scene.neighbour()], scene.graph, estimate, late)
    assert scene.front.watch.off == {}
    assert scene.peer == Chain(1, 1)


def test_who_may_move_though_its_wheels_stand_makes_keyframes() -> None:
    scene = FrontScene()
    scene.drive(5)
    # where it began, and where it is
    assert len(scene.front.make_keyframes()) == 1
    assert len(scene.front.make_keyframes()) == 1
    # (slower than before, but not all at once)
    scene.front.on_motion(Motion(scene.utime + GRID_US, 0.03, 0.0))
    assert scene.front.make_keyframes() == []
    assert len(scene.front.make_keyframes(is_doubted=True)) == 1
