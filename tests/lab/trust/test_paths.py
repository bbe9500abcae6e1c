"""Paths of the worlds are what they say, and such as wheels can drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lab.recordings.recording import Array
from lab.recordings.world import STEP_S, Scene
from lab.trust import paths
from lab.trust.worlds import LONGER

DRAWN = [paths.each_alone, paths.in_line, paths.lanes, paths.on_the_spot]


def truths(
    draw: Callable[[np.random.Generator, Scene], list[Array]], robots: int = 3, seed: int = 5
) -> list[Array]:
    return draw(np.random.default_rng(seed), replace(LONGER, robots=robots))


@pytest.mark.parametrize("draw", DRAWN)
def test_every_robot_drives_for_the_whole_scene_as_fast_as_a_small_base_can(
    draw: Callable[[np.random.Generator, Scene], list[Array]],
) -> None:
    for path in truths(draw):
        assert path.shape == (round(LONGER.seconds / STEP_S), 3)
        step = np.diff(path, axis=0) / STEP_S
        assert np.hypot(step[:, 0], step[:, 1]).max() < 0.8
        assert np.abs(step[:, 2]).max() < 2.5


@pytest.mark.parametrize("draw", [paths.in_line, paths.lanes])
def test_robots_drive_where_they_look(
    draw: Callable[[np.random.Generator, Scene], list[Array]],
) -> None:
    for path in truths(draw):
        step = np.diff(path, axis=0)
        moves = np.hypot(step[:, 0], step[:, 1]) > 0.3 * STEP_S
        middle = (path[1:, 2] + path[:-1, 2])[moves] / 2
        ahead = np.cos(middle) * step[moves, 0] + np.sin(middle) * step[moves, 1]
        assert ahead == pytest.approx(np.hypot(*step[moves, :2].T), abs=0.01 * STEP_S)


def test_who_is_in_line_comes_where_the_first_one_was_a_gap_later() -> None:
    first, second, _ = truths(paths.in_line)
    for place in second[-500::100]:
        assert np.hypot(*(first[:, :2] - place[:2]).T).min() < 0.02
    apart = np.hypot(*(first - second)[:, :2].T)
    assert np.median(apart) == pytest.approx(paths.GAP_M, abs=0.3)


def test_each_patrol_keeps_to_its_lane_and_goes_up_and_down() -> None:
    for k, path in enumerate(truths(paths.lanes, 2)):
        assert np.abs(path[:, 1] - k * paths.APART_M).max() < 1.0
        assert np.ptp(path[:, 0]) == pytest.approx(paths.LANE_M, abs=0.1)
        turns = np.flatnonzero(np.diff(np.sign(np.diff(path[:, 0]))))
        assert len(turns) >= 3


def test_on_the_spot_nobody_moves_and_everybody_turns_both_ways() -> None:
    one, other = truths(paths.on_the_spot, 2)
    for path in (one, other):
        assert np.ptp(path[:, :2], axis=0) == pytest.approx([0, 0])
        rate = np.diff(path[:, 2]) / STEP_S
        assert rate.min() < -0.25
        assert rate.max() > 0.25
        assert np.mean(np.abs(rate) < 1e-9) > 0.02
    least, most = paths.SPOT_M
    assert least <= np.hypot(*(one - other)[0, :2]) <= most
