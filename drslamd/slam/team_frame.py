"""Who is connected to whom, whose frame is the frame of the team, and where everybody starts.

Closures join segments of trajectories into groups. A group lives in the frame of its lowest living
robot: ``w`` is the odometry frame of that robot's first segment in the group. Poses that were
solved before are kept as they were; new ones follow by odometry from the nearest that is known,
and a trajectory that was never placed is placed by its closures.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drslamd.conventions import Chain, Key, Segment
from drslamd.slam import se2
from drslamd.slam.odometry import OdometryNoise
from drslamd.slam.pose_graph import (
    ChainItems,
    Numbering,
    PairItems,
    TeamGraph,
    closures,
    links,
    numbering,
    ranges,
)
from drslamd.slam.problem import Calibration, Priors, Problem, Solution
from drslamd.slam.se2 import Array

YAW_PRIOR_FLOOR = 1e-4
"""rad/m; a prior of zero width would make the system singular."""


@dataclass(frozen=True)
class Trajectory:
    """Solved keyframes of one chain: n (k,) ascending, w_T_k (k, 3)."""

    chain: Chain
    n: Array
    poses: Array


@dataclass(frozen=True)
class TeamEstimate:
    """The last solution, in the frame of segment `frame`."""

    frame: Segment
    trajectories: dict[int, Trajectory]
    covariances: dict[int, Array] = field(default_factory=dict)
    """(3, 3) of each robot's last pose."""
    bias_m: dict[tuple[int, int], float] = field(default_factory=dict)
    scale: dict[int, float] = field(default_factory=dict)
    yaw_rad_per_m: dict[int, float] = field(default_factory=dict)
    cost: float = 0.0
    iterations: int = 0
    converged: bool = True


def groups(graph: TeamGraph) -> list[set[Segment]]:
    """Sets of segments that closures join; a segment without closure is in none."""
    group_of: dict[Segment, set[Segment]] = {}
    for pair in graph.usable():
        for closure in pair.kept():
            a = graph.segment_of(pair.a.robot, closure.a_n)
            b = graph.segment_of(pair.b.robot, closure.b_n)
            if a is None or b is None:
                continue
            joined = group_of.get(a, {a}) | group_of.get(b, {b})
            for segment in joined:
                group_of[segment] = joined
    distinct: list[set[Segment]] = []
    for group in group_of.values():
        if group not in distinct:
            distinct.append(group)
    return distinct


def gauge_segment(group: set[Segment], living: set[int]) -> Segment | None:
    """The first segment of the lowest living robot in the group."""
    return min((s for s in group if s.robot in living), default=None)


def build(
    graph: TeamGraph,
    group: set[Segment],
    frame: Segment,
    shift_us: dict[int, int],
    bias_sigma: float,
    previous: TeamEstimate | None,
    with_ranges: bool,
) -> tuple[Problem, Calibration, list[int], list[tuple[int, int]]]:
    """The problem of one group.

    Args:
        shift_us: clock of each robot minus ours, us.
        bias_sigma: prior of the range bias of a pair, m.
        previous: where to start from.
        with_ranges: use the ranges as edges; otherwise the closures.

    Returns:
        The problem, the calibration to start from, and the robots and pairs that it numbers.
    """
    numbers = numbering(graph, group, shift_us)
    robots = sorted({s.robot for s in group})
    odometry = links(graph, numbers, robots)
    nothing = TeamGraph()
    range_edges, pairs = ranges(graph if with_ranges else nothing, numbers)
    closure_edges = closures(nothing if with_ranges else graph, numbers)
    noises = [graph.chains[robot].noise for robot in robots]
    priors = Priors(
        np.full(len(pairs), bias_sigma),
        np.array([noise.scale for noise in noises]),
        np.array([max(noise.yaw_rad_per_m, YAW_PRIOR_FLOOR) for noise in noises]),
    )
    start = Calibration.zero(priors)
    if previous:
        start = Calibration(
            np.array([previous.bias_m.get(pair, 0.0) for pair in pairs]),
            np.array([previous.scale.get(robot, 0.0) for robot in robots]),
            np.array([previous.yaw_rad_per_m.get(robot, 0.0) for robot in robots]),
        )
    initial = _initial(graph, group, frame, numbers, previous)
    first = next(n for n, s in _rows(graph, frame.robot) if s == frame.segment)
    gauge = numbers.keys.index(Key(frame.robot, frame.epoch, first))
    problem = Problem(numbers.keys, initial, gauge, odometry, closure_edges, range_edges, priors)
    return problem, start, robots, pairs


def _rows(graph: TeamGraph, robot: int) -> list[tuple[int, int]]:
    return [(int(n), int(s)) for n, s in graph.chains[robot].rows[:, :2]]


def _initial(
    graph: TeamGraph,
    group: set[Segment],
    frame: Segment,
    numbers: Numbering,
    previous: TeamEstimate | None,
) -> Array:
    """(n, 3) w_T_k of all numbered poses."""
    placed: dict[Segment, Array] = {}
    known = _in_frame(graph, frame, previous)
    for segment in sorted(group):
        rows = _segment_rows(graph, segment)
        trajectory = known.get(segment.robot)
        if trajectory and trajectory.chain == segment.chain:
            there = np.isin(rows[:, 0], trajectory.n)
            if there.any():
                at = np.searchsorted(trajectory.n, rows[there, 0])
                placed[segment] = _carried(rows, rows[there], trajectory.poses[at])
    if frame not in placed:
        placed = {frame: _segment_rows(graph, frame)[:, 2:]}
    while len(placed) < len(group):
        segment, anchors, poses = _next_to_place(graph, group, placed)
        placed[segment] = _carried(_segment_rows(graph, segment), anchors, poses)
    initial = np.zeros_like(numbers.odometry)
    for segment, poses in placed.items():
        first, last = graph.chains[segment.robot].segments()[segment.segment]
        initial[numbers.number[segment.robot][first : last + 1]] = poses
    return initial


def _segment_rows(graph: TeamGraph, segment: Segment) -> Array:
    items = graph.chains[segment.robot]
    first, last = items.segments()[segment.segment]
    return items.rows[first : last + 1]


def _in_frame(
    graph: TeamGraph, frame: Segment, previous: TeamEstimate | None
) -> dict[int, Trajectory]:
    """The previous trajectories, carried into `frame`."""
    if previous is None:
        return {}
    if previous.frame == frame:
        return previous.trajectories
    origin = previous.trajectories.get(frame.robot)
    if origin is None or origin.chain != frame.chain:
        return {}
    rows = _segment_rows(graph, frame)
    there = np.isin(rows[:, 0], origin.n)
    if not there.any():
        return {}
    new = rows[there][0]
    old = origin.poses[np.searchsorted(origin.n, new[0])]
    w_T_old = se2.compose(new[2:], se2.inverse(old))
    return {
        robot: Trajectory(t.chain, t.n, se2.compose(w_T_old[None], t.poses))
        for robot, t in previous.trajectories.items()
    }


def _carried(rows: Array, anchors: Array, w_T_anchor: Array) -> Array:
    """Poses of all keyframes by odometry from the nearest anchor.

    Args:
        rows: (k, 5) keyframes of one segment.
        anchors: (m, 5) rows that are known, ascending.
        w_T_anchor: (m, 3).
    """
    middle = (anchors[1:, 0] + anchors[:-1, 0]) / 2
    nearest = np.searchsorted(middle, rows[:, 0])
    step = se2.between(anchors[nearest, 2:], rows[:, 2:])
    return se2.compose(w_T_anchor[nearest], step)


def _next_to_place(
    graph: TeamGraph, group: set[Segment], placed: dict[Segment, Array]
) -> tuple[Segment, Array, Array]:
    """A segment that closures join to a placed one: its anchor rows and their poses."""
    found: dict[Segment, dict[int, Array]] = {}
    for pair in graph.usable():
        for closure in pair.kept():
            a = graph.segment_of(pair.a.robot, closure.a_n)
            b = graph.segment_of(pair.b.robot, closure.b_n)
            if a is None or b is None or (a in placed) == (b in placed):
                continue
            a_T_b = np.array(closure.a_T_b)
            if a in placed:
                w_T_b = se2.compose(_pose_at(graph, placed, a, closure.a_n), a_T_b)
                found.setdefault(b, {})[closure.b_n] = w_T_b
            else:
                w_T_b = _pose_at(graph, placed, b, closure.b_n)
                found.setdefault(a, {})[closure.a_n] = se2.compose(w_T_b, se2.inverse(a_T_b))
    candidates = {s: anchors for s, anchors in found.items() if s in group}
    segment = max(candidates, key=lambda s: (len(candidates[s]), s))
    rows = _segment_rows(graph, segment)
    anchors = candidates[segment]
    n = np.array(sorted(anchors))
    at = np.searchsorted(rows[:, 0], n)
    return segment, rows[at], np.array([anchors[int(k)] for k in n])


def _pose_at(graph: TeamGraph, placed: dict[Segment, Array], segment: Segment, n: int) -> Array:
    rows = _segment_rows(graph, segment)
    return np.asarray(placed[segment][np.searchsorted(rows[:, 0], n)])


def last_poses(problem: Problem) -> dict[int, int]:
    """Number of the latest pose of each robot."""
    return {key.robot: k for k, key in enumerate(problem.keys)}


def estimate(
    problem: Problem,
    solution: Solution,
    frame: Segment,
    robots: list[int],
    pairs: list[tuple[int, int]],
) -> TeamEstimate:
    """Sort a solution by robot."""
    trajectories = {}
    robot_of = np.array([key.robot for key in problem.keys])
    n_of = np.array([key.n for key in problem.keys])
    epochs = {key.robot: key.epoch for key in problem.keys}
    for robot in robots:
        mine = np.flatnonzero(robot_of == robot)
        mine = mine[np.argsort(n_of[mine], kind="stable")]
        chain = Chain(robot, epochs[robot])
        trajectories[robot] = Trajectory(chain, n_of[mine], solution.poses[mine])
    c = solution.calibration
    return TeamEstimate(
        frame,
        trajectories,
        {problem.keys[k].robot: v for k, v in solution.covariances.items()},
        dict(zip(pairs, c.bias.tolist(), strict=True)) if len(c.bias) else {},
        dict(zip(robots, c.scale.tolist(), strict=True)),
        dict(zip(robots, c.yaw.tolist(), strict=True)),
        solution.cost,
        solution.iterations,
        solution.converged,
    )


__all__ = [
    "ChainItems", "OdometryNoise", "PairItems", "TeamEstimate", "Trajectory",
    "build", "estimate", "gauge_segment", "groups", "last_poses",
]  # fmt: skip
