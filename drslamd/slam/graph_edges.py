"""The edges of a connected group: the graph's items between poses that are numbered by time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_US, Segment
from drslamd.slam import se2
from drslamd.slam.odometry import OdometryNoise, covariance_between, turned_back
from drslamd.slam.pose_graph import ChainItems, PairItems, TeamGraph
from drslamd.slam.problem import Index, Links, PoseEdges, Ranges
from drslamd.slam.se2 import Array

LINK_FLOOR_M, LINK_FLOOR_RAD = 5e-4, 5e-4
"""No wheel is better than this over one link, and a robot that stands may still be pushed."""


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

    def of(self, items: ChainItems, n: Array) -> Index:
        """Places of keyframes n (m,) of one chain, -1 where one is not there."""
        place = self.place.get(items.chain.robot)
        if place is None or not len(place):
            return np.full(len(n), -1)
        at, there = items.find(n)
        return np.where(there, place[at], -1)


def numbering(graph: TeamGraph, members: set[Segment], shift_us: dict[int, int]) -> Numbering:
    """Number all keyframes of `members`.

    Args:
        shift_us: clock of each robot minus ours, us; only the order depends on it.
    """
    place, when, robots, keyframes = {}, [], [], []
    for robot in sorted({s.robot for s in members}):
        items = graph.chains[robot]
        wanted = [s.segment for s in members if s.chain == items.chain]
        inside = np.isin(items.rows[:, 1], wanted)
        place[robot] = np.where(inside, 0, -1)
        keyframes.append(items.n[inside])
        when.append(keyframes[-1] - shift_us.get(robot, 0) / GRID_US)
        robots.append(np.full(len(keyframes[-1]), robot))
    robot_of, n_of = np.concatenate(robots), np.concatenate(keyframes)
    order = np.lexsort((robot_of, np.concatenate(when)))
    robot_of, n_of = robot_of[order], n_of[order]
    for robot, places in place.items():
        places[places == 0] = np.flatnonzero(robot_of == robot)
    return Numbering(robot_of, n_of, place)


def links(graph: TeamGraph, numbers: Numbering, robots: list[int]) -> Links:
    """Odometry between neighbouring keyframes of each segment, its scale and yaw rate left in."""
    parts: list[tuple[Array, ...]] = []
    for index, robot in enumerate(robots):
        items = graph.chains[robot]
        edges = chain_links(items, calibrated=True)
        place = numbers.place[robot]
        i, j = place[edges.i], place[edges.j]
        path = items.sums[edges.j, 0] - items.sums[edges.i, 0]
        used = (i >= 0) & (j >= 0)
        rows = (i, j, edges.measured, edges.covariance, np.full(len(i), index), path)
        parts.append(tuple(row[used] for row in rows))
    return Links(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def chain_links(items: ChainItems, calibrated: bool) -> PoseEdges:
    """Odometry between neighbouring rows of one chain, across no break.

    Args:
        calibrated: scale and constant yaw rate are unknowns of the optimiser, so the covariance
            holds only what is random; otherwise they are part of it.
    """
    rows, noise = items.rows, items.noise
    i = np.flatnonzero(rows[1:, 1] == rows[:-1, 1])
    j = i + 1
    if calibrated:
        noise = OdometryNoise(0.0, 0.0, noise.translation_per_sqrt_m, noise.yaw_rad_per_sqrt_m)
    measured = se2.between(items.poses[i], items.poses[j])
    along = covariance_between(noise, items.poses, items.sums, i, j)
    twist = turned_back(items.poses[i], along)
    # a left twist at pose i moves the end of the link by its turn times the lever
    lever = np.tile(np.eye(3), (len(i), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -measured[:, 1], measured[:, 0]
    floor = np.diag([LINK_FLOOR_M**2, LINK_FLOOR_M**2, LINK_FLOOR_RAD**2])
    return PoseEdges(i, j, measured, lever @ twist @ np.swapaxes(lever, 1, 2) + floor)


def closures(graph: TeamGraph, numbers: Numbering) -> PoseEdges:
    """All kept closures between numbered poses."""
    rows = []
    for pair in graph.usable():
        kept = pair.kept()
        a, b = _ends(graph, numbers, pair, np.array([(c.a_n, c.b_n) for c in kept]).reshape(-1, 2))
        rows += [
            (i, j, closure.a_T_b, se2.unpacked(closure.covariance))
            for closure, i, j in zip(kept, a.tolist(), b.tolist(), strict=True)
            if i >= 0 and j >= 0
        ]
    return pose_edges(rows)


def pose_edges(rows: Sequence[tuple[int, int, Sequence[float], Array]]) -> PoseEdges:
    """Edges out of (i, j, measured (3,), covariance (3, 3)), also of none."""
    return PoseEdges(
        np.array([r[0] for r in rows], dtype=np.int64),
        np.array([r[1] for r in rows], dtype=np.int64),
        np.array([r[2] for r in rows], dtype=float).reshape(-1, 3),
        np.array([r[3] for r in rows], dtype=float).reshape(-1, 3, 3),
    )


def ranges(graph: TeamGraph, numbers: Numbering) -> tuple[Ranges, list[tuple[int, int]]]:
    """All ranges between numbered poses, and the pairs of robots that `pair` numbers."""
    names = sorted({_name(pair) for pair in graph.usable()})
    ends, rows, index = [np.zeros((2, 0), dtype=np.int64)], [np.zeros((0, 8))], []
    for pair in graph.usable():
        both = np.stack(_ends(graph, numbers, pair, pair.ranges.data[:, :2]))
        used = np.flatnonzero((both >= 0).all(axis=0))
        ends.append(both[:, used])
        rows.append(pair.ranges.data[used])
        index += [names.index(_name(pair))] * len(used)
    i, j = np.concatenate(ends, axis=1)
    row = np.concatenate(rows)
    return Ranges(
        i, j, row[:, 2:4], row[:, 4:6], row[:, 6], row[:, 7], np.array(index, dtype=np.int64)
    ), names


def no_ranges() -> Ranges:
    """For graphs whose edges are the closures."""
    nobody = Numbering(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), {})
    return ranges(TeamGraph(), nobody)[0]


def _name(pair: PairItems) -> tuple[int, int]:
    low, high = sorted((pair.a.robot, pair.b.robot))
    return low, high


def _ends(graph: TeamGraph, numbers: Numbering, pair: PairItems, n: Array) -> tuple[Index, Index]:
    """Places of the keyframes n (m, 2) of a pair."""
    a, b = graph.chains[pair.a.robot], graph.chains[pair.b.robot]
    return numbers.of(a, n[:, 0]), numbers.of(b, n[:, 1])
