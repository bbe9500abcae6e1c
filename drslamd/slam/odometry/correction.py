"""Odometry without its known errors: scale, yaw rate, and turns that are longer than they seem."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.se2 import Array


class Correction(NamedTuple):
    """
    Attributes:
        scale: ways are so much shorter, a fraction.
        yaw: a turn that is not there, rad/m.
        turn: turns are so much longer, a fraction.
    """

    scale: float = 0.0
    yaw: float = 0.0
    turn: float = 0.0

    def path(self, poses: Array) -> Array:
        """(k, 3) poses o_T_i of a track, as they should have been, from the first of them on."""
        if not any(self) or len(poses) < 2:
            return poses
        step = se2.between(poses[:-1], poses[1:])
        x, y, theta = step[:, 0], step[:, 1], se2.wrap(step[:, 2])
        bend = self.turn * theta - self.yaw * np.hypot(x, y)
        # what turned too little also went too straight: half of it acts over the step
        xy = se2.rotate(bend / 2, (1 - self.scale) * step[:, :2])
        out = np.empty((len(poses), 3))
        out[0] = poses[0]
        out[1:, 2] = poses[0, 2] + np.cumsum(theta + bend)
        out[1:, :2] = poses[0, :2] + np.cumsum(se2.rotate(out[:-1, 2], xy), axis=0)
        return out
