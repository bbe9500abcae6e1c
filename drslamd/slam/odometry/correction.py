"""Odometry without its known errors: scale, yaw rate, and turns that are longer than they seem.

Wheels whose sides are swapped, or that both run backwards, turn the other way: they tell the mirror
image of the way that was driven. That is a turn of -2, and what else is learned of such a robot is
of the mirror image.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.se2 import Array

MIRRORED = -2.0
"""Turn of odometry that tells the mirror image of the way."""
MIRROR = np.array([1.0, -1.0, -1.0])
"""Times a pose, its mirror image in the axis of x."""


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

    @property
    def is_mirrored(self) -> bool:
        """Does it turn the other way?"""
        return self.turn < -1

    @property
    def longer(self) -> float:
        """By which fraction turns are longer, whichever way they go."""
        return MIRRORED - self.turn if self.is_mirrored else self.turn

    def path(self, poses: Array) -> Array:
        """(k, 3) poses o_T_i of a track, as they should have been, from the first of them on."""
        if not any(self) or len(poses) < 2:
            return poses
        step = se2.between(poses[:-1], poses[1:])
        if self.is_mirrored:
            step = step * MIRROR
        x, y, theta = step[:, 0], step[:, 1], se2.wrap(step[:, 2])
        bend = self.longer * theta - self.yaw * np.hypot(x, y)
        # what turned too little also went too straight: half of it acts over the step
        xy = se2.rotate(bend / 2, (1 - self.scale) * step[:, :2])
        out = np.empty((len(poses), 3))
        out[0] = poses[0]
        out[1:, 2] = poses[0, 2] + np.cumsum(theta + bend)
        out[1:, :2] = poses[0, :2] + np.cumsum(se2.rotate(out[:-1, 2], xy), axis=0)
        return out
