"""The rows of tools/accuracy: figures on either side of what is wanted, and what goes into them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.accuracy import accuracy_rows
from lab.accuracy.accuracy_rows import Figure
from lab.recordings.recording import Recording, Trail
from lab.score.outcome import Outcome


@pytest.mark.parametrize(
    ("reached", "is_least", "is_reached"),
    [
        (0.15, False, True),
        (0.151, False, False),
        (0.15, True, True),
        (0.149, True, False),
        (math.inf, False, False),
        (math.nan, False, False),
        (math.nan, True, False),
    ],
)
def test_a_figure_is_reached_up_to_what_is_wanted(
    reached: float, is_least: bool, is_reached: bool
) -> None:
    assert Figure("made", "position", reached, 0.15, "m", is_least).is_reached is is_reached


def test_the_median_over_runs_is_taken_figure_by_figure() -> None:
    def run(metres: float, share: float) -> list[Figure]:
        return [
            Figure("made", "position", metres, 0.5, "m"),
            Figure("made", "share", share, 0.9, "", True),
        ]

    position, share = accuracy_rows._median([run(1.0, 0.7), run(9.0, 0.8), run(2.0, 0.1)])
    assert position == Figure("made", "position", 2.0, 0.5, "m")
    assert share == Figure("made", "share", 0.7, 0.9, "", True)


def straight(robot: int, odometry_off: dict[float, float], y: float = 0.0) -> Trail:
    """0.5 m/s along x for 100 s; at some times odometry jumps ahead by some metres."""
    t = np.arange(0, 100, 0.1)
    truth = np.column_stack([0.5 * t, np.full(len(t), y), np.zeros(len(t))])
    jumps = sum((t >= when) * metres for when, metres in odometry_off.items())
    return Trail(robot, t, truth + np.column_stack([jumps + 0 * t, 0 * t, 0 * t]), truth)


def test_odometry_is_broken_for_as_long_as_a_window_remembers_it() -> None:
    trails = {0: straight(0, {}), 1: straight(1, {20.0: 0.3, 80.0: 0.2})}
    recording = Recording("made", trails, np.zeros((0, 4)))
    when = np.array([10.0, 18.0, 20.5, 59.0, 61.0, 95.0])
    touched = accuracy_rows._while_broken(recording, when)
    assert touched.tolist() == [False, False, True, True, False, False]


def test_the_bias_that_is_not_found_is_the_median_of_what_is_left_of_ranges() -> None:
    trails = {0: straight(0, {}), 1: straight(1, {}, y=3.0)}
    errors = (0.1, 0.2, 0.9)
    rows = [[10.0 + k, 0, 1, 3.0 + error] for k, error in enumerate(errors)]
    rows.append([14.0, 1, 0, 9.0])
    recording = Recording("made", trails, np.array(rows))
    # over 3 m a near-range bias of 0.1 m at range 0 has fallen to 0.1 / e
    for found, left in (
        (Outcome(), 0.2),
        (Outcome(bias_m={"0-1": 0.15}), 0.05),
        (Outcome(bias_m={"0-1": 0.15}, near_bias_m=0.1), 0.05 - 0.1 / math.e),
    ):
        assert accuracy_rows.bias_not_found(recording, 0, 1, found) == pytest.approx(left)
