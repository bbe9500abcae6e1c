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


def honesty(recording: Recording, published: dict[int, Published]) -> dict[int, Honesty]:
    """Of each robot, in the frames that its poses name: where the robots of those really began.

    The robot of the frame itself knows its own start, so its poses say the least; all count.
    """
    out = {}
    for robot, said in sorted(published.items()):
        trail = recording.trails[robot]
        true = metrics.at_times(trail.t, trail.truth, said.t)
        claims, times = [], []
        for t, pose, covariance, truth, frame in zip(
            said.t, said.poses, said.covariances, true, said.frame.tolist(), strict=True
        ):
            if frame in recording.trails and covariance.any():
                origin = recording.trails[frame].truth[0]
                claims.append(claim(pose, covariance, metrics.relative(origin, truth)))
                times.append(t)
        out[robot] = Honesty(np.array(times), claims)
    return out
