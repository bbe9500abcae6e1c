"""Poses against the truth, in the frame that they name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.recordings import world
from lab.recordings.recording import Array
from lab.report.evidence import Published
from lab.report.honesty import honesty, origins
from lab.score import metrics

RECORDING = world.simulate(world.Scene(robots=2, seconds=20.0, odometry_hz=10, range_hz=10), 4)

ORIGINS = origins(RECORDING, starts_at_zero=True)


def said(off: Array) -> Published:
    """Poses of robot 1 in the frame of robot 0, a tenth of a metre and radian of sigma."""
    trail = RECORDING.trails[1]
    t = np.linspace(1, 19, len(off))
    truth = metrics.at_times(trail.t, trail.truth, t)
    poses = metrics.relative(RECORDING.trails[0].truth[0], truth) + off
    covariances = np.tile(np.diag([0.01, 0.01, 0.01]), (len(off), 1, 1))
    return Published(t, poses, covariances, np.zeros(len(off), int), np.ones(len(off), int))


def test_poses_as_wrong_as_they_say_have_three_and_95_percent() -> None:
    off = np.random.default_rng(1).normal(scale=0.1, size=(4_000, 3))
    found = honesty(RECORDING, {1: said(off)}, ORIGINS)[1]
    assert found.squared.mean() == pytest.approx(3.0, abs=0.15)
    assert found.share_inside == pytest.approx(0.95, abs=0.012)


def test_a_pose_that_is_three_sigma_off_in_x_has_nine() -> None:
    two = said(np.array([[0.3, 0, 0], [0, 0, 0.2]]))
    found = honesty(RECORDING, {1: two}, ORIGINS)[1]
    assert found.squared == pytest.approx([9.0, 4.0])
    assert found.share_inside == 0.5


def test_poses_in_a_frame_that_nobody_knows_are_left_out() -> None:
    strange = replace(said(np.zeros((3, 3))), frame=np.array([0, 7, 0]))
    found = honesty(RECORDING, {1: strange}, ORIGINS)[1]
    assert len(found.t) == len(found.claims) == 2
    nowhere = replace(strange, frame=np.array([7, 7, 7]))
    nothing = honesty(RECORDING, {1: nowhere}, ORIGINS)[1]
    assert np.isnan(nothing.share_inside)


def test_a_frame_is_where_odometry_was_zero() -> None:
    """Odometry and truth in one frame that began elsewhere: there it is, whatever came first."""
    start = np.array([2.0, -1.0, 0.7])
    trail = RECORDING.trails[0]
    true = metrics.compose(start[None], trail.odometry)
    later = replace(trail, t=trail.t[50:], odometry=trail.odometry[50:], truth=true[50:])
    found = origins(replace(RECORDING, trails={0: later}), starts_at_zero=False)[0]
    assert found == pytest.approx(start)
    whole = replace(RECORDING, trails={0: replace(trail, truth=true)})
    assert origins(whole, starts_at_zero=True)[0] == pytest.approx(start)


def test_after_the_end_of_the_truth_nothing_is_compared() -> None:
    late = replace(said(np.zeros((3, 3))), t=np.array([1.0, 19.98, 21.0]))
    assert len(honesty(RECORDING, {1: late}, ORIGINS)[1].t) == 1 + int(
        RECORDING.trails[1].t[-1] >= 19.98
    )
