"""Where a robot is by its placing alone.

A placing knows all ranges of some seconds; the logs have one a second, so module 3 knows as much
only when the robot has driven on for a while. Until then this is the better pose. What peers are
wrong by is in it: a placing believes them, and module 3 says how well it knows them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_US, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.odometry.track import Track
from drslamd.slam.pose_now import carried
from drslamd.slam.relocation.placing import Placed
from drslamd.slam.relocation.question import Found
from drslamd.slam.relocation.sightings import Sightings
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class PlacedPose:
    """An answer for a robot: its pose at sample n of the track, `middle` (3,) in the frame of the
    team with its covariance (3, 3).

    Attributes:
        found: what was found, and in which solution.
    """

    found: Found
    robot: int
    n: int
    middle: Array
    covariance: Array

    @property
    def frame(self) -> Segment:
        return self.found.estimate.frame

    def now(self, track: Track, noise: OdometryNoise) -> PoseNow | None:
        """Carried on to the end of the track; None where no odometry leads there.

        Args:
            noise: of this odometry.
        """
        if not len(track) or track.segment_start != self.found.segment_start or self.n < track.n0:
            return None
        estimate, end = self.found.estimate, track.end - 1
        way = estimate.correction(self.robot).path(track.poses[self.n - track.n0 :])
        step = se2.between(way[:1], way)
        pose = se2.compose(self.middle, step[-1])
        left = estimate.noise_left(self.robot, noise)
        level, heading = estimate.odometry_level.get(self.robot, 1.0), float(self.middle[2])
        covariance = carried(self.covariance, heading, step, left, level, self.n)
        return PoseNow(end * GRID_US, np.append(pose[:2], se2.wrap(pose[2])), covariance)


def placed_pose(found: Found, placed: Placed, track: Track, robot: int) -> PlacedPose | None:
    """None where nobody says how well peers are known, or the odometry has ended meanwhile."""
    start, seen = found.segment_start, found.seen
    by_peers = covariance_by_peers(placed.by_peers, seen, found.estimate)
    if by_peers is None or track.segment_start != start or start < track.n0:
        return None
    n = min(max(round(float(seen.utime.mean()) / GRID_US), start), track.end - 1)
    path = found.estimate.correction(robot).path(track.poses[start - track.n0 : n + 1 - track.n0])
    middle = se2.compose(placed.w_T_o, path[-1])
    x, y = (middle[:2] - se2.transform(placed.w_T_o, placed.at)).tolist()
    lever = np.eye(3)
    lever[:2, 2] = -y, x
    covariance = lever @ (placed.covariance + by_peers) @ lever.T
    return PlacedPose(found, robot, n, middle, covariance)


def covariance_by_peers(moved: Array, seen: Sightings, estimate: TeamEstimate) -> Array | None:
    """(3, 3) what a placing is as wrong by as peers are, all of them together; None where nothing
    is claimed of one.

    Args:
        moved: see `Placed.by_peers`.
    """
    peers = sorted(set(seen.peer.tolist()))
    if any(estimate.covariance(peer) is None for peer in peers):
        return None
    columns = np.concatenate([estimate.rows_of(peer) for peer in peers])
    gain = np.zeros((3, len(columns)))
    for k, peer in enumerate(peers):
        mine, last = seen.peer == peer, estimate.trajectories[peer].poses[-1]
        x, y = (seen.place[mine] - last[:2]).T
        by_x, by_y = np.moveaxis(moved[:, mine], -1, 0)
        # who is turned about its last solved pose is elsewhere by as much as it drove since
        parts = by_x.sum(axis=1), by_y.sum(axis=1), (by_y * x - by_x * y).sum(axis=1)
        gain[:, 3 * k : 3 * k + 3] = np.stack(parts, axis=-1)
    return np.asarray(gain @ estimate.joint[np.ix_(columns, columns)] @ gain.T)
