"""Who is connected to whom, whose frame is the frame of the team, and where everybody starts.

Closures join segments of trajectories into groups; what stands, and of which only the place is
known, belongs to one as a point (`standing_points`). A group lives in the frame of its lowest
living robot: ``w`` is the odometry frame of that robot's first segment in the group. Poses that
were solved before are kept as they were; new ones follow by odometry from the nearest that is
known, and a trajectory that was never placed is placed by its closures.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.graph.thinning.joints import Joint
from drslamd.slam.odometry.correction import MIRROR, Correction
from drslamd.slam.se2 import Array, Index

NO_CORRECTIONS: Mapping[int, Correction] = MappingProxyType({})
"""Everybody is mounted as configured."""


@dataclass(frozen=True)
class Group:
    """A connected group.

    Attributes:
        members: its segments; frame: the one whose odometry frame is the team's.
        points: what stands, and has a place in it and no heading.
        mirrored: whose odometry is the mirror image of its way, see `mirror_images`.
    """

    members: set[Segment]
    frame: Segment
    points: frozenset[Segment] = frozenset()
    mirrored: frozenset[Segment] = frozenset()

    @property
    def everything(self) -> set[Segment]:
        """All of these."""
        return self.members | self.points | self.mirrored

    @property
    def places_only(self) -> frozenset[int]:
        """Robots and modules whose heading is not known."""
        standing = {segment.robot for segment in self.points}
        whole = {segment.robot for segment in self.members}
        return frozenset(standing - whole) | self.mirrored_robots

    @property
    def mirrored_robots(self) -> frozenset[int]:
        return frozenset(segment.robot for segment in self.mirrored)


def groups(graph: PoseGraph) -> list[set[Segment]]:
    """Sets of segments that closures join; a segment without closure is in none."""
    group_of: dict[Segment, set[Segment]] = {}
    for joint in joints(graph):
        if joint.tells_place_only or joint.is_mirrored:
            continue
        one, other = group_of.get(joint.a, {joint.a}), group_of.get(joint.b, {joint.b})
        if one is other:
            continue
        joined = one | other
        for segment in joined:
            group_of[segment] = joined
    distinct: list[set[Segment]] = []
    for group in group_of.values():
        if group not in distinct:
            distinct.append(group)
    return distinct


def group_of(current: Segment, graph: PoseGraph, looks_back: bool) -> set[Segment]:
    """The group of a robot that is in `current`, empty where it is in none.

    Args:
        looks_back: as long as nothing joins that segment, the group of what it drove before.
    """
    found = groups(graph)
    mine = {s for group in found for s in group if s.chain == current.chain and s <= current}
    last = max(mine, default=None) if looks_back else current
    return next((group for group in found if last in group), set())


def group_with(chains: Set[Chain], graph: PoseGraph) -> set[Segment]:
    """The first group that has one of these starts in it, empty where there is none."""
    found = [group for group in groups(graph) if any(s.chain in chains for s in group)]
    return min(found, key=min, default=set())


def joints(graph: PoseGraph) -> list[Joint]:
    """Segments that are joined by closures whose both keyframes are held."""
    return graph.view.joints


def gauge_segment(group: set[Segment], living: set[int]) -> Segment | None:
    """The first segment of the lowest living robot in the group."""
    return min((s for s in group if s.robot in living), default=None)


# where the optimiser starts


def placed(
    graph: PoseGraph,
    group: Group,
    previous: TeamEstimate | None,
    corrections: Mapping[int, Correction] = NO_CORRECTIONS,
) -> dict[Segment, Array]:
    """w_T_k (k, 3) of all keyframes of each member.

    Args:
        corrections: of the odometry of robots that are not mounted as configured.
    """
    out: dict[Segment, Array] = {}
    known = _in_frame(graph, group.frame, previous)
    for segment in sorted(group.everything):
        keyframes = _corrected(graph, segment, corrections)
        trajectory = known.get(segment.robot)
        if trajectory is not None and trajectory.chain == segment.chain:
            there = np.isin(keyframes.n, trajectory.n)
            if there.any():
                at = np.searchsorted(trajectory.n, keyframes.n[there])
                out[segment] = by_odometry(keyframes, keyframes.chosen(there), trajectory.poses[at])
    if group.frame not in out:
        out = {group.frame: _corrected(graph, group.frame, corrections).poses}
    while len(out) < len(group.everything):
        segment, n, poses = _next_to_place(graph, group, out)
        keyframes = _corrected(graph, segment, corrections)
        anchors = keyframes.chosen(np.searchsorted(keyframes.n, n))
        out[segment] = by_odometry(keyframes, anchors, poses)
    return out


def _corrected(
    graph: PoseGraph, segment: Segment, corrections: Mapping[int, Correction]
) -> KeyframeTable:
    """The keyframes of a segment where odometry should have had them."""
    keyframes = graph.view.segment(segment)
    correction = corrections.get(segment.robot)
    if correction is None:
        return keyframes
    rows = keyframes.rows.copy()
    rows[:, 2:] = correction.path(keyframes.poses)
    return KeyframeTable(rows)


def _in_frame(
    graph: PoseGraph, frame: Segment, previous: TeamEstimate | None
) -> dict[int, Trajectory]:
    """The previous trajectories, carried into `frame`; nothing when they do not know it."""
    if previous is None:
        return {}
    if previous.frame == frame:
        return previous.paths
    old = previous.trajectories.get(frame.robot)
    if old is None or old.chain != frame.chain:
        return {}
    keyframes = graph.view.segment(frame)
    known = keyframes.chosen(np.isin(keyframes.n, old.n))
    if not len(known):
        return {}
    before = old.poses[np.searchsorted(old.n, known.n[0])]
    w_T_old = se2.compose(known.poses[0], se2.inverse(before))
    return {
        robot: Trajectory(t.chain, t.n, se2.compose(w_T_old[None], t.poses))
        for robot, t in previous.paths.items()
    }


def by_odometry(keyframes: KeyframeTable, anchors: KeyframeTable, w_T_anchor: Array) -> Array:
    """(k, 3) poses of all keyframes by odometry from the nearest anchor.

    Args:
        keyframes: k of one segment.
        anchors: those m of them that are known.
        w_T_anchor: (m, 3).
    """
    middle = (anchors.n[1:] + anchors.n[:-1]) / 2
    nearest = np.searchsorted(middle, keyframes.n)
    step = se2.between(anchors.poses[nearest], keyframes.poses)
    return se2.compose(w_T_anchor[nearest], step)


def _next_to_place(
    graph: PoseGraph, group: Group, done: dict[Segment, Array]
) -> tuple[Segment, Index, Array]:
    """The segment that most closures join to what is placed: its anchors (m,), their poses."""

    def pose(segment: Segment, n: int) -> Array:
        return np.asarray(done[segment][np.searchsorted(graph.view.segment(segment).n, n)])

    found: dict[Segment, dict[int, Array]] = {}
    everything = group.everything
    for joint in joints(graph):
        a, b = joint.a in done, joint.b in done
        ends = {joint.a, joint.b}
        if a == b or not ends <= everything or joint.is_mirrored is not bool(ends & group.mirrored):
            continue
        new = found.setdefault(joint.b if a else joint.a, {})
        # (what was found with b turning the other way is the mirror image where a does)
        seen = joint.closures.a_T_b * (MIRROR if joint.a in group.mirrored else 1.0)
        for a_n, b_n, a_T_b in zip(joint.closures.a_n, joint.closures.b_n, seen, strict=True):
            if a:
                new[int(b_n)] = se2.compose(pose(joint.a, a_n), a_T_b)
            else:
                new[int(a_n)] = se2.compose(pose(joint.b, b_n), se2.inverse(a_T_b))
    segment = max(found, key=lambda s: (len(found[s]), s))
    anchors = found[segment]
    n = np.array(sorted(anchors))
    return segment, n, np.array([anchors[int(k)] for k in n])
