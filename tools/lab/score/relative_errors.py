"""Errors of relative poses against the truth: of module 1's windows and of published poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.recordings.recording import Array, EdgeRecording, Recording, Trail
from lab.score import metrics
from lab.score.outcome import Closure, Outcome, Path

MOVING_MPS = 0.05
"""A robot that drives slower than this stands."""
NEAR_S = 1.5
"""Two published poses farther apart than this say nothing of each other."""


@dataclass(frozen=True)
class RelativeErrors:
    """(k,) times s, position errors m, rotation errors degrees."""

    t: Array
    metres: Array
    degrees: Array

    def chosen(self, which: NDArray[np.bool_]) -> RelativeErrors:
        return RelativeErrors(self.t[which], self.metres[which], self.degrees[which])

    @property
    def median(self) -> tuple[float, float]:
        """Of position and rotation; infinite of none."""
        if not len(self.t):
            return float("inf"), float("inf")
        return float(np.median(self.metres)), float(np.median(self.degrees))


def true_relative(recording: Recording | EdgeRecording, a: int, b: int, t: Array) -> Array:
    """(k, 3) pose of b in a."""
    poses = [
        metrics.at_times(trail.t, trail.truth, t)
        for trail in (recording.trails[a], recording.trails[b])
    ]
    return metrics.relative(poses[0], poses[1])


def of_windows(recording: Recording, outcome: Outcome) -> RelativeErrors:
    """Every window of every pair for which module 1 named exactly one pose."""
    unique = [c for c in outcome.closures if c.verdict == "unique"]
    found = np.array([c.poses[0] for c in unique]).reshape(-1, 3)
    true = [true_relative(recording, c.a, c.b, np.array([c.t]))[0] for c in unique]
    return _errors(np.array([c.t for c in unique]), found, np.array(true).reshape(-1, 3))


def published(recording: Recording, outcome: Outcome) -> RelativeErrors:
    """Each pose that a robot published, with the latest one of every robot of a higher id."""
    times, found, true = [], [], []
    for a, path in outcome.live.items():
        for b, other in outcome.live.items():
            if b <= a or not len(other.t):
                continue
            for t, pose, frame in zip(path.t, path.poses, path.frame, strict=True):
                carried = _carried(other, recording.trails[b], float(t), float(frame))
                if carried is not None:
                    times.append(float(t))
                    found.append(metrics.relative(pose, carried))
                    true.append(true_relative(recording, a, b, np.array([t]))[0])
    return _errors(np.array(times), np.array(found).reshape(-1, 3), np.array(true).reshape(-1, 3))


def _carried(path: Path, trail: Trail, t: float, frame: float) -> Array | None:
    """A robot's published pose nearest to time t, carried there by its own odometry."""
    at = int(np.argmin(np.abs(path.t - t)))
    if abs(path.t[at] - t) > NEAR_S or path.frame[at] != frame:
        return None
    ends = metrics.at_times(trail.t, trail.odometry, np.array([path.t[at], t]))
    return metrics.compose(path.poses[at], metrics.relative(ends[0], ends[1]))


def _errors(t: Array, found: Array, true: Array) -> RelativeErrors:
    off = found - true
    return RelativeErrors(
        t, np.hypot(off[:, 0], off[:, 1]), np.degrees(np.abs(metrics.wrapped(off[:, 2])))
    )


def moving(trail: Trail, t: Array) -> NDArray[np.bool_]:
    """Does the robot drive at times t (k,)? Over the second around each."""
    before = metrics.at_times(trail.t, trail.truth, t - 0.5)
    after = metrics.at_times(trail.t, trail.truth, t + 0.5)
    return np.asarray(np.hypot(*(after - before)[:, :2].T) > MOVING_MPS)


def squared_mahalanobis(recording: Recording, closure: Closure) -> float:
    """Of the hypothesis nearest to the truth, under the covariance that it claims."""
    true = true_relative(recording, closure.a, closure.b, np.array([closure.t]))[0]
    off = closure.poses - true
    off[:, 2] = metrics.wrapped(off[:, 2])
    return min(
        float(e @ np.linalg.solve(covariance, e))
        for e, covariance in zip(off, closure.covariances, strict=True)
    )
