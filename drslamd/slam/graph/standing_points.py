"""What stands still and is known by its place alone: parked robots, modules that no robot carries.

Whoever drives past such a thing finds its place in its own odometry (`slam.points`) and tells it as
a closure without a heading. It then belongs to the group of whoever told so, as a point: a few
keyframes in one place, or one, with the ranges to them. It joins nobody to anybody else, because
two who know one point in common still do not know how they are turned against each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import Segment
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.se2 import Array

SAME_PLACE_M = 0.1
"""Keyframes of a robot that turns on the spot."""


def with_points(
    current: Segment, members: set[Segment], graph: PoseGraph
) -> tuple[set[Segment], frozenset[Segment]]:
    """Members and points of the group of a robot that is in `current`.

    Args:
        members: of its group by closures with a heading. Where it is in none, and stands, it is a
            point of others: of those with the lowest frame; and whoever knows a point is a group.
    """
    joints = [joint for joint in team_frame.joints(graph) if joint.tells_place_only]
    if not joints:
        return members, frozenset()
    groups = team_frame.groups(graph)
    whole = {segment for group in groups for segment in group}
    joints = [joint for joint in joints if joint.b not in whole]
    if not members:
        knowing = {joint.a for joint in joints if joint.b == current}
        alone = [{segment} for segment in knowing - whole]
        known = [group for group in (*groups, *alone) if group & knowing]
        members = min(known, key=min, default={current})
        if members == {current} and all(joint.a != current for joint in joints):
            return set(), frozenset()
    found = (joint.b for joint in joints if joint.a in members and joint.b not in members)
    return members, frozenset(found)


def where_it_stands(graph: PoseGraph, point: Segment) -> NDArray[np.bool_]:
    """(k,) which keyframes of its chain a point is: where it was last said to stand."""
    keyframes = graph.view.chains[point.robot].keyframes
    out = np.zeros(len(keyframes), dtype=bool)
    said = [
        joint.closures.b_n.max()
        for joint in team_frame.joints(graph)
        if joint.b == point and joint.tells_place_only
    ]
    if not said:
        return out
    (at,), (there,) = keyframes.find(np.array([max(said)]))
    if not there:
        return out
    away = np.hypot(*(keyframes.poses[:, :2] - keyframes.poses[at, :2]).T)
    is_there = (away < SAME_PLACE_M) & (keyframes.segment == point.segment)
    leaves = np.flatnonzero(~is_there)
    first = leaves[leaves < at].max(initial=-1) + 1
    end = leaves[leaves > at].min(initial=len(out))
    out[first:end] = True
    return out


def without_headings(joint: Array, is_point: NDArray[np.bool_]) -> Array:
    """The covariance (3 k, 3 k) of poses, nothing being claimed of the headings of points (k,)."""
    out: Array = joint.copy()
    at = 3 * np.flatnonzero(is_point[: len(joint) // 3]) + 2
    out[at] = out[:, at] = 0.0
    out[at, at] = NO_HEADING
    return out
