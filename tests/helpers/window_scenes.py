"""Single windows for the tests of module 1, whose parts take several at once."""

from __future__ import annotations

import numpy as np
from slam_scenes import Array

from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose import coarse_search
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.range_fit import RangeFit
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.relative_pose.window_stack import Groups, WindowStack


def fit_of(window: Window) -> RangeFit:
    return RangeFit.of(WindowStack.of([window]))


def fit_between(a: Array, b: Array, ranges: Array) -> RangeFit:
    """Of points (n, 2)."""
    return RangeFit(_complex(a), _complex(b), ranges[None])


def of_one(count: int) -> Groups:
    """So many rows of the only window."""
    return Groups(np.zeros(count, dtype=np.int64))


def noise_of(window: Window, ranges: RangeNoise, a: OdometryNoise, b: OdometryNoise) -> WindowNoise:
    return WindowNoise(WindowStack.of([window]), [PairNoise(ranges, a, b)])


def seeds_of(a: Array, b: Array, ranges: Array, rho: float, delta: float, most: int) -> Array:
    """Of points (n, 2)."""
    radius = np.array([rho])
    poses, of = coarse_search.seeds(_complex(a), _complex(b), ranges[None], radius, delta, most)
    assert not of.any()
    return poses


def _complex(points: Array) -> Array:
    return np.asarray((points @ [1, 1j])[None])
