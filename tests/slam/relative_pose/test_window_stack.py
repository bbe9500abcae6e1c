"""Windows as one: what fills the shorter ones up, and whose a row is."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import Array, curved_window, matrix

from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_stack import Groups, WindowStack, middle


def windows(*counts: int) -> list[Window]:
    rng = np.random.default_rng(1)
    return [
        curved_window(rng, 6.0, n, a_antenna=(0.2, 0.1), b_antenna=(-0.1, 0.3))[0] for n in counts
    ]


@pytest.mark.parametrize("counts", [(40,), (40, 40), (12, 40, 7)])
def test_every_window_is_in_the_stack_as_it_was(counts: tuple[int, ...]) -> None:
    some = windows(*counts)
    stack = WindowStack.of(some)
    assert stack.counts.tolist() == stack.before.tolist() == list(counts)
    for k, (window, n) in enumerate(zip(some, counts, strict=True)):
        assert np.array_equal(stack.t[k, :n], window.t)
        assert np.array_equal(stack.ranges[k, :n], window.ranges)
        for points, poses, antenna in (
            (stack.points[0, k], window.a_poses, window.a_antenna),
            (stack.points[1, k], window.b_poses, window.b_antenna),
        ):
            places = [(matrix(pose) @ [*antenna, 1.0])[:2] @ [1, 1j] for pose in poses]
            assert np.allclose(points[:n], places)
            assert not points[n:].any()
    held = [[True] * n + [False] * (max(counts) - n) for n in counts]
    assert (stack.held is None) is all(np.ravel(held))
    assert stack.held is None or stack.held.tolist() == held


def test_what_was_measured_after_the_reference_time_is_not_before_it() -> None:
    (window,) = windows(9)
    later = Window(window.t + 1.0, *list(vars(window).values())[1:])
    assert WindowStack.of([later]).before.tolist() == [7]


@pytest.mark.parametrize(
    ("t", "ranges", "latest"),
    [
        ([-9.0, -2.0, -1.0, 0.0], [9.0, 5.0, 7.0, 6.0], 6.0),
        ([-9.0, -0.2, 0.1, 0.3, 5.0], [9.0, 5.0, 7.0, 6.0, 1.0], 6.0),
        ([-9.0, 0.0], [4.0, 7.0], 5.5),
        ([-9.0], [4.0], 4.0),
    ],
)
def test_the_latest_range_is_the_middle_of_the_three_nearest_in_time(
    t: list[float], ranges: list[float], latest: float
) -> None:
    n, still = len(t), np.zeros((len(t), 3))
    short = Window(np.array(t), np.array(ranges), still, still, np.zeros(2), np.zeros(2))
    (longer,) = windows(n + 3)
    for some in ([short], [short, longer]):
        stack = WindowStack.of(some)
        assert stack.latest_ranges[0] == latest
        assert stack.least_ranges[0] == min(ranges)


@pytest.mark.parametrize("counts", [[1, 1], [2, 2], [3, 3], [6, 6], [7, 7], [3, 7], [1, 4]])
def test_the_middle_is_the_median_of_what_is_there(counts: list[int]) -> None:
    values: Array = np.random.default_rng(2).normal(size=(2, max(counts)))
    expected = [np.median(row[:n]) for row, n in zip(values, counts, strict=True)]
    assert np.allclose(middle(values, np.array(counts)), expected)


def test_rows_of_a_window_know_each_other_and_no_others() -> None:
    groups = Groups(np.array([0, 0, 3, 4, 4, 4]))
    values = np.array([2.0, 1.0, 5.0, 4.0, 3.0, 9.0])
    assert groups.starts.tolist() == [0, 2, 3]
    assert groups.least(values).tolist() == [1.0, 1.0, 5.0, 3.0, 3.0, 3.0]
    assert groups.where_all(values > 1.0).tolist() == [False, False, True, True, True, True]
    assert groups.in_order(values).tolist() == [1, 0, 2, 4, 3, 5]
    assert groups.slices() == [(0, slice(0, 2)), (3, slice(2, 3)), (4, slice(3, 6))]


def test_one_window_has_one_group_and_nothing_has_none() -> None:
    one = Groups(np.array([2, 2, 2]))
    assert one.slices() == [(2, slice(0, 3))]
    assert one.least(np.array([3.0, 1.0, 2.0])).tolist() == [1.0, 1.0, 1.0]
    assert one.in_order(np.array([3.0, 1.0, 1.0])).tolist() == [1, 2, 0]
    none = Groups(np.zeros(0, dtype=np.int64))
    assert none.slices() == []
    assert none.least(np.zeros(0)).tolist() == none.in_order(np.zeros(0)).tolist() == []
