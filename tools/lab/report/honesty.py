"""Published poses held against the truth: are they as wrong as they say?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.recordings.recording import Array, Recording
from lab.report.evidence import Published
from lab.score import metrics
from lab.score.claims import Claim, claim

HONEST = 3.0
"""Mean squared error of poses, in units of their covariance, that are as wrong as they say."""


@dataclass(frozen=True)
class Honesty:
    """One robot: t (k,) s and what it claimed then."""

    t: Array
    claims: list[Claim]

    @property
    def squared(self) -> Array:
        """(k,) squared errors in units of the covariance; of honest poses 3 in the mean."""
        return np.array([c.squared for c in self.claims])

    @property
    def share_inside(self) -> float:
        """Of poses whose position is in its own 95 % ellipse; nan of none."""
        return float(np.mean([c.is_inside for c in self.claims])) if self.claims else float("nan")


def origins(recording: Recording, starts_at_zero: bool) -> dict[int, Array]:
    """Where the odometry frame of each robot truly is (3,).

    Args:
        starts_at_zero: the robots began to count with the recording, as those that are played one
            do; otherwise its odometry is in their frames.
    """
    out = {}
    for robot, trail in recording.trails.items():
        begin = np.zeros(3) if starts_at_zero else trail.odometry[0]
        out[robot] = metrics.compose(trail.truth[0], metrics.relative(begin, np.zeros(3)))
    return out


def honesty(
    recording: Recording, published: dict[int, Published], origin: dict[int, Array]
) -> dict[int, Honesty]:
    """Of each robot, in the frames that its poses name, while there is a truth.

    The robot of the frame itself knows its own start, so its poses say the least; all count.

    Args:
        origin: see `origins`.
    """
    out = {}
    for robot, said in sorted(published.items()):
        trail = recording.trails[robot]
        true = metrics.at_times(trail.t, trail.truth, said.t)
        claims, times = [], []
        for t, pose, covariance, truth, frame in zip(
            said.t, said.poses, said.covariances, true, said.frame.tolist(), strict=True
        ):
            if frame in origin and trail.t[0] <= t <= trail.t[-1]:
                claims.append(claim(pose, covariance, metrics.relative(origin[frame], truth)))
                times.append(t)
        out[robot] = Honesty(np.array(times), claims)
    return out
