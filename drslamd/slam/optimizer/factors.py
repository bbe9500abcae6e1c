"""The factors of a connected group: what the graph holds between poses numbered by time."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import Segment
from drslamd.slam.graph import standing_points, team_frame
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import (
    CLOSURE_COLUMNS,
    RANGE_COLUMNS,
    ClosureTable,
    RangeTable,
    positions,
)
from drslamd.slam.graph.team_frame import NO_CORRECTIONS, Group
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.graph.thinning.pair_view import PairView
from drslamd.slam.odometry.correction import MIRRORED, Correction
from drslamd.slam.odometry.noise import OdometryNoise, by_yaw_rate, link_covariance
from drslamd.slam.optimizer import mirror_factors
from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    CarriedEnds,
    OdometryFactors,
    RangeFactors,
)
from drslamd.slam.optimizer.vertex_cover import vertex_cover
from drslamd.slam.se2 import Array, Index

LINK_FLOOR_M = 5e-4
"""No wheel is better than this between two keyframes, and a robot that stands may be pushed."""
LINK_FLOOR_RAD = 5e-4
"""Likewise of angles."""
LEAST_WAY = 0.1
"""Of the way that was measured; no wheels count more."""
FAR = 128
"""So many poses lie between the ends of a factor that joins different times."""
FAR_APART = 2**42
"""Between the numbers by which keyframes of two robots are looked for; no robot has so many."""
STANDING = 64
"""So many poses may have such factors: those of robots that stood while the others drove on. What
is beyond is nonsense, and would make the team's problem too wide to be solved."""


@dataclass(frozen=True)
class Numbering:
    """Places of the keyframes of some segments in one list, ordered by time.

    Attributes:
        robot, n: (k,) whose keyframe each one is, and which.
        place: for each robot, the place of every row of its chain, -1 where it is left out.
        mirrored: robots whose odometry is the mirror image of their way.
    """

    robot: Index
    n: Index
    place: dict[int, Index]
    mirrored: Set[int] = frozenset()

    def of_robot(self, robot: int) -> Index:
        """Places of all numbered keyframes of a robot, in the order of time."""
        place = self.place[robot]
        return place[place >= 0]

    def of(self, chain: ChainView, n: Array) -> Index:
        """Places of keyframes n (m,) of one chain, -1 where one is not there."""
        place = self.place.get(chain.chain.robot)
        if place is None or not len(place):
            return np.full(len(n), -1)
        at, there = chain.keyframes.find(n)
        return np.where(there, place[at], -1)


def numbering(
    graph: PoseGraph,
    members: set[Segment],
    points: Set[Segment] = frozenset(),
    mirrored: Set[int] = frozenset(),
) -> Numbering:
    """Number all keyframes of `members`, and those of `points` where they stand."""
    place, when, robots, keyframes = {}, [], [], []
    for robot in sorted({s.robot for s in members | points}):
        chain = graph.view.chains[robot]
        wanted = [s.segment for s in members if s.chain == chain.chain]
        inside = np.isin(chain.keyframes.segment, wanted)
        for point in points:
            if point.chain == chain.chain:
                inside |= standing_points.where_it_stands(graph, point)
        place[robot] = np.where(inside, 0, -1)
        keyframes.append(chain.keyframes.n[inside])
        when.append(keyframes[-1] - graph.view.shifts[robot])
        robots.append(np.full(len(keyframes[-1]), robot))
    robot_of, n_of = np.concatenate(robots), np.concatenate(keyframes)
    order = np.lexsort((robot_of, np.concatenate(when)))
    robot_of, n_of = robot_of[order], n_of[order]
    for robot, places in place.items():
        places[places == 0] = np.flatnonzero(robot_of == robot)
    return Numbering(robot_of, n_of, place, mirrored)


def corrections(
    graph: PoseGraph,
    robots: list[int],
    previous: TeamEstimate | None,
    mirrored: Set[int] = frozenset(),
) -> dict[int, Correction]:
    """Of robots that are not mounted as configured, as far as that is known before a solver starts.

    The last solution tells; of who was not in it, the closures do, which were found with it.

    Args:
        mirrored: whose odometry is the mirror image of their way; closures do not tell of which
            of two it is.
    """
    out: dict[int, Correction] = {}
    for robot in robots:
        known = previous.correction(robot) if previous is not None else Correction()
        if known.is_mirrored != (robot in mirrored):
            known = Correction(turn=MIRRORED if robot in mirrored else 0.0)
        if known.turn:
            out[robot] = known
        if known.turn or (previous is not None and robot in previous.trajectories):
            continue
        found = [
            pair.closures.corrected[:, at]
            for pair in graph.view.pairs
            for chain, at in ((pair.a, slice(0, 2)), (pair.b, slice(2, 4)))
            if chain.robot == robot
        ]
        rows = np.concatenate([np.zeros((0, 2)), *found])
        rows = rows[rows[:, 1] > -1]
        if rows.any():
            scale, turn = np.median(rows, axis=0).tolist()
            out[robot] = Correction(scale=scale, turn=turn)
    return out


def initial_poses(
    graph: PoseGraph,
    group: Group,
    previous: TeamEstimate | None,
    places: Numbering,
    known: Mapping[int, Correction] = NO_CORRECTIONS,
) -> Array:
    """(k, 3) w_T_k from which a solver may start.

    Args:
        known: see `corrections`.
    """
    initial = np.zeros((len(places.n), 3))
    for segment, poses in team_frame.placed(graph, group, previous, known).items():
        rows = graph.view.chains[segment.robot].keyframes.of_segment(segment.segment)
        at = places.place[segment.robot][rows]
        initial[at[at >= 0]] = poses[at >= 0]
    # where the frame is said nobody's memory of it, but the odometry that defines it
    initial[gauge_place(graph, group, places)] = graph.view.segment(group.frame).poses[0]
    return initial


def gauge_place(graph: PoseGraph, group: Group, places: Numbering) -> int:
    """The first pose of the segment whose odometry frame is the team's."""
    first = graph.view.segment(group.frame).n[:1]
    return int(places.of(graph.view.chains[group.frame.robot], first)[0])


def odometry(graph: PoseGraph, numbers: Numbering, robots: list[int]) -> OdometryFactors:
    """Odometry between neighbouring keyframes of each segment, its scale and yaw rate left in."""
    chains = [graph.view.chains[robot] for robot in robots]
    links = [chain.links for chain in chains]
    places = [numbers.place[robot] for robot in robots]
    i = np.concatenate([place[each.i] for place, each in zip(places, links, strict=True)])
    j = np.concatenate([place[each.i + 1] for place, each in zip(places, links, strict=True)])
    of = np.repeat(np.arange(len(robots)), [len(each.i) for each in links])
    used = (i >= 0) & (j >= 0)
    i, j, of = i[used], j[used], of[used]
    measured, sums, by_turn = (
        np.concatenate(columns)[used]
        for columns in zip(*((e.measured, e.sums, e.by_turn) for e in links), strict=True)
    )
    covariance, by_yaw = np.empty((len(of), 3, 3)), np.empty((len(of), 3))
    # (most often all robots have the same wheels)
    for noise in dict.fromkeys(chain.model.noise for chain in chains):
        rows = np.flatnonzero(np.array([chain.model.noise == noise for chain in chains])[of])
        covariance[rows] = _link_covariance(noise.random_part(), measured[rows], sums[rows])
        by_yaw[rows] = by_yaw_rate(sums[rows], measured[rows, :2], noise)
    found = OdometryFactors(i, j, measured, covariance, of, by_yaw, by_turn)
    odd = np.isin(robots, list(numbers.mirrored))[of]
    return mirror_factors.mirrored_odometry(found, odd) if odd.any() else found


def as_driven(
    links: OdometryFactors, known: Mapping[int, Correction], robots: list[int]
) -> OdometryFactors:
    """Noise grows with the way that was driven, where that is not the one that was measured.

    Args:
        known: see `corrections`; what is learned of a scale moves a little with each solution, so
            it counts in halves of an octave, and who holds the same has the same noise.
    """
    if not known:
        return links
    ways = np.array([max(1 - known.get(robot, Correction()).scale, LEAST_WAY) for robot in robots])
    longer = 2 ** (np.round(2 * np.log2(ways)) / 2)
    return replace(links, covariance=links.covariance * longer[links.robot, None, None])


def chain_links(chain: ChainView, calibrated: bool) -> BetweenFactors:
    """Odometry between neighbouring rows of the keyframes of one chain, across no break.

    Args:
        calibrated: scale and constant yaw rate are unknowns of the optimiser, so the covariance
            holds only what is random; otherwise they are part of it.
    """
    links, noise = chain.links, chain.model.noise
    if calibrated:
        noise = noise.random_part()
    covariance = _link_covariance(noise, links.measured, links.sums)
    return BetweenFactors(links.i, links.i + 1, links.measured, covariance)


def _link_covariance(noise: OdometryNoise, measured: Array, sums: Array) -> Array:
    """(m, 3, 3) of the ends of links (m, 3), no better than the floor.

    Args:
        sums: (m, 13) see `ChainLinks`.
    """
    # a left twist at their beginning moves them by its turn times the lever
    lever = np.tile(np.eye(3), (len(measured), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -measured[:, 1], measured[:, 0]
    twist = link_covariance(noise, measured, sums)
    floor = np.diag([LINK_FLOOR_M**2, LINK_FLOOR_M**2, LINK_FLOOR_RAD**2])
    return np.asarray(lever @ twist @ np.swapaxes(lever, 1, 2) + floor)


def closures(graph: PoseGraph, numbers: Numbering) -> BetweenFactors:
    """All kept closures between numbered poses."""
    pairs = graph.view.pairs
    rows = [np.zeros((0, CLOSURE_COLUMNS)), *(pair.closures.rows for pair in pairs)]
    table = ClosureTable(np.concatenate(rows))
    of_pair = _of_pairs([len(pair.closures) for pair in pairs])
    ends = _ends(numbers, pairs, of_pair, table.a_n, table.b_n)
    is_odd = np.isin(numbers.robot[ends], list(numbers.mirrored))
    used = (ends >= 0).all(axis=0) & (table.is_mirrored == is_odd.any(axis=0))
    i, j = ends[:, used]
    table = table.chosen(used)
    found = BetweenFactors(i, j, table.a_T_b, table.covariance)
    # (those were found with b turning the other way)
    return mirror_factors.mirrored_between(found, is_odd[0, used]) if is_odd.any() else found


def ranges(graph: PoseGraph, numbers: Numbering) -> tuple[RangeFactors, list[tuple[int, int]]]:
    """All ranges between numbered poses, and the pairs of robots that `pair` numbers."""
    number = {robot: k for k, robot in enumerate(sorted(numbers.place))}
    pairs = [p for p in graph.view.pairs if p.a.robot in number and p.b.robot in number]
    rows = [np.zeros((0, RANGE_COLUMNS)), *(pair.ranges.rows for pair in pairs)]
    table = RangeTable(np.concatenate(rows))
    of_pair = _of_pairs([len(pair.ranges) for pair in pairs])
    ends = _ends(numbers, pairs, of_pair, table.a_n, table.b_n)
    used = np.asarray((ends >= 0).all(axis=0))
    moves = np.concatenate([np.zeros((0, 2, 2, 2)), *(pair.moves for pair in pairs)])
    if not used.all():
        ends, table, of_pair, moves = ends[:, used], table.chosen(used), of_pair[used], moves[used]
    i, j = ends
    is_there = (np.bincount(of_pair, minlength=len(pairs)) > 0).tolist()
    all_names = [_name(pair) for pair in pairs]
    names = sorted({name for name, there in zip(all_names, is_there, strict=True) if there})
    place = {name: k for k, name in enumerate(names)}
    named = np.array([place.get(name, 0) for name in all_names], dtype=np.int64)
    robots = np.array([(number[p.a.robot], number[p.b.robot]) for p in pairs], dtype=np.int64)
    robots = robots.reshape(-1, 2)
    carried = np.flatnonzero(moves.reshape(-1, 8).any(axis=1))
    factors = RangeFactors(
        i=i,
        j=j,
        q_i=table.q_a,
        q_j=table.q_b,
        measured=table.range_m,
        sigma=table.sigma_m,
        robots=robots[of_pair],
        turned=np.stack([table.turn_a, table.turn_b], axis=-1),
        pair=named[of_pair],
        carried=CarriedEnds(carried, moves[carried]),
    )
    for robot in sorted(numbers.mirrored):
        antenna = graph.view.chains[robot].model.antenna
        factors = mirror_factors.mirrored_ranges(factors, number[robot], antenna)
    return factors, names


def _of_pairs(counts: list[int]) -> Index:
    """(m,) to which pair each measurement belongs."""
    return np.repeat(np.arange(len(counts)), np.array(counts, dtype=np.int64))


def sensible(i: Index, j: Index) -> NDArray[np.bool_]:
    """Which of the edges (m,) that ought to join poses of the same time do so, more or less."""
    far = np.abs(i - j) > FAR
    standing = vertex_cover(i[far], j[far], STANDING)
    return np.asarray(~far | np.isin(i, standing) | np.isin(j, standing))


def _name(pair: PairView) -> tuple[int, int]:
    a, b = pair.a.robot, pair.b.robot
    return (a, b) if a < b else (b, a)


def _ends(
    numbers: Numbering, pairs: list[PairView], of_pair: Index, a_n: Array, b_n: Array
) -> Index:
    """(2, m) places of the keyframes of both robots of each measurement, -1 where there is none.

    Args:
        of_pair: (m,) which of the pairs measured it.
    """
    keys = numbers.robot * FAR_APART + numbers.n.astype(np.int64)
    order = np.argsort(keys)
    ascending = keys[order]
    out = np.full((2, len(of_pair)), -1)
    for end, (robots, n) in enumerate(
        (([p.a.robot for p in pairs], a_n), ([p.b.robot for p in pairs], b_n))
    ):
        wanted = np.array(robots, dtype=np.int64)[of_pair] * FAR_APART + n.astype(np.int64)
        at, there = positions(ascending, wanted)
        out[end, there] = order[at[there]]
    return out
