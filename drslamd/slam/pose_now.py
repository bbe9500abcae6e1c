"""Where a robot is now: its last solved pose, carried on by odometry.

Of a point nobody knows the heading. When it begins to drive, odometry says how far it comes and not
where to; of a robot that is one because its wheels tell the mirror image of its way, the image says
that as well.
"""

from __future__ import annotations

import numpy as np

from drslamd.conventions import GRID_US
from drslamd.slam import se2
from drslamd.slam.graph import standing_points
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate
from drslamd.slam.odometry.noise import OdometryNoise, covariance_between, growth
from drslamd.slam.odometry.track import Track
from drslamd.slam.se2 import Array


def pose_now(
    estimate: TeamEstimate, robot: int, track: Track, noise: OdometryNoise
) -> PoseNow | None:
    """The pose at the end of a robot's track; None when no odometry leads there.

    Args:
        track, noise: of this robot's odometry.
    """
    solved, known = estimate.trajectories.get(robot), estimate.told(robot)
    if solved is None or known is None or not len(solved.n):
        return None
    last, now = int(solved.n[-1]), track.end - 1
    if last > now or not track.covers(last, now):
        return None
    way = estimate.correction(robot).path(track.poses[last - track.n0 : now - track.n0 + 1])
    step = se2.between(way[:1], way)
    is_mirrored = robot in estimate.mirrored
    if robot in estimate.points and not is_mirrored:
        aside = float(np.hypot(*step[-1, :2]))
        wide = known + np.diag([aside**2, aside**2, 0.0])
        return PoseNow(now * GRID_US, solved.poses[-1].copy(), wide)
    pose = se2.compose(solved.poses[-1], step[-1])
    level, left = estimate.odometry_level.get(robot, 1.0), estimate.noise_left(robot, noise)
    if is_mirrored:
        known = known.copy()
        known[2, 2] = estimate.mirrored[robot]
    covariance = carried(known, float(solved.poses[-1, 2]), step, left, level, last)
    if is_mirrored:
        covariance = standing_points.without_headings(covariance, np.array([True]))
    return PoseNow(now * GRID_US, np.append(pose[:2], se2.wrap(pose[2])), covariance)


def carried(
    covariance: Array,
    heading: float,
    step: Array,
    noise: OdometryNoise,
    level: float,
    first: int | None = None,
) -> Array:
    """(3, 3) covariance of x, y, theta in w at the end of a way.

    Args:
        covariance: (3, 3) at its start; heading: there, in w, rad.
        step: (k, 3) the way, from its start.
        level: how many times the sigma of odometry is what is configured.
        first: sample of the track where it begins, if it has all samples after it; else no gyro is
            believed.
    """
    forward = np.eye(3)
    forward[:2, 2] = se2.rotate(heading, _lever(step)[:2, 2])
    moved = forward @ covariance @ forward.T
    return np.asarray(moved + noise_of_way(heading, step, noise, level, first))


def noise_of_way(
    heading: float, step: Array, noise: OdometryNoise, level: float, first: int | None = None
) -> Array:
    """(3, 3) what a way adds to the covariance of x, y, theta in w, see `carried`."""
    lever, gyro = _lever(step), noise.gyro
    seconds = None
    if gyro is not None and first is not None:
        seconds = gyro.seconds(first + np.arange(len(step)), step)
    added = lever @ covariance_between(noise, step, growth(step, seconds), 0, -1) @ lever.T
    return np.asarray(level**2 * se2.turned(added, heading))


def _lever(step: Array) -> Array:
    """(3, 3) from a twist about the start of a way to one about its end."""
    lever = np.eye(3)
    lever[:2, 2] = -step[-1, 1], step[-1, 0]
    return lever
