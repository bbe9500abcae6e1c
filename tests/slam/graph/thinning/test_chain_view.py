"""A chain of which little is left: what stays, and what is believed of the ways between."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from long_drives import A, aged, chain_of, circles, relative
from slam_scenes import NOISE, Array, keyframes, product, same_pose, wander

from drslamd.slam import se2
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.graph.thinning.chain_view import ChainThinning, ChainView, whole
from drslamd.slam.graph.thinning.team_chains import TeamChains
from drslamd.slam.graph.thinning.time_cells import RECENT_S
from drslamd.slam.graph.timed_rows import NEVER
from drslamd.slam.odometry.noise import PATH, WHEELS, OdometryNoise, by_yaw_rate
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.factors import chain_links
from drslamd.slam.robot_model import RobotModel

FAR = np.array([2e5, -2e5, 0.0])
WANDER = wander(np.random.default_rng(1), 30_000, 0.3)


def wandering(seconds: int) -> ChainData:
    return chain_of(range(seconds), lambda t: WANDER[int(t)])


# what stays


@pytest.mark.parametrize("seconds", [1_200, 3_600, 14_400])
def test_the_rest_of_any_time_is_at_most_half_as_much_again(seconds: int) -> None:
    n = aged(wandering(seconds)).keyframes.n
    assert len(n) <= 1.5 * RECENT_S + 64 + 10
    assert n[0] == 0
    age = (10 * seconds - n[:-1]) / 10
    gap = np.diff(n) / 10
    # four times farther apart when the age doubles: the square of the age, and the cells' edges
    assert (gap <= 2 * 16 * np.maximum(age / RECENT_S, 0.25) ** 2 + 1).all()
    recent = age < RECENT_S
    assert (gap[recent] == 1).all()
    assert recent.sum() == RECENT_S - 2


def test_the_first_keyframe_of_each_cell_stays() -> None:
    """Keyframes each 0.7 s for 700 s, against a loop over the cells of each level."""
    times = [round(0.7 * k, 1) for k in range(1_000)]
    view = aged(chain_of(times, lambda t: (0.1 * t, 0.0, 0.0)))
    now = (6_993 // 160) * 16
    borders = {1: (now - 300) // 4 * 40, 2: (now - 600) // 16 * 160}
    kept, last = [], None
    for t in times:
        n = round(10 * t)
        level = sum(n < border for border in borders.values())
        cell = (level, n // (10 * 4**level) if level else n)
        if cell != last:
            kept.append(n)
        last = cell
    assert view.keyframes.n.tolist() == kept


def test_the_first_keyframe_of_every_segment_stays_because_frames_begin_there() -> None:
    data = ChainData(A)
    for k in range(1_000):
        data.add(Keyframe(10 * k, k // 100, 1_000 * k, 0, 0))
    view = aged(data)
    for segment in range(10):
        rows = view.keyframes.of_segment(segment)
        assert view.keyframes.n[rows][0] == 1_000 * segment
    # and no link leads across a break
    ends = view.keyframes.segment
    assert (ends[view.links.i] == ends[view.links.i + 1]).all()
    assert len(view.links.i) == len(ends) - 10


def test_a_chain_of_which_nothing_is_old_is_whole() -> None:
    data = wandering(250)
    for view in (aged(data), whole(data)):
        assert np.array_equal(view.keyframes.rows, data.keyframes.rows)
        assert view.links.i.tolist() == list(range(249))


# links


def test_links_lead_from_each_that_stays_to_the_next() -> None:
    data = wandering(2_500)
    view = aged(data)
    rows = [int(n) // 10 for n in view.keyframes.n]
    assert view.links.i.tolist() == list(range(len(rows) - 1))
    for link, (i, j) in enumerate(itertools.pairwise(rows)):
        assert same_pose(view.links.measured[link], relative(WANDER, i, j), 1e-3)
        way = np.hypot(*np.diff(WANDER[i : j + 1, :2], axis=0).T).sum()
        assert view.links.sums[link, 0] == pytest.approx(way, abs=2e-3)


def test_a_thinned_link_is_as_uncertain_as_the_path_that_was_driven() -> None:
    """64 s of circles against noisy drives: on the chord it would be believed to 0.03 degrees."""
    data = chain_of(range(2_000), circles(1.27, 16.0))
    data.take_model(0, RobotModel(NOISE))
    view = aged(data)
    n = view.keyframes.n
    link = int(np.flatnonzero(np.diff(n) == 640)[1])
    path = data.keyframes.poses[n[link] // 10 : n[link + 1] // 10 + 1]
    for calibrated in (True, False):
        edges = chain_links(view, calibrated)
        noise = NOISE.random_part() if calibrated else NOISE
        seen = _spread_of_drives(path, noise, drives=20_000)
        floor = np.diag([factors.LINK_FLOOR_M**2] * 2 + [factors.LINK_FLOOR_RAD**2])
        believed = np.sqrt(np.diag(edges.covariance[link] - floor))
        assert believed == pytest.approx(np.sqrt(np.diag(seen)), rel=0.05)
        scale = np.sqrt(np.diag(seen))
        difference = (edges.covariance[link] - floor - seen) / np.outer(scale, scale)
        assert np.abs(difference).max() < 0.06
        assert math.degrees(believed[2]) > 2.5


def _spread_of_drives(path: Array, noise: OdometryNoise, drives: int) -> Array:
    """(3, 3) second moment of x, y, theta at the end of a path, each step of it noisy by itself."""
    rng = np.random.default_rng(5)
    step = se2.between(path[:-1], path[1:])
    scale = rng.normal(0, noise.scale, drives) if noise.scale else np.zeros(drives)
    bend = rng.normal(0, noise.yaw_rad_per_m, drives) if noise.yaw_rad_per_m else np.zeros(drives)
    wrong = np.zeros((drives, 3))
    for x, y, theta in step:
        length = math.hypot(x, y)
        turn = bend * length + rng.normal(0, noise.yaw_rad_per_sqrt_m * math.sqrt(length), drives)
        shift = rng.normal(0, noise.translation_per_sqrt_m * math.sqrt(length), (drives, 2))
        way = np.outer(1 + scale, [x, y]) + shift
        moved = np.column_stack([se2.rotate(turn / 2, way), theta + turn])
        wrong = se2.compose(wrong, moved)
    errors = wrong - np.array([*relative(path, 0, len(path) - 1)[:2], step[:, 2].sum()])
    return np.asarray(errors.T @ errors / drives)


def test_the_yaw_rate_acts_over_the_path_that_was_driven() -> None:
    """Numerically: the same drive with wheels that bend it by 1e-3 rad/m to either side."""
    plain, left, right = (_bent(rate) for rate in (0.0, 1e-3, -1e-3))
    by_yaw = by_yaw_rate(plain.links.sums, plain.links.measured[:, :2])
    change = left.links.measured - right.links.measured
    change[:, 2] = se2.wrap(change[:, 2])
    # keyframes are whole steps of 0.1 mm and 0.1 mrad: so much is lost of a difference
    assert np.abs(by_yaw - change / 2e-3).max() < 0.8
    size = np.linalg.norm(by_yaw[:, :2], axis=1)
    assert (size > 50).sum() > 5
    assert by_yaw[size > 50] == pytest.approx((change / 2e-3)[size > 50], abs=0.8)
    assert by_yaw[0, 2] > 15


@pytest.mark.parametrize(
    ("thins", "fraction", "tolerance"), [(True, 1e-3, 0.8), (False, 0.02, 0.01)]
)
def test_turns_that_are_longer_act_where_they_were_made(
    thins: bool, fraction: float, tolerance: float
) -> None:
    """Numerically: the same drive with turns that are so much longer or shorter."""
    plain, more, less = (_bent(0.0, turn, thins) for turn in (0.0, fraction, -fraction))
    change = more.links.measured - less.links.measured
    change[:, 2] = se2.wrap(change[:, 2])
    expected, by_turn = change / (2 * fraction), plain.links.by_turn
    assert np.abs(by_turn - expected).max() < tolerance
    size = np.linalg.norm(by_turn, axis=1)
    if thins:
        assert (size > 20).sum() > 5
        # by the chords of links alone it would be something else
        turn = se2.wrap(plain.links.measured[:, 2])
        chord = np.stack([-plain.links.measured[:, 1], plain.links.measured[:, 0]], axis=-1)
        assert np.abs(by_turn[:, :2] - turn[:, None] / 2 * chord).max() > 10
    else:
        assert len(size) == 1_999
        assert size.max() > 0.3


def test_turns_of_all_parts_are_those_of_their_links() -> None:
    """Rows of links and of what moves them stay together over parts of any age, and breaks."""
    data = ChainData(A)
    for k in range(1_500):
        x, y, theta = (round(1e4 * v) for v in WANDER[k])
        data.add(Keyframe(10 * k, k // 700, x, y, theta))
    view = aged(data)
    n, poses = view.keyframes.n, data.keyframes.poses
    assert len(view.links.by_turn) == len(view.links.i) < len(n) - 1
    for link, i in enumerate(view.links.i.tolist()):
        rows = poses[n[i] // 10 : n[i + 1] // 10 + 1]
        turns = np.diff(rows[:, 2])
        assert view.links.by_turn[link, 2] == pytest.approx(se2.wrap(turns).sum(), abs=1e-9)


def _bent(rate: float, turn: float = 0.0, thins: bool = True) -> ChainView:
    """WANDER for 2,000 s by wheels with a yaw rate, and turns longer by a fraction."""
    step = se2.between(WANDER[:1_999], WANDER[1:2_000])
    length = np.hypot(step[:, 0], step[:, 1])
    pose, poses = np.zeros(3), [np.zeros(3)]
    for (x, y, theta), way in zip(step, length, strict=True):
        half = [0.0, 0.0, (rate * way + turn * float(se2.wrap(theta))) / 2]
        pose = product(product(product(pose, half), [x, y, theta]), half)
        poses.append(pose)
    path = np.array(poses)
    path[:, 2] = np.unwrap(path[:, 2])
    data = chain_of(range(2_000), lambda t: path[int(t)])
    return aged(data) if thins else whole(data)


def test_a_link_far_from_the_origin_keeps_its_digits() -> None:
    """200 km away, where sums along the chain are 1e16; and beside a jump as far as that."""
    near = aged(wandering(1_000))
    far = aged(chain_of(range(1_000), lambda t: WANDER[int(t)] + FAR))
    jump = aged(chain_of(range(1_000), lambda t: WANDER[int(t)] + (t > 300) * FAR))
    plain = chain_links(near, calibrated=True).covariance
    assert np.allclose(chain_links(far, calibrated=True).covariance, plain, rtol=1e-3, atol=1e-8)
    jumped = chain_links(jump, calibrated=True).covariance
    size = np.linalg.norm(jumped, axis=(1, 2))
    assert (np.abs(jumped - plain)[size < 1].max(axis=(1, 2)) < 1e-3 * size[size < 1] + 1e-8).all()
    assert (size >= 1).sum() == 1


# what was measured at keyframes that went


def seen(view: ChainView) -> TeamChains:
    """All rows of one chain."""
    return TeamChains({0: view}, {0: (0, NEVER)})


def test_bodies_are_seen_from_the_nearest_keyframe_that_stays() -> None:
    data = wandering(2_000)
    view = aged(data)
    rows = np.arange(2_000)
    carried = seen(view).carried(rows)
    stays = view.keyframes.n
    for row in range(0, 2_000, 7):
        distance = np.abs(stays - 10 * row)
        assert abs(carried.n[row] - 10 * row) == distance.min()
        at = int(carried.n[row]) // 10
        assert same_pose(carried.keyframe_T_body[row], relative(WANDER, at, row), 1e-3)
        low, high = sorted((at, row))
        way = np.hypot(*np.diff(WANDER[low : high + 1, :2], axis=0).T).sum()
        assert carried.sums[row, 0] == pytest.approx(way, abs=2e-3)
        assert carried.is_after[row] == (row >= at)
    assert (seen(view).is_old == (10 * rows < view.recent_n)).all()
    assert (carried.n[10 * rows >= view.recent_n] == 10 * rows[10 * rows >= view.recent_n]).all()


def test_the_way_between_is_summed_in_the_frame_of_that_keyframe() -> None:
    """Against a loop over the steps, in both directions of time."""
    data = wandering(2_000)
    view = aged(data)
    rows = np.array([3, 4, 9, 130, 301, 888, 1_003, 1_500])
    carried = seen(view).carried(rows)
    poses = data.keyframes.poses
    for k, row in enumerate(rows.tolist()):
        at = int(carried.n[k]) // 10
        low, high = sorted((at, row))
        sums = np.zeros(6)
        for step in range(low, high):
            here, there = (relative(poses, at, m)[:2] for m in (step, step + 1))
            x, y = (here + there) / 2
            length = math.hypot(*(there - here))
            sums += length * np.array([1, y, -x, y * y, -x * y, x * x])
        assert carried.sums[k, WHEELS] == pytest.approx(sums, abs=1e-9)
        assert carried.sums[k, PATH] == pytest.approx(sums[0], abs=1e-9)
    assert {bool(after) for after in carried.is_after} == {True, False}


def test_nothing_is_carried_across_a_break() -> None:
    """The last keyframe before it is nearer to the first one behind it than to its own."""
    data = ChainData(A)
    for k in range(400):
        data.add(Keyframe(10 * k, int(k >= 3), 1_000 * k, 0, 0))
    view = aged(data)
    assert seen(view).carried(np.array([1, 2, 3])).n.tolist() == [0, 0, 30]


# again and again


def test_what_is_old_is_made_anew_only_when_time_steps_or_something_comes_late() -> None:
    data, thinning = wandering(2_000), ChainThinning()
    before = thinning.view(data, 120, RECENT_S)
    for k in keyframes([20_000], [WANDER[2_000]]):
        data.add(k)
    after = thinning.view(data, 120, RECENT_S)
    assert after.parts[:-1] == before.parts[:-1]
    assert after.parts[-1] is not before.parts[-1]
    for k in keyframes([9_003], [WANDER[900]]):
        data.add(k)
    late = thinning.view(data, 120, RECENT_S)
    changed = [new is not old for new, old in zip(late.parts, after.parts, strict=True)]
    at = [p.stretch.first <= 9_003 < p.stretch.end for p in late.parts]
    assert changed == at
    stepped = thinning.view(data, 121, RECENT_S)
    assert [p.stretch.kind for p in stepped.parts] == [
        (3, False),
        (2, False),
        (1, False),
        (0, False),
        (0, True),
    ]
    assert stepped.parts[0] is late.parts[0]


def test_a_row_of_nonsense_in_front_changes_the_segments_behind_it() -> None:
    """A segment never comes back; robots that got the row first or last hold the same."""
    data, thinning = wandering(2_000), ChainThinning()
    thinning.view(data, 120, RECENT_S)
    data.add(Keyframe(3, 7, 0, 0, 0))
    again = thinning.view(data, 120, RECENT_S)
    assert (again.keyframes.segment[1:] == 7).all()
    fresh = aged(data)
    assert np.array_equal(ChainThinning().view(data, 120, RECENT_S).links.sums, again.links.sums)
    assert len(fresh.keyframes) > 0
