"""Where a camera or a marker sits on a robot that cannot move sideways.

A base with two driven wheels has one point, the middle of its axle, that only moves along its
heading. A tracker that sits a metres ahead of it and is turned by -alpha sees, per step of path f
and turn w,

    sideways = tan(alpha) f + a w

so both follow from the tracker's own trajectory, without any other measurement. Recordings of
trackers are carried to the axle with them before they are played as wheels, and their truth before
anything is scored: both then speak of the same body.
"""

from __future__ import annotations

import numpy as np

from lab.recordings.recording import Array
from lab.score import metrics

STEP_S = 0.3
SHARP_RAD = 0.6
"""A step that turned more is no arc that can be judged."""
SLIP_M = 0.01
"""Scale of Cauchy's weight: moments in which a tracker jumped count for nothing."""
ROUNDS = 20
PRIOR = np.array([0.1, 0.2])
"""Sigmas of tan(alpha) and of a in m: where motion says nothing, the tracker sits on the axle."""


def seat(t: Array, poses: Array) -> tuple[float, float]:
    """How a tracker with poses (k, 3) sits: metres ahead of the axle, radians to the left."""
    when = np.arange(t[0], t[-1], STEP_S)
    at = metrics.at_times(t, poses, when)
    step = metrics.relative(at[:-1], at[1:])
    half = step[:, 2] / 2
    forward = np.cos(half) * step[:, 0] + np.sin(half) * step[:, 1]
    sideways = np.cos(half) * step[:, 1] - np.sin(half) * step[:, 0]
    usable = np.abs(step[:, 2]) < SHARP_RAD
    a = np.column_stack([forward, step[:, 2]])[usable]
    y = sideways[usable]
    found = np.zeros(2)
    for _ in range(ROUNDS):
        weight = 1 / (1 + ((y - a @ found) / SLIP_M) ** 2)
        normal = (a * weight[:, None]).T @ a + np.diag((SLIP_M / PRIOR) ** 2)
        found = np.linalg.solve(normal, (a * weight[:, None]).T @ y)
    return float(found[1]), float(-np.arctan(found[0]))


def on_axle(t: Array, poses: Array) -> Array:
    """(k, 3) poses of the axle of the robot that carries the tracker."""
    ahead, left = seat(t, poses)
    # the tracker stands at [ahead, 0, left] in the frame of the axle
    axle = metrics.relative(np.array([[ahead, 0.0, left]]), np.zeros((1, 3)))
    return metrics.compose(poses, axle)
