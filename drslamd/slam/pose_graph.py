"""The team's pose graph: what all robots said, kept as arrays.

Items are keyed by who made them and when, so inserting is idempotent and the order of arrival does
not matter. An item may name a keyframe that has not arrived yet; it waits and counts once both
ends are there. A robot that starts again begins a new chain and its old one is forgotten.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain, Segment
from drslamd.slam.items import ClosureItem, GraphEntry
from drslamd.slam.odometry import OdometryNoise, growth
from drslamd.slam.problem import Index
from drslamd.slam.se2 import Array

MAX_KEYFRAMES = 4_000
"""Of one chain: over an hour of driving at one a second; the oldest are forgotten."""
MAX_RANGES = 20_000
"""Of one pair, 1.6 MB; the oldest are forgotten."""
MAX_CLOSURES = 4_000
"""Of one pair."""

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

    def rows_of(self, segment: Segment) -> slice:
        """Which rows of its chain a segment is."""
        first, last = self.chains[segment.robot].segments()[segment.segment]
        return slice(first, last + 1)

    def segment_rows(self, segment: Segment) -> Array:
        """(k, 5) keyframes of a segment."""
        return np.asarray(self.chains[segment.robot].rows[self.rows_of(segment)])

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
