"""What pairs measured, between keyframes that stay: all pairs of a team at once.

What was measured at a keyframe that went is carried to the one that stands for it, and is as much
more uncertain as the way was long. Of those that then join the same two keyframes a few stay, by an
order that depends on nothing but themselves. So what becomes of one pair does not depend on the
others beside it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import NamedTuple

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam import se2
from drslamd.slam.graph.tables import CLOSURE_COLUMNS, RANGE_COLUMNS, ClosureTable, RangeTable
from drslamd.slam.graph.thinning.chain_view import Carried
from drslamd.slam.graph.thinning.rounding import RESOLUTION, as_digested
from drslamd.slam.graph.thinning.team_chains import Ends, TeamChains
from drslamd.slam.odometry.noise import PATH, OdometryNoise, by_yaw_rate, link_covariance
from drslamd.slam.se2 import Array, Index

FEW_RANGES = 4
"""So many ranges stay between the same two keyframes. After 20 minutes old paths are then 1.1 times
as wrong as with all of them, with two ranges 1.2 times; each costs as much as a recent one."""
FEW_CLOSURES = 2
"""So many closures stay; their windows overlap, so that one says nearly what the next one says."""
MOVING_M = 0.5
"""A body that was carried over a shorter way moves too little with the constants of odometry: 2 cm
if its scale is wrong by 3 %, and backwards as often as forwards."""
GOLDEN = 2_654_435_769
"""2^32 over the golden ratio: multiples of it, modulo 2^32, lie evenly however many are taken."""


@dataclass(frozen=True, eq=False)
class PairPart:
    """What was measured in one stretch of the owner's time.

    Attributes:
        ranges, moves, closures: see `pair_view.PairView`.
    """

    ranges: RangeTable
    moves: Array
    closures: ClosureTable

    @cached_property
    def digest(self) -> bytes:
        """Of all that it holds; none of a part that holds nothing."""
        if not len(self.ranges) and not len(self.closures):
            return b""
        h = blake2b(digest_size=16)
        is_carried = np.abs(self.moves).max(initial=0.0) > RESOLUTION / 2
        moves = self.moves if is_carried else self.moves[:0]
        for values in (self.ranges.rows, moves, self.closures.rows):
            h.update(as_digested(values))
        return h.digest()


NOTHING = PairPart(
    RangeTable(np.zeros((0, RANGE_COLUMNS))),
    np.zeros((0, 2, 2, 2)),
    ClosureTable(np.zeros((0, CLOSURE_COLUMNS))),
)
"""Of a stretch in which the two did not meet."""


class Unthinned(NamedTuple):
    """What one pair said of one stretch of the owner's time.

    Attributes:
        a, b: robots.
        closures: those that were not withdrawn.
        of_a, of_b: the first and the last keyframe of each that is named.
        is_old: does it lie in times that are thinned?
    """

    a: int
    b: int
    ranges: RangeTable
    closures: ClosureTable
    of_a: tuple[int, int]
    of_b: tuple[int, int]
    is_old: bool


class Between(NamedTuple):
    """Where measurements (m,) of several parts are, all side by side.

    Attributes:
        chains: of the team; part: (m,) of which part each is, ascending.
        a, b: their ends.
    """

    chains: TeamChains
    part: Index
    a: Ends
    b: Ends

    def chosen(self, which: Index) -> Between:
        return Between(self.chains, self.part[which], self.a.chosen(which), self.b.chosen(which))


def thinned_pairs(said: list[Unthinned], chains: TeamChains) -> list[PairPart]:
    """A part for each of what was said; `chains` are of its spans, and perhaps of more."""
    if not said:
        return []
    owners, peers = (
        chains.numbers(robots) for robots in ([s.a for s in said], [s.b for s in said])
    )
    ranges = RangeTable(np.concatenate([part.ranges.rows for part in said]))
    closures = ClosureTable(np.concatenate([part.closures.rows for part in said]))
    places = []
    for table, counts in (
        (ranges, [len(part.ranges) for part in said]),
        (closures, [len(part.closures) for part in said]),
    ):
        part = np.repeat(np.arange(len(said)), counts)
        a, b = chains.find(owners[part], table.a_n), chains.find(peers[part], table.b_n)
        places.append(Between(chains, part, a, b))
    of_ranges, of_closures = places
    few, ranges, moves = thinned_ranges(ranges, of_ranges)
    some, closures = thinned_closures(closures, of_closures)
    cuts = [np.searchsorted(part, np.arange(1, len(said))) for part in (few, some)]
    parts = zip(
        np.split(ranges.rows, cuts[0]),
        np.split(moves, cuts[0]),
        np.split(closures.rows, cuts[1]),
        strict=True,
    )
    # (of their own, or each would hold what was said of all)
    return [PairPart(RangeTable(r.copy()), m.copy(), ClosureTable(c.copy())) for r, m, c in parts]


def spans_of(said: Iterable[Unthinned]) -> dict[int, tuple[int, int]]:
    """First and last keyframe of each robot that is named."""
    out: dict[int, tuple[int, int]] = {}
    for part in said:
        for robot, (first, last) in ((part.a, part.of_a), (part.b, part.of_b)):
            low, high = out.get(robot, (first, last))
            out[robot] = min(low, first), max(high, last)
    return out


def _few(most: int, at: Between, order: tuple[Array, ...]) -> Index:
    """Which measurements stay.

    Args:
        most: of one part between the same two keyframes where one of these is old.
        order: keys (m,) by which those between the same two keyframes are ranked, first one first.
    """
    chains = at.chains
    there = at.a.there & at.b.there
    held = np.flatnonzero(there)
    old = held[chains.is_old[at.a.rows[held]] | chains.is_old[at.b.rows[held]]]
    if not len(old):
        return held
    one, other = chains.near[at.a.rows[old]], chains.near[at.b.rows[old]]
    part = at.part[old]
    ranked = np.lexsort((*(key[old] for key in reversed(order)), other, one, part))
    one, other, part = one[ranked], other[ranked], part[ranked]
    begins = np.ones(len(old), dtype=bool)
    begins[1:] = (one[1:] != one[:-1]) | (other[1:] != other[:-1]) | (part[1:] != part[:-1])
    rank = np.arange(len(old)) - np.flatnonzero(begins)[np.cumsum(begins) - 1]
    stays = there.copy()
    stays[old] = False
    stays[old[ranked[rank < most]]] = True
    return np.flatnonzero(stays)


def _spread_out(n: Array) -> Array:
    """Keys (m,) by which measurements at keyframes n (m,) are taken evenly over any time."""
    return n.astype(np.int64) // GRID_HZ * GOLDEN % 2**32


def thinned_ranges(table: RangeTable, at: Between) -> tuple[Index, RangeTable, Array]:
    """Ranges (k,) between keyframes that stay: of which part each is, they themselves, and how
    their antennas move (see `PairView`)."""
    # what is doubted much more than others says little
    doubt = np.frexp(table.sigma_m)[1]
    stay = _few(FEW_RANGES, at, (doubt, _spread_out(table.a_n), table.place))
    table, at = table.chosen(stay).copy(), at.chosen(stay)
    variance = table.sigma_m**2
    moves = np.zeros((len(table), 2, 2, 2))
    for number, (end, n, arm, turn) in enumerate(
        (
            (at.a, table.a_n, table.q_a, table.turn_a),
            (at.b, table.b_n, table.q_b, table.turn_b),
        )
    ):
        old = np.flatnonzero(at.chains.near[end.rows] != end.rows)
        if len(old):
            rows = end.rows[old]
            carried = at.chains.carried(rows)
            n[old], arm[old] = carried.n, se2.transform(carried.keyframe_T_body, arm[old])
            turn[old] = se2.wrap(turn[old] + carried.keyframe_T_body[:, 2])
            for noise, which in at.chains.by_noise(rows):
                some, these = carried.chosen(which), old[which]
                variance[these] += _spread(noise, some, arm[these])
                moves[these, number] = _moves(some, arm[these], noise)
    table.sigma_m[:] = np.sqrt(variance)
    return at.part, table, moves


def _spread(noise: OdometryNoise, carried: Carried, points: Array) -> Array:
    """(m,) m^2, how uncertain random odometry makes bodies' points (m, 2) in a direction."""
    lever = _lever(points)[:, :2]
    twist = link_covariance(noise.random_part(), carried.keyframe_T_body, carried.sums)
    return np.asarray(np.einsum("kij,kjl,kil->k", lever, twist, lever) / 2)


def _moves(carried: Carried, points: Array, noise: OdometryNoise) -> Array:
    """(m, 2, 2) how bodies' points (m, 2) move with yaw rate and scale, one row each."""
    by_yaw = by_yaw_rate(carried.sums, points, noise)[:, :2]
    moves = np.empty((len(points), 2, 2))
    moves[:, 0] = np.where(carried.is_after[:, None], by_yaw, -by_yaw)
    moves[:, 1] = carried.keyframe_T_body[:, :2]
    moves[carried.sums[:, PATH] < MOVING_M] = 0.0
    return moves


def thinned_closures(table: ClosureTable, at: Between) -> tuple[Index, ClosureTable]:
    """Closures (k,) between keyframes that stay: of which part each is, and they themselves."""
    stay = _few(FEW_CLOSURES, at, (_spread_out(table.a_n), table.number))
    at, rows, chains = at.chosen(stay), table.rows[stay], at.chains
    rows_a, rows_b = at.a.rows, at.b.rows
    old = np.flatnonzero((chains.near[rows_a] != rows_a) | (chains.near[rows_b] != rows_b))
    plain = ClosureTable(rows[old])
    out = ClosureTable(rows)
    if not len(old):
        return at.part, out
    from_a, from_b = chains.carried(rows_a[old]), chains.carried(rows_b[old])
    ka_T_b = se2.compose(from_a.keyframe_T_body, plain.a_T_b)
    pose = se2.compose(ka_T_b, se2.inverse(from_b.keyframe_T_body))
    turned = se2.turned(plain.covariance, from_a.keyframe_T_body[:, 2])
    lever = _lever(pose[:, :2] - ka_T_b[:, :2])
    covariance = lever @ turned @ np.swapaxes(lever, 1, 2)
    lever = _lever(pose[:, :2])
    covariance += lever @ _twists(chains, rows_a[old], from_a) @ np.swapaxes(lever, 1, 2)
    covariance += se2.turned(_twists(chains, rows_b[old], from_b), pose[:, 2])
    out.a_n[old], out.b_n[old] = from_a.n, from_b.n
    out.a_T_b[old] = np.column_stack([pose[:, :2], se2.wrap(pose[:, 2])])
    out.packed[old] = covariance[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    return at.part, out


def _twists(chains: TeamChains, rows: Index, carried: Carried) -> Array:
    """(m, 3, 3) covariance of the ways over which bodies of rows (m,) were carried."""
    out = np.empty((len(rows), 3, 3))
    for noise, which in chains.by_noise(rows):
        some = carried.chosen(which)
        out[which] = link_covariance(noise, some.keyframe_T_body, some.sums)
    return out


def _lever(arms: Array) -> Array:
    """(m, 3, 3) how poses at the ends of arms (m, 2) move with twists at their beginnings."""
    lever = np.tile(np.eye(3), (len(arms), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -arms[:, 1], arms[:, 0]
    return lever
