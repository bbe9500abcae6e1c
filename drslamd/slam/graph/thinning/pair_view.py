"""What one pair measured, as module 3 sees it: between keyframes that stay.

What was measured at a keyframe that went is carried to the one that stands for it, and is as much
more uncertain as the way was long. Of those that then join the same two keyframes a few stay, by an
order that depends on nothing but themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ, Chain
from drslamd.slam import se2
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.tables import CLOSURE_COLUMNS, RANGE_COLUMNS, ClosureTable, RangeTable
from drslamd.slam.graph.thinning.chain_view import Carried, ChainPart, ChainView
from drslamd.slam.graph.thinning.time_cells import Kind
from drslamd.slam.graph.timed_rows import NEVER
from drslamd.slam.odometry.noise import PATH, OdometryNoise, by_yaw_rate, link_covariance
from drslamd.slam.robot_model import RobotModel
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
        ranges, moves, closures: see `PairView`.
    """

    ranges: RangeTable
    moves: Array
    closures: ClosureTable


NOTHING = PairPart(
    RangeTable(np.zeros((0, RANGE_COLUMNS))),
    np.zeros((0, 2, 2, 2)),
    ClosureTable(np.zeros((0, CLOSURE_COLUMNS))),
)
"""Of a stretch in which the two did not meet."""


@dataclass(frozen=True, eq=False)
class PairView:
    """One pair, thinned: a is the owner's chain, b the peer's.

    Attributes:
        ranges, closures: between keyframes that stay.
        moves: (k, 2, 2, 2) m: how the antennas of the ranges, seen from the keyframes of a and of b
            (second axis), move with yaw rate (per rad/m) and scale of that robot (third axis).
    """

    a: Chain
    b: Chain
    ranges: RangeTable
    moves: Array
    closures: ClosureTable

    def kept_closures(self) -> list[ClosureMeasurement]:
        """The closures one by one."""
        return self.closures.measurements(self.b)


@dataclass(frozen=True)
class _Ends:
    """Where measurements (m,) end: rows of what both chains hold.

    Attributes:
        there: (m,) are both held?
    """

    a: Index
    b: Index
    there: NDArray[np.bool_]

    @staticmethod
    def of(a: ChainView, b: ChainView, a_n: Array, b_n: Array) -> _Ends:
        at_a, a_there = a.held.find(a_n)
        at_b, b_there = b.held.find(b_n)
        return _Ends(at_a, at_b, a_there & b_there)


def _few(most: int, a: ChainView, b: ChainView, ends: _Ends, order: tuple[Array, ...]) -> Index:
    """Which measurements stay.

    Args:
        most: between the same two keyframes where one of these is old.
        order: keys (m,) by which those between the same two keyframes are ranked, first one first.
    """
    is_old = ends.there & (a.is_old(ends.a) | b.is_old(ends.b))
    old = np.flatnonzero(is_old)
    one, other = a.standing_for(ends.a[old]), b.standing_for(ends.b[old])
    ranked = np.lexsort((*(key[old] for key in reversed(order)), other, one))
    one, other = one[ranked], other[ranked]
    begins = np.ones(len(old), dtype=bool)
    begins[1:] = (one[1:] != one[:-1]) | (other[1:] != other[:-1])
    rank = np.arange(len(old)) - np.flatnonzero(begins)[np.cumsum(begins) - 1]
    stays = ends.there & ~is_old
    stays[old[ranked[rank < most]]] = True
    return np.flatnonzero(stays)


def _spread_out(n: Array) -> Array:
    """Keys (m,) by which measurements at keyframes n (m,) are taken evenly over any time."""
    return n.astype(np.int64) // GRID_HZ * GOLDEN % 2**32


def thinned_ranges(table: RangeTable, a: ChainView, b: ChainView) -> tuple[RangeTable, Array]:
    """Ranges between keyframes that stay, and how their antennas move (see `PairView`)."""
    ends = _Ends.of(a, b, table.a_n, table.b_n)
    # what is doubted much more than others says little
    doubt = np.frexp(table.sigma_m)[1]
    stay = _few(FEW_RANGES, a, b, ends, (doubt, _spread_out(table.a_n), table.place))
    table = table.chosen(stay).copy()
    variance = table.sigma_m**2
    moves = np.zeros((len(table), 2, 2, 2))
    for number, (end, rows, n, arm, turn) in enumerate(
        (
            (a, ends.a[stay], table.a_n, table.q_a, table.turn_a),
            (b, ends.b[stay], table.b_n, table.q_b, table.turn_b),
        )
    ):
        old = np.flatnonzero(end.standing_for(rows) != rows)
        if len(old):
            carried = end.carried(rows[old])
            n[old], arm[old] = carried.n, se2.transform(carried.keyframe_T_body, arm[old])
            turn[old] = se2.wrap(turn[old] + carried.keyframe_T_body[:, 2])
            variance[old] += _spread(end.model.noise, carried, arm[old])
            moves[old, number] = _moves(carried, arm[old], end.model.noise)
    table.sigma_m[:] = np.sqrt(variance)
    return table, moves


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


def thinned_closures(table: ClosureTable, a: ChainView, b: ChainView) -> ClosureTable:
    """Closures between keyframes that stay."""
    ends = _Ends.of(a, b, table.a_n, table.b_n)
    stay = _few(FEW_CLOSURES, a, b, ends, (_spread_out(table.a_n), table.number))
    rows_a, rows_b = ends.a[stay], ends.b[stay]
    table = ClosureTable(table.rows[stay])
    old = np.flatnonzero((a.standing_for(rows_a) != rows_a) | (b.standing_for(rows_b) != rows_b))
    if not len(old):
        return table
    from_a, from_b = a.carried(rows_a[old]), b.carried(rows_b[old])
    rows = table.rows.copy()
    out, plain = ClosureTable(rows), table.chosen(old)
    ka_T_b = se2.compose(from_a.keyframe_T_body, plain.a_T_b)
    pose = se2.compose(ka_T_b, se2.inverse(from_b.keyframe_T_body))
    turned = se2.turned(plain.covariance, from_a.keyframe_T_body[:, 2])
    lever = _lever(pose[:, :2] - ka_T_b[:, :2])
    covariance = lever @ turned @ np.swapaxes(lever, 1, 2)
    twist = link_covariance(a.model.noise, from_a.keyframe_T_body, from_a.sums)
    lever = _lever(pose[:, :2])
    covariance += lever @ twist @ np.swapaxes(lever, 1, 2)
    twist = link_covariance(b.model.noise, from_b.keyframe_T_body, from_b.sums)
    covariance += se2.turned(twist, pose[:, 2])
    out.a_n[old], out.b_n[old] = from_a.n, from_b.n
    out.a_T_b[old] = np.column_stack([pose[:, :2], se2.wrap(pose[:, 2])])
    out.packed[old] = covariance[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    return out


def _lever(arms: Array) -> Array:
    """(m, 3, 3) how poses at the ends of arms (m, 2) move with twists at their beginnings."""
    lever = np.tile(np.eye(3), (len(arms), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -arms[:, 1], arms[:, 0]
    return lever


@dataclass
class _Made:
    """A part, and what it was made of.

    Attributes:
        models: of both robots; own: the part of a; others: the old ones of b.
        first, last: what it names of b lies between these keyframes.
        changes: of ranges, closures and the chain of b, when it was last seen to be the same.
    """

    part: PairPart
    models: tuple[RobotModel, RobotModel]
    own: ChainPart
    first: int
    last: int
    others: tuple[ChainPart, ...]
    changes: tuple[int, int, int]


class PairThinning:
    """Views of one pair; parts in which nothing has changed are not made again."""

    def __init__(self) -> None:
        self._made: dict[Kind, _Made] = {}

    def view(self, pair: PairData, b_data: ChainData, a: ChainView, b: ChainView) -> PairView:
        """The pair as it is now.

        Args:
            b_data: of which b is the view.
        """
        changes = pair.said_ranges.changes, pair.said_closures.changes, b_data.changes
        parts = []
        for own in a.parts:
            kind = own.stretch.kind
            made = self._made.get(kind)
            if made is None or not _is_same(made, own, pair, b_data, a, b):
                made = self._made[kind] = _make(own, pair, a, b)
            made.changes = changes
            if made.part is not NOTHING:
                parts.append(made.part)
        if not parts:
            parts.append(NOTHING)
        return PairView(
            a=pair.a,
            b=pair.b,
            ranges=RangeTable(np.concatenate([part.ranges.rows for part in parts])),
            moves=np.concatenate([part.moves for part in parts]),
            closures=ClosureTable(np.concatenate([part.closures.rows for part in parts])),
        )


def _is_same(
    made: _Made, own: ChainPart, pair: PairData, b_data: ChainData, a: ChainView, b: ChainView
) -> bool:
    """Would a part of a pair be made of the same again?"""
    _, first, end = own.stretch
    ranges, closures, others = made.changes
    return (
        made.own is own
        and made.models == (a.model, b.model)
        and made.others == b.old_parts(made.first, made.last)
        and pair.said_ranges.is_same(ranges, first, end)
        and pair.said_closures.is_same(closures, first, end)
        and b_data.is_same(others, max(made.first, b.recent_n), made.last + 1)
    )


def _make(own: ChainPart, pair: PairData, a: ChainView, b: ChainView) -> _Made:
    _, first, end = own.stretch
    ranges = RangeTable(pair.said_ranges.between(first, end))
    closures = ClosureTable(pair.said_closures.between(first, end)).kept()
    named = np.concatenate([ranges.b_n, closures.b_n]).astype(np.int64)
    low, high = int(named.min(initial=NEVER)), int(named.max(initial=-1))
    if not len(named):
        part = NOTHING
    elif first >= a.recent_n and low >= b.recent_n:
        part = _whole(ranges, closures, a, b)
    else:
        part = PairPart(*thinned_ranges(ranges, a, b), thinned_closures(closures, a, b))
    return _Made(part, (a.model, b.model), own, low, high, b.old_parts(low, high), (0, 0, 0))


def _whole(ranges: RangeTable, closures: ClosureTable, a: ChainView, b: ChainView) -> PairPart:
    """Where all keyframes stay, all counts whose both ends are held."""
    ranges = ranges.chosen(_Ends.of(a, b, ranges.a_n, ranges.b_n).there)
    if len(closures):
        closures = closures.chosen(_Ends.of(a, b, closures.a_n, closures.b_n).there)
    return PairPart(ranges, np.zeros((len(ranges), 2, 2, 2)), closures)
