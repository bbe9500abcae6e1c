"""Where a tracker sits, from its own motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.recordings import seat
from lab.recordings.recording import Array
from lab.score import metrics


def axle(seconds: float = 60.0) -> tuple[Array, Array]:
    """A robot that drives curves of many kinds and never sideways."""
    t = np.arange(0, seconds, 0.05)
    speed, turn = 0.3 + 0.2 * np.sin(0.3 * t), 0.5 * np.sin(0.7 * t)
    heading = np.cumsum(turn) * 0.05
    middle = heading - turn * 0.025
    steps = np.stack([speed * np.cos(middle), speed * np.sin(middle)], axis=-1) * 0.05
    return t, np.column_stack([np.cumsum(steps, axis=0), heading])


@pytest.mark.parametrize(("ahead", "left_deg"), [(0.0, 0.0), (0.12, -3.0), (-0.2, 5.0)])
def test_a_tracker_is_found_where_it_was_mounted(ahead: float, left_deg: float) -> None:
    t, poses = axle()
    mounted = np.array([[ahead, 0.0, math.radians(left_deg)]])
    seen = metrics.compose(poses, mounted)
    found_ahead, found_left = seat.seat(t, seen)
    assert found_ahead == pytest.approx(ahead, abs=0.003)
    assert math.degrees(found_left) == pytest.approx(left_deg, abs=0.2)
    assert seat.on_axle(t, seen) == pytest.approx(poses, abs=0.005)


def test_moments_in_which_a_tracker_jumps_do_not_move_its_seat() -> None:
    t, poses = axle()
    seen = metrics.compose(poses, np.array([[0.1, 0.0, math.radians(2.0)]]))
    seen[400:] += [0.0, 3.0, 0.0]
    ahead, left = seat.seat(t, seen)
    assert ahead == pytest.approx(0.1, abs=0.005)
    assert math.degrees(left) == pytest.approx(2.0, abs=0.2)


def test_who_only_drives_straight_tells_the_angle_and_nothing_else() -> None:
    t = np.arange(0, 20, 0.1)
    seen = np.column_stack([0.3 * t, 0.3 * t * math.tan(0.05), np.zeros(len(t))])
    ahead, left = seat.seat(t, seen)
    assert ahead == pytest.approx(0.0, abs=1e-9)
    assert left == pytest.approx(-0.05, abs=0.001)
