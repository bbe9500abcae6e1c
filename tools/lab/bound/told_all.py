"""An estimator that is told all that the bound is: does it come as near as the bound says?

Kalman's filter and smoother with every sigma of the simulator, linear about the truth, on what was
really measured; ranges in bursts are known to it. Its mean square error is the bound, but for what
is not linear and for chance, so a bound that it misses is a wrong one. And where few seeds are
played, how near we come to it on the very same data says more than how near we come to the bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.bound import cramer_rao
from lab.bound.cramer_rao import STEP_S, Gone
from lab.recordings.recording import Array, Recording, Trail
from lab.recordings.world import Scene
from lab.score import metrics

BURST_M = 0.25
"""A range so far above the median of its pair's errors is in a burst: those begin at 0.3 m, and the
slow error seldom comes to 0.2 m."""
NOTHING_M = 1e3
"""Sigma of a step in which nothing was measured."""


@dataclass(frozen=True)
class Found:
    """Of a team of R robots at k times.

    Attributes:
        t: (k,) s.
        live, hindsight: (k, R, 3) poses in the axes of the world, in the frame of robot 0.
    """

    t: Array
    live: Array
    hindsight: Array


def of_recording(recording: Recording, scene: Scene, times: Array) -> Found:
    """What it finds out about a simulated recording of a scene, at these times, s."""
    truths = cramer_rao.true_steps(recording)
    at = cramer_rao.steps_at(times, len(truths))
    measured, white = _ranged(recording, scene, truths)
    gone = cramer_rao.through(truths, scene, white, at)
    driven = _driven(recording, truths, gone.sight.shape[2])
    live, hindsight = _estimated(gone, measured, driven, at)
    poses, shape = 3 * truths.shape[1], (len(at), truths.shape[1], 3)
    live, hindsight = (each[:, :poses].reshape(shape) for each in (live, hindsight))
    return Found(at * STEP_S, truths[at] + live, truths[at] + hindsight)


def _ranged(recording: Recording, scene: Scene, truths: Array) -> tuple[Array, Array]:
    """(n, P) mean errors of the ranges of each step and pair, m, and the variances of their white
    noise."""
    n, robots = truths.shape[:2]
    pairs = cramer_rao.pairs_of(robots)
    errors, white = np.zeros((n, len(pairs))), np.full((n, len(pairs)), NOTHING_M**2)
    for column, pair in enumerate(pairs):
        rows = recording.ranges
        rows = rows[np.isin(rows[:, 1], pair) & np.isin(rows[:, 2], pair)]
        ends = (_places(recording.trails[robot], rows[:, 0]) for robot in pair)
        off = rows[:, 3] - np.hypot(*np.subtract(*ends).T)
        step = np.floor(rows[:, 0] / STEP_S + 1e-6).astype(int)
        is_used = (off < np.median(off) + BURST_M) & (step < n)
        count = np.bincount(step[is_used], minlength=n)
        total = np.bincount(step[is_used], off[is_used], minlength=n)
        known = count > 0
        errors[known, column] = total[known] / count[known]
        white[known, column] = scene.ranges.white**2 / count[known]
    return errors, white


def _places(trail: Trail, t: Array) -> Array:
    """(n, 2) where a robot was."""
    return np.asarray(metrics.at_times(trail.t, trail.truth, t)[:, :2])


def _driven(recording: Recording, truths: Array, size: int) -> Array:
    """(n, size) how far each step of odometry is off the driven one, in the axes of the world."""
    n = len(truths)
    out = np.zeros((n, size))
    t = np.arange(n) * STEP_S
    for robot in range(truths.shape[1]):
        trail, truth = recording.trails[sorted(recording.trails)[robot]], truths[:, robot]
        said = metrics.at_times(trail.t, trail.odometry, t)
        steps = [metrics.relative(poses[:-1], poses[1:]) for poses in (said, truth)]
        off = steps[0] - steps[1]
        cos, sin = np.cos(truth[:-1, 2]), np.sin(truth[:-1, 2])
        at = 3 * robot
        out[1:, at] = cos * off[:, 0] - sin * off[:, 1]
        out[1:, at + 1] = sin * off[:, 0] + cos * off[:, 1]
        out[1:, at + 2] = metrics.wrapped(off[:, 2])
    return out


def _estimated(gone: Gone, measured: Array, driven: Array, at: Array) -> tuple[Array, Array]:
    """(k, size) by how much its state is off the truth, filtered and smoothed."""
    n, _, size = gone.sight.shape
    state, live, predicted = np.zeros(size), dict[int, Array](), np.zeros((n, size))
    surprise = np.zeros(measured.shape)
    for k, (f, gain, _) in enumerate(gone.steps):
        predicted[k] = state = f @ state + driven[k]
        surprise[k] = measured[k] - gone.sight[k] @ state
        state = state + gain @ surprise[k]
        live[k] = state
    later, smoothed = np.zeros(size), dict[int, Array]()
    for k in range(n - 1, -1, -1):
        f, gain, innovation = gone.steps[k]
        h = gone.sight[k]
        later = later - h.T @ (gain.T @ later) + h.T @ np.linalg.solve(innovation, surprise[k])
        if k in gone.predicted:
            smoothed[k] = predicted[k] + gone.predicted[k] @ later
        later = f.T @ later
    steps = at.tolist()
    return np.array([live[k] for k in steps]), np.array([smoothed[k] for k in steps])
