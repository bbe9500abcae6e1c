"""The team's pose graph: what all robots said, kept as arrays, and the problem that it poses.

Items are keyed by who made them and when, so inserting is idempotent and the order of arrival does
not matter. An item may name a keyframe that has not arrived yet; it waits and counts once both
ends are there. A robot that starts again begins a new chain and its old one is forgotten.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain, Key, Segment
from drslamd.gossip.messages import ClosureItem, GraphEntry
from drslamd.slam import se2
from drslamd.slam.odometry import OdometryNoise, covariance_between, growth, turned_back
from drslamd.slam.problem import Index, Links, PoseEdges, Ranges
from drslamd.slam.se2 import Array

MAX_KEYFRAMES = 4_000
"""Of one chain: over an hour of driving at one a second; the oldest are forgotten."""
MAX_RANGES = 20_000
"""Of one pair, 1.6 MB; the oldest are forgotten."""
MAX_CLOSURES = 4_000
"""Of one pair."""

LINK_FLOOR_M, LINK_FLOOR_RAD = 5e-4, 5e-4
"""No wheel is better than this over one link, and a robot that stands may still be pushed."""
DEFAULT_NOISE = OdometryNoise(0.03, 0.0026, 0.01, 0.0087)
"""Until a robot has said how good its odometry is (config defaults)."""


class Rows:
    """Rows of one width in one growing array, the oldest dropped beyond `most`."""

    def __init__(self, width: int, most: int) -> None:
        self._data = np.empty((64, width))
        self._count = 0
        self._most = most

    @property
    def data(self) -> Array:
        return self._data[: self._count]

    def append(self, row: Array | list[float]) -> None:
        if self._count == len(self._data):
            keep = self._data[max(0, self._count - self._most + self._most // 8) :]
            if len(keep) == self._count:
                keep = self._data
            self._data = np.empty((2 * len(keep), self._data.shape[1]))
            self._count = len(keep)
            self._data[: self._count] = keep
        self._data[self._count] = row
        self._count += 1


@dataclass
class ChainItems:
    """Keyframes of one chain in the order of n, columns n, segment, x, y, theta (m, rad)."""

    chain: Chain
    noise: OdometryNoise = DEFAULT_NOISE
    antenna: Array = field(default_factory=lambda: np.zeros(2))
    """(2,) in the body frame, m."""
    _rows: Array = field(default_factory=lambda: np.empty((0, 5)))
    _sums: Array = field(default_factory=lambda: np.empty((0, 6)))
    _new: list[list[float]] = field(default_factory=list)

    def add(self, n: int, segment: int, x: int, y: int, theta: int) -> None:
        self._new.append(
            [n, segment, x * TRANSLATION_STEP_M, y * TRANSLATION_STEP_M, theta * ROTATION_STEP_RAD]
        )

    @property
    def rows(self) -> Array:
        if self._new:
            rows = np.concatenate([self._rows, np.array(self._new)])
            _, first = np.unique(rows[:, 0], return_index=True)
            rows = rows[first]
            # what came late shifts the sums of the rows behind it by a fraction of a link
            base = self._sums[0] if len(self._sums) and rows[0, 0] == self._rows[0, 0] else 0.0
            self._sums = (growth(rows[:, 2:]) + base)[-MAX_KEYFRAMES:]
            self._rows, self._new = rows[-MAX_KEYFRAMES:], []
        return self._rows

    @property
    def sums(self) -> Array:
        """(k, 6) `odometry.growth` along the chain; only differences within a segment count."""
        return self._sums[: len(self.rows)]

    @property
    def n(self) -> Index:
        return self.rows[:, 0].astype(np.int64)

    @property
    def poses(self) -> Array:
        return self.rows[:, 2:]

    def find(self, n: Array) -> tuple[Index, NDArray[np.bool_]]:
        """Positions of keyframes n (k,), and which of them are there."""
        own = self.rows[:, 0]
        at = np.minimum(np.searchsorted(own, n), max(len(own) - 1, 0))
        return at, (own[at] == n if len(own) else np.zeros(len(n), bool))

    def segments(self) -> dict[int, tuple[int, int]]:
        """Rows first .. last of each segment."""
        numbers, first, count = np.unique(self.rows[:, 1], return_index=True, return_counts=True)
        return {
            int(s): (int(f), int(f + c - 1)) for s, f, c in zip(numbers, first, count, strict=True)
        }


@dataclass
class PairItems:
    """What the owner of a pair measured: a is the owner's chain, b the peer's."""

    a: Chain
    b: Chain
    ranges: Rows = field(default_factory=lambda: Rows(8, MAX_RANGES))
    """a_n b_n qa_x qa_y qb_x qb_y range sigma"""
    closures: dict[int, tuple[int, ClosureItem]] = field(default_factory=dict)
    """By number: (seq of the log entry that said so, closure)."""

    def kept(self) -> list[ClosureItem]:
        return [c for _, (_, c) in sorted(self.closures.items()) if c.kept]


class TeamGraph:
    """All chains and pairs that this robot holds."""

    def __init__(self) -> None:
        self.chains: dict[int, ChainItems] = {}
        self.pairs: dict[tuple[int, int], PairItems] = {}

    def insert(self, origin: Chain, entry: GraphEntry) -> None:
        """Take one entry of a robot's log."""
        items = self.chains.get(origin.robot)
        if items is not None and origin.epoch < items.chain.epoch:
            return
        if items is None or origin.epoch > items.chain.epoch:
            self.forget(origin.robot)
            items = self.chains[origin.robot] = ChainItems(origin)
        if entry.traits:
            items.noise = OdometryNoise(*entry.traits[:4])
            items.antenna = np.array(entry.traits[4:])
        for k in entry.keyframes:
            items.add(k.n, k.segment, k.x, k.y, k.theta)
        for r in entry.ranges:
            pair = self._pair(origin, r.peer)
            if pair:
                pair.ranges.append([r.a_n, r.b_n, *r.q_a, *r.q_b, r.range_m, r.sigma_m])
        for c in entry.closures:
            pair = self._pair(origin, c.peer)
            if pair and pair.closures.get(c.number, (-1, c))[0] <= entry.seq:
                pair.closures[c.number] = (entry.seq, c)
                while len(pair.closures) > MAX_CLOSURES:
                    del pair.closures[min(pair.closures)]

    def _pair(self, a: Chain, b: Chain) -> PairItems | None:
        """The pair's items; None when they belong to a start of b that is already past."""
        pair = self.pairs.get((a.robot, b.robot))
        if pair and pair.a == a and pair.b == b:
            return pair
        if pair and (pair.a.epoch > a.epoch or pair.b.epoch > b.epoch):
            return None
        self.pairs[a.robot, b.robot] = PairItems(a, b)
        return self.pairs[a.robot, b.robot]

    def forget(self, robot: int) -> None:
        """Drop a robot's chain and what was measured by it."""
        self.chains.pop(robot, None)
        for key in [k for k, p in self.pairs.items() if p.a.robot == robot]:
            del self.pairs[key]

    def usable(self) -> list[PairItems]:
        """Pairs whose both chains are the current ones."""
        return [
            pair
            for _, pair in sorted(self.pairs.items())
            if all(c.robot in self.chains and self.chains[c.robot].chain == c
                   for c in (pair.a, pair.b))
        ]  # fmt: skip

    def segment_of(self, robot: int, n: int) -> Segment | None:
        """The segment of keyframe n, None when it is not held."""
        items = self.chains[robot]
        at, there = items.find(np.array([float(n)]))
        if not there[0]:
            return None
        return Segment(*items.chain, int(items.rows[at[0], 1]))

    def digest(self, robots: set[int]) -> int:
        """A number that two robots share when they hold the same items of these robots."""
        h = blake2b(digest_size=8)
        for robot in sorted(robots & set(self.chains)):
            items = self.chains[robot]
            h.update(repr(items.chain).encode() + np.ascontiguousarray(items.rows).tobytes())
        for pair in self.usable():
            if {pair.a.robot, pair.b.robot} <= robots:
                rows = pair.ranges.data
                order = np.lexsort((rows[:, 1], rows[:, 0]))
                h.update(rows[order].tobytes() + repr([c.number for c in pair.kept()]).encode())
        return int.from_bytes(h.digest(), "big", signed=True)


@dataclass(frozen=True)
class Numbering:
    """Positions of the poses of some segments in one list, ordered by time.

    Attributes:
        keys: names of the poses.
        odometry: (n, 3) their poses in the odometry frame of their own chain.
        number: for each robot, the number of each row of its chain, -1 where it is left out.
    """

    keys: tuple[Key, ...]
    odometry: Array
    number: dict[int, Index]


def numbering(graph: TeamGraph, members: set[Segment], shift_us: dict[int, int]) -> Numbering:
    """Number all keyframes of `members` by time.

    Args:
        shift_us: clock of each robot minus ours, us; only the order depends on it.
    """
    rows, number = [], {}
    for robot in sorted({s.robot for s in members}):
        items = graph.chains[robot]
        wanted = [s.segment for s in members if s.chain == items.chain]
        at = np.flatnonzero(np.isin(items.rows[:, 1], wanted))
        number[robot] = np.full(len(items.rows), -1)
        when = items.rows[at, 0] - shift_us.get(robot, 0) / 1e5
        rows.append(
            np.column_stack([when, np.full(len(at), robot), at, items.rows[at][:, [0, 2, 3, 4]]])
        )
    table = np.concatenate(rows)
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    for robot, numbers in number.items():
        mine = np.flatnonzero(table[:, 1] == robot)
        numbers[table[mine, 2].astype(int)] = mine
    epochs = {s.robot: s.epoch for s in members}
    keys = tuple(
        Key(int(robot), epochs[int(robot)], int(n)) for robot, n in table[:, [1, 3]].tolist()
    )
    return Numbering(keys, table[:, 4:], number)


def links(graph: TeamGraph, numbers: Numbering, robots: list[int]) -> Links:
    """Odometry between neighbouring keyframes of each segment."""
    parts: list[tuple[Array, ...]] = []
    for index, robot in enumerate(robots):
        items = graph.chains[robot]
        number = numbers.number[robot]
        for first, last in items.segments().values():
            if number[first] < 0 or first == last:
                continue
            poses = items.poses[first : last + 1]
            sums = growth(poses)
            i, k = np.arange(len(poses) - 1), np.arange(1, len(poses))
            measured = se2.between(poses[i], poses[k])
            parts.append((
                number[first:last], number[first + 1 : last + 1], measured,
                link_covariance(items.noise, poses, sums, i, k, measured),
                np.full(len(i), index), sums[k, 0] - sums[i, 0],
            ))  # fmt: skip
    if not parts:
        empty = np.zeros(0, dtype=np.int64)
        return Links(empty, empty, np.zeros((0, 3)), np.zeros((0, 3, 3)), empty, np.zeros(0))
    return Links(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def link_covariance(
    noise: OdometryNoise, poses: Array, sums: Array, i: Index, k: Index, measured: Array
) -> Array:
    """(m, 3, 3): random noise of links as errors of x, y, theta in the frame of pose i.

    Scale and constant yaw rate are unknowns of the optimiser and not part of it.
    """
    random = OdometryNoise(0.0, 0.0, noise.translation_per_sqrt_m, noise.yaw_rad_per_sqrt_m)
    twist = turned_back(poses[i], covariance_between(random, poses, sums, i, k))
    # a left twist at pose i moves the end of the link by its turn times the lever
    lever = np.tile(np.eye(3), (len(i), 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = -measured[:, 1], measured[:, 0]
    floor = np.diag([LINK_FLOOR_M**2, LINK_FLOOR_M**2, LINK_FLOOR_RAD**2])
    return np.asarray(lever @ twist @ np.swapaxes(lever, 1, 2) + floor)


def closures(graph: TeamGraph, numbers: Numbering) -> PoseEdges:
    """All kept closures between numbered poses."""
    i, j, measured, covariance = [], [], [], []
    for pair in graph.usable():
        ends = _both_ends(graph, numbers, pair, np.array([(c.a_n, c.b_n) for c in pair.kept()]))
        for closure, a, b in zip(pair.kept(), *ends, strict=True):
            if a >= 0 and b >= 0:
                i.append(a)
                j.append(b)
                measured.append(closure.a_T_b)
                covariance.append(unpacked(closure.covariance))
    return PoseEdges(
        np.array(i, dtype=np.int64), np.array(j, dtype=np.int64),
        np.array(measured, dtype=float).reshape(-1, 3),
        np.array(covariance, dtype=float).reshape(-1, 3, 3),
    )  # fmt: skip


def ranges(graph: TeamGraph, numbers: Numbering) -> tuple[Ranges, list[tuple[int, int]]]:
    """All ranges between numbered poses, and the pairs of robots that `pair` numbers."""
    parts: list[tuple[Array, ...]] = []
    names: list[tuple[int, int]] = []
    for pair in graph.usable():
        rows = pair.ranges.data
        a, b = _both_ends(graph, numbers, pair, rows[:, :2])
        good = (a >= 0) & (b >= 0)
        if not good.any():
            continue
        low, high = sorted((pair.a.robot, pair.b.robot))
        if (low, high) not in names:
            names.append((low, high))
        index = np.full(int(good.sum()), names.index((low, high)))
        rows = rows[good]
        parts.append((a[good], b[good], rows[:, 2:4], rows[:, 4:6], rows[:, 6], rows[:, 7], index))
    if not parts:
        none, empty = np.zeros((0, 2)), np.zeros(0, dtype=np.int64)
        return Ranges(empty, empty, none, none, np.zeros(0), np.zeros(0), empty), []
    return Ranges(*(np.concatenate(column) for column in zip(*parts, strict=True))), names


def _both_ends(
    graph: TeamGraph, numbers: Numbering, pair: PairItems, n: Array
) -> tuple[Index, Index]:
    """Numbers of the poses at keyframes n (m, 2) of a pair, -1 where one is not there."""
    out = []
    for column, chain in enumerate((pair.a, pair.b)):
        if chain.robot not in numbers.number or not len(n):
            out.append(np.full(len(n), -1))
            continue
        at, there = graph.chains[chain.robot].find(n[:, column])
        out.append(np.where(there, numbers.number[chain.robot][at], -1))
    return out[0], out[1]


def packed(covariance: Array) -> tuple[float, ...]:
    """xx xy xt yy yt tt of a (3, 3) covariance."""
    return tuple(float(v) for v in covariance[np.triu_indices(3)])


def unpacked(upper: tuple[float, ...]) -> Array:
    """The (3, 3) covariance of `packed`."""
    full = np.zeros((3, 3))
    full[np.triu_indices(3)] = upper
    return np.asarray(full + np.triu(full, 1).T)
