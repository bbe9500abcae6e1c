"""A graph that stays bounded: what goes, what stays, and what is carried."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import (
    NOISE,
    closure,
    inverted,
    keyframes,
    product,
    range_item,
    same_pose,
    straight,
    wander,
)

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import RangeTable
from drslamd.slam.graph.thinning import RECENT_S, TEAM_S, Thinning, recent_s
from drslamd.slam.se2 import Array

A, B = Chain(0, 1), Chain(1, 1)
AHEAD = 20


def driven(seconds: int, order: list[int] | None = None) -> PoseGraph:
    """One robot with a keyframe a second, thinned as they come."""
    frames = keyframes(range(0, 10 * seconds, 10), wander(np.random.default_rng(1), seconds))
    graph = PoseGraph()
    thinning = Thinning(graph)
    for k in order or range(seconds):
        graph.insert(A, GraphEntry(k, keyframes=(frames[k],)))
        thinning.after(A.robot)
    return graph


def test_five_minutes_stay_as_they_are() -> None:
    for seconds, all_stay in ((RECENT_S + 20, True), (RECENT_S + 21, False)):
        assert (len(driven(seconds).chains[0].keyframes.rows) == seconds) == all_stay


@pytest.mark.parametrize("seconds", [1_200, 3_600, 14_400])
def test_the_rest_of_any_time_is_at_most_half_as_much_again(seconds: int) -> None:
    n = driven(seconds).chains[0].keyframes.n
    assert len(n) <= 1.5 * RECENT_S + 64 + 10
    assert n[0] == 0
    age = (10 * seconds - n[:-1]) / 10
    gap = np.diff(n) / 10
    # four times farther apart when the age doubles: the square of the age, and the cells' edges
    assert (gap <= 2 * 16 * np.maximum(age / RECENT_S, 0.25) ** 2 + 1).all()


def test_which_stay_does_not_depend_on_the_order_in_which_they_came() -> None:
    seconds = 1_000
    order = list(range(seconds))
    for k in range(0, seconds - 3, 3):
        order[k], order[k + 2] = order[k + 2], order[k]
    assert np.array_equal(
        driven(seconds).chains[0].keyframes.rows, driven(seconds, order).chains[0].keyframes.rows
    )


@pytest.mark.parametrize(
    ("robots", "seconds"), [(1, 300), (10, 300), (11, 150), (20, 150), (21, 75), (50, 37)]
)
def test_a_large_team_shares(robots: int, seconds: int) -> None:
    assert recent_s(robots) == seconds
    assert robots * recent_s(robots) <= TEAM_S


def two_robots(seconds: int) -> tuple[PoseGraph, np.ndarray, np.ndarray]:
    """Exact ranges and closures every second; b's clock is 2 s ahead, so are its cells of time."""
    one, other = straight((0, 0, 0.3), seconds, 0.02), straight((5, 1, -2.0), seconds, 0.02)
    graph = PoseGraph()
    thinning = Thinning(graph)
    for k, (a, b) in enumerate(zip(one, other, strict=True)):
        distance = math.hypot(a[0] - b[0], a[1] - b[1])
        measured = (range_item(10 * k, B, AHEAD + 10 * k, distance),)
        seen = (closure(k, 10 * k, B, AHEAD + 10 * k, product(inverted(a), b)),)
        graph.insert(B, GraphEntry(k, keyframes=keyframes([AHEAD + 10 * k], [b])))
        graph.insert(A, GraphEntry(k, None, keyframes([10 * k], [a]), measured, seen))
        thinning.after(B.robot)
        thinning.after(A.robot)
    return graph, one, other


def columns(table: RangeTable) -> tuple[Array, ...]:
    return table.a_n, table.b_n, table.q_a, table.q_b, table.range_m


def test_what_was_measured_at_a_keyframe_that_goes_is_true_at_the_one_that_stays() -> None:
    graph, one, other = two_robots(900)
    pair = graph.pairs[0, 1]
    a, b = graph.chains[0], graph.chains[1]
    assert len(pair.ranges) < 600
    for a_n, b_n, q_a, q_b, range_m in zip(*columns(pair.ranges), strict=True):
        ends = []
        for items, n, arm in ((a, a_n, q_a), (b, b_n, q_b)):
            at, there = items.keyframes.find(np.array([n]))
            assert there[0]
            ends.append(product(items.keyframes.poses[at[0]], [*arm, 0.0])[:2])
        assert np.hypot(*(ends[0] - ends[1])) == pytest.approx(range_m, abs=2e-3)
    assert len(pair.kept_closures()) < 600
    for item in pair.kept_closures():
        pose = product(inverted(one[item.a_n // 10]), other[(item.b_n - AHEAD) // 10])
        assert same_pose(np.array(item.a_T_b), pose, 1e-3)


@pytest.mark.parametrize("owner_turns", [True, False])
def test_the_heading_of_a_carried_closure_stays_within_half_a_turn(owner_turns: bool) -> None:
    """One robot circles, so now and then a closure is carried over the half turn."""
    seconds = 460
    circle = [np.array([math.cos(k / 5), math.sin(k / 5), k / 5 - 50]) for k in range(seconds)]
    still = [np.array([4.0, 1.0, 0.4])] * seconds
    one, other = (circle, still) if owner_turns else (still, circle)
    n = range(0, 10 * seconds, 10)
    graph = PoseGraph()
    graph.insert(B, GraphEntry(0, keyframes=keyframes(n, other)))
    seen = [closure(k, 10 * k, B, 10 * k, product(inverted(one[k]), other[k])) for k in range(140)]
    graph.insert(A, GraphEntry(0, None, keyframes(n, one), (), tuple(seen)))
    Thinning(graph).after((A if owner_turns else B).robot)
    kept = graph.pairs[0, 1].kept_closures()
    assert sum({item.a_n, item.b_n} != {10 * item.number} for item in kept) > 80
    for item in kept:
        a, b = one[item.a_n // 10], other[item.b_n // 10]
        assert item.a_T_b == pytest.approx(product(inverted(a), b), abs=1e-3)


def test_what_was_carried_far_is_less_certain_and_what_is_recent_is_not() -> None:
    graph, _, _ = two_robots(900)
    table = graph.pairs[0, 1].ranges
    recent = table.chosen(table.a_n > 10 * (900 - RECENT_S))
    assert len(recent) >= 280
    plain = recent.sigma_m[-1]
    assert (recent.sigma_m[2:] == plain).all()
    way = np.hypot(*table.q_a.T)
    is_old = (table.a_n < 1000) & (way > 0.02)
    assert np.count_nonzero(is_old) > 3
    # at least the random translation of the way that it was carried
    least = plain**2 + NOISE.translation_per_sqrt_m**2 * way
    assert (table.sigma_m**2 >= least)[is_old].all()


def test_sums_between_keyframes_that_stay_do_not_shrink_to_the_chords() -> None:
    graph = PoseGraph()
    thinning = Thinning(graph)
    circle = [[math.cos(k / 5), math.sin(k / 5), k / 5] for k in range(1_000)]
    for k, pose in enumerate(circle):
        graph.insert(A, GraphEntry(k, keyframes=keyframes([10 * k], [pose])))
        thinning.after(A.robot)
    sums = graph.chains[0].sums
    per_second = 2 * math.sin(0.1)
    seconds = (graph.chains[0].keyframes.n[-1] - graph.chains[0].keyframes.n[0]) / 10
    assert sums[-1, 0] - sums[0, 0] == pytest.approx(per_second * seconds, rel=1e-3)


def test_the_first_keyframe_of_every_piece_stays_because_frames_begin_there() -> None:
    graph = PoseGraph()
    thinning = Thinning(graph)
    for k in range(1_000):
        frame = keyframes([10 * k], [[0.1 * k, 0.0, 0.0]], segment=k // 100)
        graph.insert(A, GraphEntry(k, keyframes=frame))
        thinning.after(A.robot)
    for segment in range(10):
        assert graph.segment(Segment(0, 1, segment)).n[0] == 1000 * segment
