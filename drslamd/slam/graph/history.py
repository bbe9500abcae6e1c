"""Where one robot was, also at keyframes that the graph no longer holds.

A keyframe that was thinned out keeps its place beside the one before it that stayed: later closures
move it only together with that one.
"""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.graph.estimate import Trajectory

MAX_KNOTS = 36_000
"""Ten hours at one a second, 1.2 MB; the oldest are forgotten."""


class History:
    """All solved keyframes of one robot, in the frame of its latest estimate."""

    def __init__(self) -> None:
        self.latest: Trajectory | None = None

    def update(self, solved: Trajectory) -> Trajectory:
        """Take what was solved now; the others follow."""
        before = self.latest
        self.latest = solved
        if before is None or before.chain != solved.chain or not len(solved.n):
            return solved
        gone = ~np.isin(before.n, solved.n)
        at = np.searchsorted(before.n, solved.n)
        known = np.flatnonzero(before.n[np.minimum(at, len(before.n) - 1)] == solved.n)
        if not gone.any() or not len(known):
            return solved
        left = np.searchsorted(solved.n[known], before.n[gone], side="right") - 1
        anchor = known[np.maximum(left, 0)]
        beside = se2.between(before.poses[at[anchor]], before.poses[gone])
        n = np.concatenate([before.n[gone], solved.n])
        poses = np.concatenate([se2.compose(solved.poses[anchor], beside), solved.poses])
        order = np.argsort(n, kind="stable")[-MAX_KNOTS:]
        self.latest = Trajectory(solved.chain, n[order], poses[order])
        return self.latest
