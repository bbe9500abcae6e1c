"""Who is connected to whom, whose frame is the frame of the team, and where everybody starts.

Closures join segments of trajectories into groups. A group lives in the frame of its lowest living
robot: ``w`` is the odometry frame of that robot's first segment in the group. Poses that were
solved before are kept as they were; new ones follow by odometry from the nearest that is known,
and a trajectory that was never placed is placed by its closures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.conventions import Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class Group:
    """A connected group.

    Attributes:
        members: its segments; frame: the one whose odometry frame is the team's.
        shift_us: clock of each robot minus ours, us.
    """

    members: set[Segment]
    frame: Segment
    shift_us: dict[int, int]


def groups(graph: PoseGraph) -> list[set[Segment]]:
    """Sets of segments that closures join; a segment without closure is in none."""
    group_of: dict[Segment, set[Segment]] = {}
    for a, b in dict.fromkeys((a, b) for _, a, b in joints(graph)):
        joined = group_of.get(a, {a}) | group_of.get(b, {b})
        for segment in joined:
            group_of[segment] = joined
    distinct: list[set[Segment]] = []
    for group in group_of.values():
        if group not in distinct:
            distinct.append(group)
    return distinct


def joints(graph: PoseGraph) -> list[tuple[ClosureMeasurement, Segment, Segment]]:
    """Kept closures whose both keyframes are held, with the segments that they join."""
    out = []
    for pair in graph.usable():
        kept = pair.kept_closures()
        a = _segments(graph, pair, 0, [c.a_n for c in kept])
        b = _segments(graph, pair, 1, [c.b_n for c in kept])
        for closure, one, other in zip(kept, a, b, strict=True):
            if one is not None and other is not None:
                out.append((closure, one, other))
    return out


def _segments(graph: PoseGraph, pair: PairData, end: int, n: list[int]) -> list[Segment | None]:
    chain = (pair.a, pair.b)[end]
    keyframes = graph.chains[chain.robot].keyframes
    at, there = keyframes.find(np.array(n, dtype=float))
    numbers = keyframes.segment[at] if len(keyframes) else np.zeros(len(n))
    return [
        Segment(*chain, int(number)) if held else None
        for number, held in zip(numbers, there, strict=True)
    ]


def gauge_segment(group: set[Segment], living: set[int]) -> Segment | None:
    """The first segment of the lowest living robot in the group."""
    return min((s for s in group if s.robot in living), default=None)


# ---- where the optimiser starts ----------------------------------------------------------------


def placed(graph: PoseGraph, group: Group, previous: TeamEstimate | None) -> dict[Segment, Array]:
    """w_T_k (k, 3) of all keyframes of each member."""
    out: dict[Segment, Array] = {}
    known = _in_frame(graph, group.frame, previous)
    for segment in sorted(group.members):
        keyframes = graph.segment(segment)
        trajectory = known.get(segment.robot)
        if trajectory is not None and trajectory.chain == segment.chain:
            there = np.isin(keyframes.n, trajectory.n)
            if there.any():
                at = np.searchsorted(trajectory.n, keyframes.n[there])
                out[segment] = by_odometry(keyframes, keyframes.chosen(there), trajectory.poses[at])
    if group.frame not in out:
        out = {group.frame: graph.segment(group.frame).poses}
    while len(out) < len(group.members):
        segment, anchors, poses = _next_to_place(graph, group.members, out)
        out[segment] = by_odometry(graph.segment(segment), anchors, poses)
    return out


def _in_frame(
    graph: PoseGraph, frame: Segment, previous: TeamEstimate | None
) -> dict[int, Trajectory]:
    """The previous trajectories, carried into `frame`; nothing when they do not know it."""
    if previous is None:
        return {}
    if previous.frame == frame:
        return previous.trajectories
    old = previous.trajectories.get(frame.robot)
    if old is None or old.chain != frame.chain:
        return {}
    keyframes = graph.segment(frame)
    known = keyframes.chosen(np.isin(keyframes.n, old.n))
    if not len(known):
        return {}
    before = old.poses[np.searchsorted(old.n, known.n[0])]
    w_T_old = se2.compose(known.poses[0], se2.inverse(before))
    return {
        robot: Trajectory(t.chain, t.n, se2.compose(w_T_old[None], t.poses))
        for robot, t in previous.trajectories.items()
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
    graph: PoseGraph, members: set[Segment], done: dict[Segment, Array]
) -> tuple[Segment, KeyframeTable, Array]:
    """The segment that most closures join to what is placed: its anchors and their poses."""

    def pose(segment: Segment, n: int) -> Array:
        return np.asarray(done[segment][np.searchsorted(graph.segment(segment).n, n)])

    found: dict[Segment, dict[int, Array]] = {}
    for closure, a, b in joints(graph):
        a_T_b = np.array(closure.a_T_b)
        if a in done and b in members and b not in done:
            w_T_b = se2.compose(pose(a, closure.a_n), a_T_b)
            found.setdefault(b, {})[closure.b_n] = w_T_b
        elif b in done and a in members and a not in done:
            w_T_a = se2.compose(pose(b, closure.b_n), se2.inverse(a_T_b))
            found.setdefault(a, {})[closure.a_n] = w_T_a
    segment = max(found, key=lambda s: (len(found[s]), s))
    keyframes, anchors = graph.segment(segment), found[segment]
    n = np.array(sorted(anchors))
    at = np.searchsorted(keyframes.n, n)
    return segment, keyframes.chosen(at), np.array([anchors[int(k)] for k in n])
