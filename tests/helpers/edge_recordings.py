"""Recordings of relative poses, made up."""

from __future__ import annotations

import math

import numpy as np
from lab.recordings.recording import EdgeRecording, Trail
from lab.score import metrics

SIGMAS = (0.1, math.radians(2.0))


def edged() -> EdgeRecording:
    """Two robots that drive circles, and the exact pose of one in the other every second."""
    t = np.arange(0, 120, 0.1)
    trails = {}
    for robot, (radius, rate) in enumerate(((2.0, 0.1), (3.0, -0.08))):
        yaw = rate * t
        place = np.sign(rate) * radius * np.column_stack([np.sin(yaw), 1 - np.cos(yaw)])
        truth = np.column_stack([place + [4.0 * robot, 0], yaw])
        trails[robot] = Trail(robot, t, metrics.relative(truth[:1], truth), truth)
        trails[robot].odometry[:, 2] = yaw
    when = t[5::10]
    poses = [metrics.at_times(trail.t, trail.truth, when) for trail in trails.values()]
    rng = np.random.default_rng(0)
    seen = metrics.relative(*poses) + rng.normal(size=(len(when), 3)) * [0.05, 0.05, 0.01]
    edges = np.column_stack([when, np.zeros(len(when)), np.ones(len(when)), seen])
    return EdgeRecording("made", trails, edges, SIGMAS)
