"""The factors of a connected group: what the graph holds between poses numbered by time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_US, Segment
from drslamd.slam import se2
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import RANGE_COLUMNS, RangeTable
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.odometry.noise import link_covariance
from drslamd.slam.optimizer.problem import BetweenFactors, OdometryFactors, RangeFactors
from drslamd.slam.optimizer.vertex_cover import vertex_cover
from drslamd.slam.se2 import Array, Index

LINK_FLOOR_M = 5e-4
"""No wheel is better than this between two keyframes, and a robot that stands may be pushed."""
LINK_FLOOR_RAD = 5e-4
"""Likewise of angles."""
SAME_TIME = 20
"""Samples: the keyframes of one measurement are at most 1.5 s from it (`pair_end.NEAR_US`)."""
FAR = 128
"""So many poses lie between the ends of a factor that joins different times."""
STANDING = 64
"""So many poses may have such factors: those of robots that stood while the others drove on. What
is beyond is nonsense, and would make the team's problem too wide to be solved."""


@dataclass(frozen=True)
class Numbering:
    """Places of the keyframes of some segments in one list, ordered by time.

    Attributes:
        robot, n: (k,) whose keyframe each one is, and which.
        place: for each robot, the place of every row of its chain, -1 where it is left out.
    """

    robot: Index
    n: Index
    place: dict[int, Index]

    def of_robot(self, robot: int) -> Index:
        """Places of all numbered keyframes of a robot, in the order of time."""
        place = self.place[robot]
        return place[place >= 0]

    def of(self, data: ChainData, n: Array) -> Index:
        """Places of keyframes n (m,) of one chain, -1 where one is not there."""
        place = self.place.get(data.chain.robot)
        if place is None or not len(place):
            return np.full(len(n), -1)
        at, there = data.keyframes.find(n)
        return np.where(there, place[at], -1)


def numbering(graph: PoseGraph, members: set[Segment], shift_us: dict[int, int]) -> Numbering:
    """Number all keyframes of `members`.

    Args:
        shift_us: clock of each robot minus ours, us, as far as it is known; only the order depends
            on it.
    """
    shifts = clock_shifts(graph, {s.robot for s in members}, shift_us)
    place, when, robots, keyframes = {}, [], [], []
    for robot, shift in sorted(shifts.items()):
        data = graph.chains[robot]
        wanted = [s.segment for s in members if s.chain == data.chain]
        inside = np.isin(data.keyframes.segment, wanted)
        place[robot] = np.where(inside, 0, -1)
        keyframes.append(data.keyframes.n[inside])
        when.append(keyframes[-1] - shift)
        robots.append(np.full(len(keyframes[-1]), robot))
    robot_of, n_of = np.concatenate(robots), np.concatenate(keyframes)
    order = np.lexsort((robot_of, np.concatenate(when)))
    robot_of, n_of = robot_of[order], n_of[order]
    for robot, places in place.items():
        places[places == 0] = np.flatnonzero(robot_of == robot)
    return Numbering(robot_of, n_of, place)


def initial_poses(
    graph: PoseGraph, group: Group, previous: TeamEstimate | None, places: Numbering
) -> Array:
    """(k, 3) w_T_k from which a solver may start."""
    initial = np.zeros((len(places.n), 3))
    for segment, poses in team_frame.placed(graph, group, previous).items():
        rows = graph.chains[segment.robot].keyframes.of_segment(segment.segment)
        initial[places.place[segment.robot][rows]] = poses
    return initial


def gauge_place(graph: PoseGraph, group: Group, places: Numbering) -> int:
    """The first pose of the segment whose odometry frame is the team's."""
    first = graph.segment(group.frame).n[:1]
    return int(places.of(graph.chains[group.frame.robot], first)[0])


def clock_shifts(graph: PoseGraph, robots: set[int], shift_us: dict[int, int]) -> dict[int, float]:
    """Clocks of robots minus ours in grid samples.

    We know the clocks of those whom we hear. The graph may hold others, and some that left long
    ago: their clocks follow from what they measured with the rest, because the keyframes of one
    measurement are of one time unless a robot stood still.
    """
    shifts = {robot: shift_us[robot] / GRID_US for robot in robots if robot in shift_us}
    shifts = shifts or {min(robots): 0.0}
    pairs = [p for p in graph.usable() if {p.a.robot, p.b.robot} <= robots]
    while len(shifts) < len(robots):
        reached = [p for p in pairs if (p.a.robot in shifts) != (p.b.robot in shifts)]
        for pair in reached:
            closed = [c.b_n - c.a_n for c in pair.kept_closures()]
            ahead = _mode(np.concatenate([pair.ranges.b_n - pair.ranges.a_n, closed]))
            if pair.a.robot in shifts:
                shifts.setdefault(pair.b.robot, shifts[pair.a.robot] + ahead)
            else:
                shifts.setdefault(pair.a.robot, shifts[pair.b.robot] - ahead)
        if not reached:
            shifts |= dict.fromkeys(robots - set(shifts), 0.0)
    return shifts


def _mode(values: Array) -> float:
    """Where most of the values are, to some seconds of samples; 0 of none."""
    if not len(values):
        return 0.0
    bins, counts = np.unique(np.floor(values / SAME_TIME), return_counts=True)
    inside = np.floor(values / SAME_TIME) == bins[np.argmax(counts)]
    return float(np.median(values[inside]))


def odometry(graph: PoseGraph, numbers: Numbering, robots: list[int]) -> OdometryFactors:
    """Odometry between neighbouring keyframes of each segment, its scale and yaw rate left in."""
    parts: list[tuple[Array, ...]] = []
    for index, robot in enumerate(robots):
        edges = chain_links(graph.chains[robot], calibrated=True)
        place = numbers.place[robot]
        i, j = place[edges.i], place[edges.j]
        path = np.hypot(edges.measured[:, 0], edges.measured[:, 1])
        used = (i >= 0) & (j >= 0)
        rows = (i, j, edges.measured, edges.covariance, np.full(len(i), index), path)
        parts.append(tuple(row[used] for row in rows))
    return OdometryFactors(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def chain_links(data: ChainData, calibrated: bool) -> BetweenFactors:
    """Odometry between neighbouring rows of one chain, across no break.

    Args:
        calibrated: scale and constant yaw rate are unknowns of the optimiser, so the covariance
            holds only what is random; otherwise they are part of it.
    """
    keyframes, noise = data.keyframes, data.model.noise
    i = np.flatnonzero(keyframes.segment[1:] == keyframes.segment[:-1])
    if calibrated:
        noise = noise.random_part()
    measured = se2.between(keyframes.poses[i], keyframes.poses[i + 1])
    # a left twist at pose i moves the end of the link by its turn times the lever
    lever = np.tile(np.eye(3), (len(i), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -measured[:, 1], measured[:, 0]
    twist = link_covariance(noise, measured)
    floor = np.diag([LINK_FLOOR_M**2, LINK_FLOOR_M**2, LINK_FLOOR_RAD**2])
    return BetweenFactors(i, i + 1, measured, lever @ twist @ np.swapaxes(lever, 1, 2) + floor)


def closures(graph: PoseGraph, numbers: Numbering) -> BetweenFactors:
    """All kept closures between numbered poses."""
    ends, upper = [np.zeros((2, 0), dtype=np.int64)], [np.zeros((0, 9))]
    for pair in graph.usable():
        kept = pair.kept_closures()
        ends_n = np.array([(c.a_n, c.b_n) for c in kept]).reshape(-1, 2)
        both = _ends(graph, numbers, pair, ends_n[:, 0], ends_n[:, 1])
        used = (both >= 0).all(axis=0)
        ends.append(both[:, used])
        upper.append(np.array([(*c.a_T_b, *c.covariance) for c in kept]).reshape(-1, 9)[used])
    i, j = np.concatenate(ends, axis=1)
    values = np.concatenate(upper)
    return BetweenFactors(i, j, values[:, :3], se2.unpacked(values[:, 3:]))


def ranges(graph: PoseGraph, numbers: Numbering) -> tuple[RangeFactors, list[tuple[int, int]]]:
    """All ranges between numbered poses, and the pairs of robots that `pair` numbers."""
    found: list[tuple[tuple[int, int], Index, Array]] = []
    for pair in graph.usable():
        table = pair.ranges
        ends = _ends(graph, numbers, pair, table.a_n, table.b_n)
        used = (ends >= 0).all(axis=0)
        if used.any():
            found.append((_name(pair), ends[:, used], table.rows[used]))
    names = sorted({name for name, _, _ in found})
    i, j = np.concatenate([np.zeros((2, 0), dtype=np.int64), *(e for _, e, _ in found)], axis=1)
    table = RangeTable(np.concatenate([np.zeros((0, RANGE_COLUMNS)), *(r for _, _, r in found)]))
    index = [np.full(len(rows), names.index(name)) for name, _, rows in found]
    pair_of = np.concatenate([np.zeros(0, dtype=np.int64), *index])
    ranges = RangeFactors(
        i=i,
        j=j,
        q_i=table.q_a,
        q_j=table.q_b,
        measured=table.range_m,
        sigma=table.sigma_m,
        pair=pair_of,
    )
    return ranges, names


def sensible(i: Index, j: Index) -> NDArray[np.bool_]:
    """Which of the edges (m,) that ought to join poses of the same time do so, more or less."""
    far = np.abs(i - j) > FAR
    standing = vertex_cover(i[far], j[far], STANDING)
    return np.asarray(~far | np.isin(i, standing) | np.isin(j, standing))


def _name(pair: PairData) -> tuple[int, int]:
    low, high = sorted((pair.a.robot, pair.b.robot))
    return low, high


def _ends(graph: PoseGraph, numbers: Numbering, pair: PairData, a_n: Array, b_n: Array) -> Index:
    """(2, m) places of the keyframes of both robots of a pair."""
    a, b = graph.chains[pair.a.robot], graph.chains[pair.b.robot]
    return np.stack([numbers.of(a, a_n), numbers.of(b, b_n)])
