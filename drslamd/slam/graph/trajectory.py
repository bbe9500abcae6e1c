"""A whole trajectory out of the solved keyframes: the 10 Hz track bent to go through them."""

from __future__ import annotations

import numpy as np

from drslamd.slam import se2
from drslamd.slam.graph.estimate import Trajectory
from drslamd.slam.odometry.track import Track
from drslamd.slam.se2 import Array


def deform_track(track: Track, solved: Trajectory) -> tuple[Array, Array]:
    """The samples of our own track in the frame of the team.

    Between two keyframes a sample follows by odometry from both; the two answers are blended by
    how near each keyframe is. Before the first and after the last only one is there. Samples in
    holes are left out, and so is a segment without any solved keyframe.

    Returns:
        n (k,) grid samples and w_T_a (k, 3), angles wrapped.
    """
    inside = (solved.n >= track.n0) & (solved.n < track.end)
    knots, w_T_knot = solved.n[inside].astype(int), solved.poses[inside]
    odometry = track.poses
    n = np.arange(track.n0, track.end)
    held = np.isfinite(odometry[:, 0])
    # every hole begins a new segment; knots and samples of one segment belong together
    segment = np.cumsum(np.concatenate([[0], (held[1:] & ~held[:-1]).astype(int)]))
    keep = held & np.isin(segment, segment[knots - track.n0])
    n = n[keep]
    if not len(n) or not len(knots):
        return np.zeros(0), np.zeros((0, 3))
    right = np.clip(np.searchsorted(knots, n), 0, len(knots) - 1)
    left = np.clip(np.searchsorted(knots, n, side="right") - 1, 0, len(knots) - 1)
    mine = segment[n - track.n0]
    left = np.where(segment[knots[left] - track.n0] == mine, left, right)
    right = np.where(segment[knots[right] - track.n0] == mine, right, left)
    here = odometry[n - track.n0]
    by_left, by_right = (
        se2.compose(w_T_knot[k], se2.between(odometry[knots[k] - track.n0], here))
        for k in (left, right)
    )
    gap = np.maximum(knots[right] - knots[left], 1)
    share = np.clip((n - knots[left]) / gap, 0, 1)[:, None]
    difference = by_right - by_left
    difference[:, 2] = se2.wrap(difference[:, 2])
    poses = by_left + share * difference
    poses[:, 2] = se2.wrap(poses[:, 2])
    return n.astype(float), poses
