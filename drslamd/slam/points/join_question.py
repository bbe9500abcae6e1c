"""What two robots have told of things that stand and of each other: all that joins them.

It comes out of the graph, so it serves robots too that are out of each other's reach, and before
windows of their ranges alone name one pose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_HZ, Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph import standing_points, team_frame
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import KeyframeTable, RangeTable
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.points.joining import Common, Joined, joined
from drslamd.slam.points.point_search import Passing, PlaceCandidate, search
from drslamd.slam.points.point_tracker import Sensors
from drslamd.slam.se2 import Array

SPAN = 60 * GRID_HZ
"""Samples: how long ago what was measured counts."""
MOST_RANGES = 60
MOST_THINGS = 3
"""That are looked at; more would say little more."""
FEWEST = 10
"""Ranges, where there is only one common thing."""


class Passerby(NamedTuple):
    """One of the two: its keyframes of late, the last of which counts, the noise of its wheels, and
    its ways past what stands."""

    chain: Chain
    keyframes: KeyframeTable
    noise: OdometryNoise
    passings: dict[Segment, Passing]

    def places(self, sensors: Sensors) -> dict[Segment, PlaceCandidate]:
        """Of which it knows one place alone."""
        found = {
            thing: search(passing, self.noise, sensors.noise, sensors.model)
            for thing, passing in self.passings.items()
        }
        # (a place that is vague from here says the less, and with others still enough)
        return {
            thing: answer.candidates[0]
            for thing, answer in found.items()
            if len(answer.candidates) == 1 and answer.verdict != "ambiguous"
        }


def points_told(graph: PoseGraph, chain: Chain) -> set[Segment]:
    """What a robot has told that it stands, in its current segment."""
    said = (pair.closures for pair in graph.pairs.values() if pair.a == chain)
    if not any(closures.tells_place_only.any() for closures in said):
        return set()  # as most often: nobody needs to look at the whole graph for that
    return {
        joint.b
        for joint in team_frame.joints(graph)
        if joint.a.chain == chain and joint.tells_place_only
    }


class JoinQuestion(NamedTuple):
    """All that is needed for an answer, whatever becomes of the graph meanwhile.

    Attributes:
        rows: (k, 7) ranges between both, see `_ends`.
    """

    a: Passerby
    b: Passerby
    rows: Array
    sensors: Sensors

    def answer(self) -> Joined | str:
        """How b lies to a, or why that is not said."""
        a_places, b_places = self.a.places(self.sensors), self.b.places(self.sensors)
        both = sorted(a_places.keys() & b_places.keys())
        if not both:
            return "nothing that stands is known to both"
        if len(both) < 2 and len(self.rows) < FEWEST:
            return "one thing that stands is not enough without ranges"
        common = self._common([[side[thing] for thing in both] for side in (a_places, b_places)])
        noises = self.a.noise, self.b.noise
        return joined(common, noises, (self.a.keyframes, self.b.keyframes), self.sensors)

    def _common(self, seen: list[list[PlaceCandidate]]) -> Common:
        """
        Args:
            seen: places of the same things, as a and as b has them.
        """
        rows, tables = self.rows, (self.a.keyframes, self.b.keyframes)
        poses = np.stack([_seen_from_last(t, rows[:, k]) for k, t in enumerate(tables)])
        arms = rows[:, 3:5], rows[:, 5:7]
        points = [se2.transform(p, q) @ [1, 1j] for p, q in zip(poses, arms, strict=True)]
        places = [np.array([one.place for one in side]) for side in seen]
        spreads = [np.array([one.covariance for one in side]) for side in seen]
        return Common(
            a_places=places[0],
            b_places=places[1],
            a_spreads=spreads[0],
            b_spreads=spreads[1],
            t=(rows[:, 0] - self.a.keyframes.n[-1]) / GRID_HZ,
            range_m=rows[:, 2],
            poses=poses,
            points=np.stack(points),
        )


def join_question(graph: PoseGraph, a: Chain, b: Chain, sensors: Sensors) -> JoinQuestion | None:
    """The question of how b lies to a, by up to `MOST_THINGS` that both have told; None where one
    of them has no log."""
    things = sorted(points_told(graph, a) & points_told(graph, b))[:MOST_THINGS]
    one, other = _side(graph, a, things), _side(graph, b, things)
    if one is None or other is None:
        return None
    rows = np.zeros((0, 7))
    for pair in graph.usable():
        if {pair.a, pair.b} == {a, b}:
            rows = np.concatenate([rows, _ends(pair.ranges, pair.a == a)])
    inside = np.isin(rows[:, 0], one.keyframes.n) & np.isin(rows[:, 1], other.keyframes.n)
    rows = rows[inside]
    rows = rows[np.argsort(rows[:, 0], kind="stable")][-MOST_RANGES:]
    return JoinQuestion(one, other, rows, sensors)


def _side(graph: PoseGraph, chain: Chain, things: list[Segment]) -> Passerby | None:
    data = graph.chains.get(chain.robot)
    if data is None or data.chain != chain or not len(data.keyframes):
        return None
    passings = {thing: _passing(graph, data, thing) for thing in things}
    known = {thing: passing for thing, passing in passings.items() if passing is not None}
    return Passerby(chain, _recent(data), data.model.noise, known)


def _recent(data: ChainData) -> KeyframeTable:
    """Keyframes of late of the current segment."""
    table = data.keyframes
    return table.chosen((table.segment == table.segment[-1]) & (table.n >= table.n[-1] - SPAN))


def _passing(graph: PoseGraph, data: ChainData, thing: Segment) -> Passing | None:
    """The way of a robot past something that stands, as the log has it."""
    view = graph.view.chains.get(thing.robot)
    if view is None or view.chain != thing.chain:
        return None
    there = view.keyframes.n[standing_points.where_it_stands(graph, thing)]
    own, rows = _recent(data), np.zeros((0, 4))
    for pair in graph.usable():
        if {pair.a, pair.b} != {data.chain, thing.chain}:
            continue
        table, is_a = pair.ranges, pair.a == data.chain
        mine, other = (table.a_n, table.b_n) if is_a else (table.b_n, table.a_n)
        used = np.isin(other, there) & np.isin(mine, own.n)
        q = table.q_a if is_a else table.q_b
        rows = np.concatenate([rows, np.column_stack([mine, table.range_m, q])[used]])
    rows = rows[np.argsort(rows[:, 0], kind="stable")][-MOST_RANGES:]
    if not len(rows):
        return None
    poses = _seen_from_last(own, rows[:, 0])
    poses[:, :2] = se2.transform(poses, rows[:, 2:])
    t = (rows[:, 0] - own.n[-1]) / GRID_HZ
    return Passing(t, rows[:, 1], np.zeros(len(rows)), poses, np.zeros(2))


def _seen_from_last(table: KeyframeTable, n: Array) -> Array:
    """(k, 3) keyframes n seen from the last one."""
    at, _ = table.find(n)
    return se2.between(table.poses[-1:], table.poses[at])


def _ends(table: RangeTable, is_a_first: bool) -> Array:
    """(k, 7) keyframes of both, range, arms of both."""
    mine, other = (table.a_n, table.q_a), (table.b_n, table.q_b)
    if not is_a_first:
        mine, other = other, mine
    return np.column_stack([mine[0], other[0], table.range_m, mine[1], other[1]])
