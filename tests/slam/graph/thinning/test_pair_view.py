"""What a pair measured in times that are thinned: what stays, and what is carried."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from long_drives import A, B, relative
from slam_scenes import (
    NOISE,
    Array,
    closure,
    inverted,
    keyframes,
    model_of,
    product,
    range_item,
    same_pose,
    wander,
)

from drslamd.conventions import Chain
from drslamd.slam import se2
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.graph.thinning.pair_view import PairView
from drslamd.slam.graph.thinning.thinned_pairs import FEW_CLOSURES, FEW_RANGES, MOVING_M
from drslamd.slam.odometry.noise import OdometryNoise

AHEAD = 23
"""Samples that b's clock is ahead, and so are its cells of time."""
ONE, OTHER = (wander(np.random.default_rng(seed), 3_000, 0.3) for seed in (1, 2))
ARM_A, ARM_B = (0.2, 0.1), (-0.3, 0.05)


def measured(
    seconds: int,
    odometry: tuple[Array, Array] = (ONE, OTHER),
    sigma: Sequence[float] = (0.1,),
    closure_sigma: float = 0.1,
) -> PoseGraph:
    """Exact ranges each second and closures each fourth between robots on ONE and OTHER."""
    graph = PoseGraph()
    for k in range(seconds):
        tips = [product(p[k], (*arm, 0)) for p, arm in ((ONE, ARM_A), (OTHER, ARM_B))]
        metres = math.hypot(*(tips[0] - tips[1])[:2])
        a_n, b_n = 10 * k, 10 * k + AHEAD
        ranged = range_item(a_n, B, b_n, metres, ARM_A, ARM_B, sigma[k % len(sigma)])
        ranged = replace(ranged, turn_a=0.3 * math.sin(k), turn_b=3.1 * math.cos(k))
        seen = closure(k, a_n, B, b_n, product(inverted(ONE[k]), OTHER[k]), closure_sigma)
        own, peer = (keyframes([n], [p[k]]) for n, p in ((a_n, odometry[0]), (b_n, odometry[1])))
        closures = (seen,) if k % 4 == 0 else ()
        model = model_of(NOISE) if k == 0 else None
        graph.insert(B, GraphEntry(k, model, peer))
        graph.insert(A, GraphEntry(k, model, own, (ranged,), closures))
    return graph


def views(graph: PoseGraph) -> tuple[PairView, ChainView, ChainView]:
    (pair,) = graph.view.pairs
    return pair, graph.view.chains[0], graph.view.chains[1]


def number(n: float, ahead: int = 0) -> int:
    """Which second a keyframe is of."""
    return (int(n) - ahead) // 10


# what stays


def test_recent_ranges_and_closures_stay_as_they_were_said() -> None:
    graph = measured(1_000)
    pair, a, b = views(graph)
    said = graph.pairs[0, 1]
    # (the first of them stands for what was measured just before it as well)
    border = max(a.recent_n, b.recent_n - AHEAD) + 10
    for found, all_of_them in ((pair.ranges, said.ranges), (pair.closures, said.closures)):
        recent = all_of_them.rows[all_of_them.a_n >= border]
        assert np.array_equal(found.rows[found.a_n >= border], recent)
        assert len(recent) > 60


def test_between_the_same_two_keyframes_few_stay_where_these_are_old() -> None:
    pair, a, b = views(measured(2_500))
    # two parts of different age are each thinned by itself, also where they meet
    meet = {part.stretch.first for part in a.parts}
    for table, few in ((pair.ranges, FEW_RANGES), (pair.closures, FEW_CLOSURES)):
        count = Counter(zip(table.a_n.tolist(), table.b_n.tolist(), strict=True))
        old = {ends: k for ends, k in count.items() if ends[0] < a.recent_n - 640}
        assert max(k for (a_n, _), k in old.items() if a_n not in meet) == few
        assert max(old.values()) <= 2 * few
        assert len(old) > 50
    assert len(pair.ranges) < 1_100
    for found, n in ((a, pair.ranges.a_n), (b, pair.ranges.b_n)):
        assert found.keyframes.find(n)[1].all()


def test_those_that_stay_are_spread_over_their_time() -> None:
    """In a cell of 64 s no gap is longer than half of it."""
    graph = measured(2_500)
    pair, a, _ = views(graph)
    said, stay = graph.pairs[0, 1].ranges, set(pair.ranges.place.tolist())
    times = np.array([n for n, place in zip(said.a_n, said.place, strict=True) if place in stay])
    (level,) = (p.stretch for p in a.parts if p.stretch.level == 3)
    inside = times[(times >= level.first) & (times < level.end)]
    gaps = np.diff([level.first, *inside, level.end]) / 10
    assert gaps.max() <= 32
    assert np.median(gaps) >= 5


def test_ranges_that_are_doubted_are_the_first_to_go() -> None:
    """Three of four seconds are blocked; a cell of 16 s has others enough."""
    pair, a, _ = views(measured(1_500, sigma=(0.5, 0.1, 0.5, 0.5)))
    (level,) = (p.stretch for p in a.parts if p.stretch.level == 2)
    inside = (pair.ranges.a_n > level.first + 160) & (pair.ranges.a_n < level.end - 160)
    assert inside.sum() > 100
    assert (pair.ranges.sigma_m[inside] < 0.5).mean() > 0.5
    plain = views(measured(1_500))[0].ranges
    some = (plain.a_n > level.first + 160) & (plain.a_n < level.end - 160)
    assert inside.sum() == some.sum()


def test_a_withdrawal_brings_back_what_had_lost() -> None:
    graph = measured(2_000)
    before = views(graph)[0].closures
    old = before.number[before.a_n < 3_000]
    gone = int(old[0])
    (lost,) = (c for c in graph.pairs[0, 1].kept_closures() if c.number == gone)
    item = closure(gone, lost.a_n, B, lost.b_n, (0, 0, 0), kept=False)
    graph.insert(A, GraphEntry(9_999, closures=(item,)))
    after = views(graph)[0].closures
    assert gone not in after.number
    assert len(set(after.number) - set(before.number)) == 1
    assert len(after) == len(before)


def test_a_range_whose_keyframe_never_came_takes_nobody_s_place() -> None:
    graph, whole = measured(1_500), measured(1_500)
    orphans = tuple(range_item(10 * k, B, 10 * k + AHEAD + 1, 3.0) for k in range(1_500))
    graph.insert(A, GraphEntry(9_999, ranges=orphans))
    assert np.array_equal(views(graph)[0].ranges.rows, views(whole)[0].ranges.rows)


# what is carried


@pytest.mark.parametrize("seconds", [40, 400])
def test_a_pair_that_says_nothing_more_stays_what_it_is_while_both_drive_on(seconds: int) -> None:
    graph = measured(seconds)
    before, _, _ = views(graph)
    graph.insert(A, GraphEntry(seconds, None, keyframes([10 * seconds], [ONE[seconds]])))
    graph.insert(B, GraphEntry(seconds, None, keyframes([10 * seconds + AHEAD], [OTHER[seconds]])))
    after, a, _ = views(graph)
    assert a.keyframes.n[-1] == 10 * seconds
    assert after is before


@pytest.mark.parametrize("owner_is_late", [True, False])
def test_a_range_counts_once_the_keyframe_that_it_names_is_there(owner_is_late: bool) -> None:
    """It comes seconds after, and other keyframes before it."""
    graph = measured(40)
    late = 410, 410 + AHEAD
    ranged = range_item(late[0], B, late[1], 5.0, ARM_A, ARM_B, 0.1)
    graph.insert(A, GraphEntry(40, None, keyframes([430], [ONE[43]]), (ranged,)))
    graph.insert(B, GraphEntry(40, None, keyframes([430 + AHEAD], [OTHER[43]])))
    own, peer = (A, keyframes([late[0]], [ONE[41]])), (B, keyframes([late[1]], [OTHER[41]]))
    first, last = (peer, own) if owner_is_late else (own, peer)
    for seq, (chain, frames) in enumerate((first, last), start=41):
        pair, _, _ = views(graph)
        assert late[0] not in pair.ranges.a_n
        graph.insert(chain, GraphEntry(seq, None, frames))
    pair, _, _ = views(graph)
    assert late[0] in pair.ranges.a_n


def test_what_was_measured_at_a_keyframe_that_goes_is_true_at_the_one_that_stays() -> None:
    pair, _, _ = views(measured(2_500))
    table = pair.ranges
    for a_n, b_n, q_a, q_b, metres in zip(
        table.a_n, table.b_n, table.q_a, table.q_b, table.range_m, strict=True
    ):
        tips = [
            product(path[k], (*arm, 0))[:2]
            for path, k, arm in ((ONE, number(a_n), q_a), (OTHER, number(b_n, AHEAD), q_b))
        ]
        assert math.hypot(*(tips[0] - tips[1])) == pytest.approx(metres, abs=4e-3)
    for item in pair.kept_closures():
        pose = product(inverted(ONE[number(item.a_n)]), OTHER[number(item.b_n, AHEAD)])
        # keyframes are whole steps of 0.1 mrad
        assert same_pose(np.array(item.a_T_b), pose, 2e-3 + 1e-4 * float(np.hypot(*pose[:2])))
    assert (np.hypot(*table.q_a.T) > 2).any()


def test_robots_are_turned_against_the_keyframes_that_stay_by_the_way_between_as_well() -> None:
    graph = measured(2_500)
    table, said = views(graph)[0].ranges, graph.pairs[0, 1].ranges
    second = np.searchsorted(said.place, table.place)
    for k, was in enumerate(second.tolist()):
        for turn, said_turn, path, at in (
            (table.turn_a[k], 0.3 * math.sin(was), ONE, number(table.a_n[k])),
            (table.turn_b[k], 3.1 * math.cos(was), OTHER, number(table.b_n[k], AHEAD)),
        ):
            between = float(relative(path, at, was)[2])
            # keyframes are whole steps of 0.1 mrad
            assert math.remainder(turn - between - said_turn, 2 * math.pi) == pytest.approx(
                0.0, abs=2e-4
            )
            assert abs(turn) <= math.pi
    assert (10 * second != table.a_n).sum() > 500


@pytest.mark.parametrize("owner_turns", [True, False])
def test_the_heading_of_a_carried_closure_stays_within_half_a_turn(owner_turns: bool) -> None:
    """One robot circles, so now and then a closure is carried over the half turn."""
    seconds = 460
    circle = np.array([[math.cos(k / 5), math.sin(k / 5), k / 5 - 50] for k in range(seconds)])
    still = np.tile([4.0, 1.0, 0.4], (seconds, 1))
    one, other = (circle, still) if owner_turns else (still, circle)
    n = range(0, 10 * seconds, 10)
    graph = PoseGraph()
    graph.insert(B, GraphEntry(0, keyframes=keyframes(n, other)))
    seen = [closure(k, 10 * k, B, 10 * k, product(inverted(one[k]), other[k])) for k in range(140)]
    graph.insert(A, GraphEntry(0, None, keyframes(n, one), (), tuple(seen)))
    kept = graph.view.pairs[0].kept_closures()
    assert sum({item.a_n, item.b_n} != {10 * item.number} for item in kept) > 30
    for item in kept:
        a, b = one[item.a_n // 10], other[item.b_n // 10]
        assert item.a_T_b == pytest.approx(product(inverted(a), b), abs=1e-3)


def test_points_that_were_carried_move_with_scale_and_yaw_rate_as_odometry_does() -> None:
    """Numerically, by wheels that are wrong by 1e-3 to either side."""
    plain, a, _ = views(measured(2_500))
    for constant, wrong in ((0, _bent), (1, _scaled)):
        ends = [
            views(measured(2_500, (wrong(ONE, by), wrong(OTHER, by))))[0].ranges
            for by in (1e-3, -1e-3)
        ]
        for end, name in enumerate(("q_a", "q_b")):
            change = (getattr(ends[0], name) - getattr(ends[1], name)) / 2e-3
            moves = plain.moves[:, end, constant]
            moving = moves.any(axis=1)
            # keyframes are whole steps of 0.1 mm and 0.1 mrad
            assert moves[moving] == pytest.approx(change[moving], abs=1.0)
            assert np.abs(moves).max() > (20 if constant == 0 else 3)
            assert (moves[plain.ranges.a_n > a.recent_n] == 0).all()
            # what was carried over a short way moves little
            assert np.abs(change[~moving]).max() < 1.0 + MOVING_M


def _bent(path: Array, rate: float) -> Array:
    """What wheels with a yaw rate say of a path."""
    step = se2.between(path[:-1], path[1:])
    turn = rate * np.hypot(step[:, 0], step[:, 1])
    heading = path[0, 2] + np.concatenate([[0], np.cumsum(step[:, 2] + turn)])
    way = se2.rotate(heading[:-1] + turn / 2, step[:, :2])
    place = path[0, :2] + np.concatenate([np.zeros((1, 2)), np.cumsum(way, axis=0)])
    return np.column_stack([place, heading])


def _scaled(path: Array, by: float) -> Array:
    return np.column_stack([(1 + by) * path[:, :2], path[:, 2]])


def test_a_range_is_as_much_less_certain_as_odometry_between() -> None:
    """Against noisy drives: the variance of the antenna's place, in the mean over directions."""
    graph = measured(2_500)
    pair, said = views(graph)[0], graph.pairs[0, 1].ranges
    checked = 0
    for k in range(0, len(pair.ranges), 41):
        was = int(np.searchsorted(said.place, pair.ranges.place[k]))
        extra = pair.ranges.sigma_m[k] ** 2 - 0.1**2
        expected = 0.0
        for path, end, second, arm in (
            (ONE, number(pair.ranges.a_n[k]), was, ARM_A),
            (OTHER, number(pair.ranges.b_n[k], AHEAD), was, ARM_B),
        ):
            expected += _spread_of_point(path, end, second, arm)
        assert extra == pytest.approx(expected, rel=0.1, abs=1e-6)
        checked += extra > 1e-4
    assert checked >= 5


def _spread_of_point(path: Array, end: int, was: int, arm: tuple[float, float]) -> float:
    """m^2: half the variance of a point of the body at `was`, seen from the pose at `end`."""
    errors = _noisy(path, end, was, NOISE.random_part(), drives=4_000)
    point = product(relative(path, end, was), (*arm, 0))[:2]
    tips = se2.transform(errors, np.broadcast_to(arm, (len(errors), 2)))
    return float(((tips - point) ** 2).sum(axis=1).mean() / 2)


def _noisy(path: Array, end: int, was: int, noise: OdometryNoise, drives: int) -> Array:
    """(drives, 3) pose `was` seen from pose `end` by noisy odometry."""
    rng = np.random.default_rng(1_000 * end + was)
    low, high = sorted((end, was))
    wrong = np.zeros((drives, 3))
    scale = rng.normal(0, noise.scale, drives) if noise.scale else np.zeros(drives)
    bend = rng.normal(0, noise.yaw_rad_per_m, drives) if noise.yaw_rad_per_m else np.zeros(drives)
    for x, y, theta in se2.between(path[low:high], path[low + 1 : high + 1]):
        root = math.sqrt(math.hypot(x, y))
        turn = bend * root**2 + rng.normal(0, noise.yaw_rad_per_sqrt_m * root, drives)
        shift = rng.normal(0, noise.translation_per_sqrt_m * root, (drives, 2))
        way = se2.rotate(turn / 2, np.outer(1 + scale, [x, y]) + shift)
        wrong = se2.compose(wrong, np.column_stack([way, theta + turn]))
    return wrong if was >= end else se2.inverse(wrong)


def test_a_closure_is_as_much_less_certain_as_odometry_on_both_sides() -> None:
    """Constant errors of the wheels are part of it: who uses closures does not know them."""
    graph = measured(2_500, closure_sigma=0.02)
    pair, _, _ = views(graph)
    said = {c.number: c for c in graph.pairs[0, 1].kept_closures()}
    table = pair.closures
    checked = 0
    for k in range(0, len(table), 9):
        was = said[int(table.number[k])]
        ends = number(table.a_n[k]), number(table.b_n[k], AHEAD)
        if (ends[0], ends[1]) == (number(was.a_n), number(was.b_n, AHEAD)):
            continue
        drives = 4_000
        one = _noisy(ONE, ends[0], number(was.a_n), NOISE, drives)
        other = _noisy(OTHER, ends[1], number(was.b_n, AHEAD), NOISE, drives)
        rng = np.random.default_rng(k)
        seen = np.array(was.a_T_b) + rng.normal(0, 1, (drives, 3)) * [0.02, 0.02, 0.01]
        poses = se2.compose(se2.compose(one, seen), se2.inverse(other))
        errors = poses - product(inverted(ONE[ends[0]]), OTHER[ends[1]])
        errors[:, 2] = se2.wrap(errors[:, 2])
        found = errors.T @ errors / drives
        sigma = np.sqrt(np.diag(found))
        assert (np.abs(table.covariance[k] - found) / np.outer(sigma, sigma)).max() < 0.12
        checked += 1
    assert checked > 10


# again and again


def test_what_a_robot_says_of_its_wheels_counts_for_what_was_carried_before() -> None:
    graph = measured(1_500)
    before = views(graph)[0].ranges.sigma_m
    worse = model_of(replace(NOISE, yaw_rad_per_sqrt_m=5 * NOISE.yaw_rad_per_sqrt_m))
    graph.insert(B, GraphEntry(9_999, worse))
    after = views(graph)[0].ranges
    assert (after.sigma_m >= before).all()
    assert (after.sigma_m > 1.05 * before).sum() > 50
    assert np.array_equal(after.sigma_m[-300:], before[-300:])


def test_a_robot_that_stands_is_measured_at_its_old_keyframe_all_the_while() -> None:
    """b stands for half an hour: its keyframe is old, those of a are not, and few ranges stay."""
    graph = PoseGraph()
    graph.insert(B, GraphEntry(0, None, keyframes(range(0, 100, 10), OTHER[:10])))
    for k in range(2_000):
        ranged = range_item(10 * k, B, 90, 5.0)
        graph.insert(A, GraphEntry(k, None, keyframes([10 * k], ONE[k : k + 1]), (ranged,)))
        if k % 100 == 0:
            assert len(graph.view.chains[1].keyframes) == 10
    pair, a, _ = views(graph)
    recent = pair.ranges.a_n > a.recent_n
    assert recent.sum() == (20_000 - a.recent_n) / 10 - 1
    old = len(a.keyframes) - int(recent.sum())
    assert len(pair.ranges) - recent.sum() <= FEW_RANGES * (old + len(a.parts))


def test_what_others_measured_to_a_start_that_is_past_is_not_there() -> None:
    graph = measured(100)
    assert len(graph.view.pairs) == 1
    graph.insert(Chain(1, 2), GraphEntry(0, None, keyframes([5], OTHER[:1])))
    assert graph.view.pairs == []
    assert graph.view.chains[1].keyframes.n.tolist() == [5]
