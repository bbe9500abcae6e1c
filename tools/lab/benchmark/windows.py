"""Windows of module 1: two robots that wander at 0.5 m/s, ranges at 10 Hz with noise of 0.1 m."""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.window import Window
from lab.recordings.recording import Array

SPEED_M_S, HZ, SIGMA_M = 0.5, 10, 0.1
NEAREST_M, FARTHEST_M = 2.0, 15.0
ODOMETRY = OdometryNoise(0.01, 0.003, 0.01, 0.01)
NOISE = PairNoise(RangeNoise(SIGMA_M, 0.01), ODOMETRY, ODOMETRY)


def window(rng: np.random.Generator, tau: int, straight: bool = False) -> tuple[Window, Array]:
    """One window of tau ranges, and the true pose of b in a at its end.

    Args:
        straight: both robots hardly turn.
    """
    while True:
        bend = 0.02 if straight else 0.3
        paths = [_path(rng, tau, bend) for _ in range(2)]
        distance = rng.uniform(NEAREST_M, FARTHEST_M)
        phi, theta = rng.uniform(-np.pi, np.pi, 2)
        a_T_b = np.array([distance * np.cos(phi), distance * np.sin(phi), theta])
        b_in_a = se2.transform(a_T_b, paths[1][:, :2])
        ranges = np.hypot(*(b_in_a - paths[0][:, :2]).T)
        if ranges.min() >= NEAREST_M and ranges.max() <= FARTHEST_M:
            break
    noisy = ranges + rng.normal(0, SIGMA_M, tau)
    t = (np.arange(tau) - tau + 1) / HZ
    return Window(t, noisy, paths[0], paths[1], np.zeros(2), np.zeros(2)), a_T_b


def _path(rng: np.random.Generator, tau: int, bend: float) -> Array:
    """(tau, 3) poses in the frame of the last one."""
    rates = np.cumsum(rng.normal(0, bend / 3, tau)) * 0.3 + rng.normal(0, bend)
    heading = np.cumsum(rates) / HZ
    steps = SPEED_M_S / HZ * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    poses = np.column_stack([np.cumsum(steps, axis=0), heading])
    return np.asarray(se2.between(poses[-1:], poses))
