"""The team's pose graph: what all robots said, kept as arrays.

Items are keyed by who made them and when, so inserting is idempotent and the order of arrival does
not matter. An item may name a keyframe that has not arrived yet; it waits and counts once both
ends are there. A robot that starts again begins a new chain and its old one is forgotten.

Items come from other robots, so nothing is believed that would harm what is made of them: a robot
may send nonsense, and then only its own trajectory is nonsense.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain, Segment
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.odometry.track import OdometryNoise, growth
from drslamd.slam.optimizer.problem import Index
from drslamd.slam.se2 import Array

MAX_KEYFRAMES = 4_000
"""Of one chain: over an hour of driving at one a second; the oldest are forgotten."""
MAX_RANGES = 20_000
"""Of one pair, 1.6 MB; the oldest are forgotten."""
MAX_CLOSURES = 4_000
"""Of one pair."""

WAITING = 1_024
"""Rows that came in and are not yet sorted into their table."""
PER_ENTRY = 4_096
"""Above the number of ranges that any one entry of a log can hold."""

FARTHEST_M = 10_000.0
"""No radio of this kind reaches so far."""
CLOSURE_SIGMAS = (1e-4, 300.0)
"""m and rad; a better or a worse closure than this was not measured."""
ANTENNA_M = 5.001
"""As the configuration has it, and a millimetre for rounding."""

DEFAULT_NOISE = OdometryNoise(0.03, 0.0026, 0.01, 0.0087)
"""Until a robot has said how good its odometry is (config defaults)."""


class Rows:
    """Rows in the order of their first column, each value of it once, the last `most` of them."""

    def __init__(self, width: int, most: int) -> None:
        self._sorted = np.empty((0, width))
        self._new: list[list[float]] = []
        self._most = most

    def add(self, row: list[float]) -> None:
        self._new.append(row)
        if len(self._new) >= WAITING:
            self._merge()

    @property
    def data(self) -> Array:
        """(k, width); the same array until something was added."""
        if self._new:
            self._merge()
        return self._sorted

    def replace(self, rows: Array) -> None:
        """Let these rows, in order, be all."""
        self._sorted, self._new = rows, []

    def _merge(self) -> None:
        rows = np.concatenate([self._sorted, np.array(self._new)])
        self._new = []
        if (np.diff(rows[:, 0]) <= 0).any():
            # of rows with one key the smallest counts, whichever came first
            rows = rows[np.lexsort(rows.T[::-1])]
            rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
        self._sorted = rows[-self._most :]


class ChainData:
    """Keyframes of one chain, and what its robot says of its own sensors.

    Attributes:
        noise: of its odometry.
        antenna: (2,) in the body frame, m; antenna_z_m: above the floor.
    """

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.noise = DEFAULT_NOISE
        self.antenna: Array = np.zeros(2)
        self.antenna_z_m = 0.0
        self._traits_seq = -1
        self._table = Rows(5, MAX_KEYFRAMES)
        self._rows = self._table.data
        self._sums = np.empty((0, 6))
        self._source = self._rows
        self._kept_n, self._kept_detours = np.zeros(0), np.zeros((0, 6))

    def add(self, k: Keyframe) -> None:
        metres, radians = TRANSLATION_STEP_M, ROTATION_STEP_RAD
        self._table.add([k.n, k.segment, k.x * metres, k.y * metres, k.theta * radians])

    def take_traits(self, seq: int, traits: tuple[float, ...]) -> None:
        """The sigmas of `OdometryNoise` and the antenna's place; the latest entry counts."""
        noise = OdometryNoise(*traits[:4])
        near = all(abs(value) <= ANTENNA_M for value in traits[4:])
        if seq > self._traits_seq and noise.is_plausible() and near:
            self._traits_seq, self.noise, self.antenna = seq, noise, np.array(traits[4:6])
            self.antenna_z_m = traits[6]

    @property
    def rows(self) -> Array:
        """(k, 5) in the order of n; columns n, segment, x, y, theta (m, rad)."""
        table = self._table.data
        if table is not self._source:
            self._renew(table)
        return self._rows

    def _renew(self, table: Array) -> None:
        rows, known = table.copy(), self._rows
        # a segment never comes back, so each is one block of rows whatever its robot says
        rows[:, 1] = np.maximum.accumulate(rows[:, 1])
        sums = growth(rows[:, 2:]) + self._detours(rows[:, 0])
        if len(known):
            # what came late in front of the known rows, or was dropped there, moves no sum
            at, there = _found(rows[:, 0], known[:, 0])
            if there.any():
                first = int(np.argmax(there))
                sums += self._sums[first] - sums[at[first]]
        self._rows, self._sums, self._source = rows, sums, table

    def keep(self, stays: NDArray[np.bool_]) -> None:
        """Forget the rows (k,) that do not stay; the sums of the others do not change."""
        rows = self.rows
        self._rows, self._sums = rows[stays], self._sums[stays]
        self._table.replace(self._rows)
        self._source = self._table.data
        # from now on straight links stand for the way that was gone
        self._kept_n = self._rows[:, 0]
        self._kept_detours = self._sums - growth(self._rows[:, 2:])

    def _detours(self, n: Array) -> Array:
        """(k, 6) what is missing of `growth` at keyframes n (k,) since rows were forgotten."""
        if not len(self._kept_n):
            return np.zeros((len(n), 6))
        at = np.searchsorted(self._kept_n, n, side="right") - 1
        return np.asarray(self._kept_detours[np.maximum(at, 0)])

    @property
    def sums(self) -> Array:
        """(k, 6) `odometry.growth` along the chain; only differences within a segment count."""
        rows = self.rows  # renews the sums
        return self._sums[: len(rows)]

    @property
    def n(self) -> Index:
        return self.rows[:, 0].astype(np.int64)

    @property
    def poses(self) -> Array:
        return self.rows[:, 2:]

    def find(self, n: Array) -> tuple[Index, NDArray[np.bool_]]:
        """Positions of keyframes n (k,), and which of them are there."""
        return _found(self.rows[:, 0], n)

    def rows_of(self, segment: int) -> slice:
        """Which rows a segment is; empty when it is not there."""
        return slice(*np.searchsorted(self.rows[:, 1], [segment, segment + 1]).tolist())


def _found(ascending: Array, wanted: Array) -> tuple[Index, NDArray[np.bool_]]:
    at = np.minimum(np.searchsorted(ascending, wanted), max(len(ascending) - 1, 0))
    there = ascending[at] == wanted if len(ascending) else np.zeros(len(wanted), bool)
    return at, there


@dataclass
class PairData:
    """What the owner of a pair measured: a is the owner's chain, b the peer's."""

    a: Chain
    b: Chain
    closures: dict[int, tuple[int, ClosureMeasurement]] = field(default_factory=dict)
    """By number: (seq of the log entry that said so, closure)."""
    _ranges: Rows = field(default_factory=lambda: Rows(9, MAX_RANGES))

    def add_range(self, seq: int, place: int, r: RangeMeasurement) -> None:
        """A range at some place in the log of its owner."""
        if abs(r.range_m) < FARTHEST_M and r.sigma_m > 0:
            key = seq * PER_ENTRY + place
            self._ranges.add([key, r.a_n, r.b_n, *r.q_a, *r.q_b, r.range_m, r.sigma_m])

    def add_closure(self, seq: int, c: ClosureMeasurement) -> None:
        """A closure, or its withdrawal; of one number the latest word counts."""
        if self.closures.get(c.number, (-1, c))[0] <= seq and _believable(c):
            self.closures[c.number] = (seq, c)
            while len(self.closures) > MAX_CLOSURES:
                del self.closures[min(self.closures)]

    @property
    def ranges(self) -> Array:
        """(k, 8) a_n b_n qa_x qa_y qb_x qb_y range sigma, in the order of the owner's log."""
        return self._ranges.data[:, 1:]

    @property
    def keyed_ranges(self) -> Array:
        """(k, 9) the same behind the key that orders them."""
        return self._ranges.data

    def replace_ranges(self, keyed: Array) -> None:
        """Let these be all."""
        self._ranges.replace(keyed)

    def kept(self) -> list[ClosureMeasurement]:
        return [c for _, (_, c) in sorted(self.closures.items()) if c.kept]


def _believable(c: ClosureMeasurement) -> bool:
    best, worst = CLOSURE_SIGMAS
    variances = (c.covariance[k] for k in (0, 3, 5))
    return all(best**2 < v < worst**2 for v in variances) and all(
        abs(v) < FARTHEST_M for v in c.a_T_b
    )


class PoseGraph:
    """All chains and pairs that this robot holds."""

    def __init__(self) -> None:
        self.chains: dict[int, ChainData] = {}
        self.pairs: dict[tuple[int, int], PairData] = {}

    def insert(self, origin: Chain, entry: GraphEntry) -> None:
        """Take one entry of a robot's log."""
        items = self.chains.get(origin.robot)
        if items is not None and origin.epoch < items.chain.epoch:
            return
        if items is None or origin.epoch > items.chain.epoch:
            self.forget(origin.robot)
            items = self.chains[origin.robot] = ChainData(origin)
        if entry.traits:
            items.take_traits(entry.seq, entry.traits)
        for k in entry.keyframes:
            items.add(k)
        for place, r in enumerate(entry.ranges):
            pair = self._pair(origin, r.peer)
            if pair:
                pair.add_range(entry.seq, place, r)
        for c in entry.closures:
            pair = self._pair(origin, c.peer)
            if pair:
                pair.add_closure(entry.seq, c)

    def _pair(self, a: Chain, b: Chain) -> PairData | None:
        """The pair's items; None for a start of b that is already past, and for a pair of one."""
        pair = self.pairs.get((a.robot, b.robot))
        if pair and pair.a == a and pair.b == b:
            return pair
        if a.robot == b.robot or (pair and pair.b.epoch > b.epoch):
            return None
        self.pairs[a.robot, b.robot] = PairData(a, b)
        return self.pairs[a.robot, b.robot]

    def forget(self, robot: int) -> None:
        """Drop a robot's chain and what was measured by it."""
        self.chains.pop(robot, None)
        for key in [k for k, p in self.pairs.items() if p.a.robot == robot]:
            del self.pairs[key]

    def usable(self) -> list[PairData]:
        """Pairs whose both chains are the current ones."""
        return [
            pair
            for _, pair in sorted(self.pairs.items())
            if all(c.robot in self.chains and self.chains[c.robot].chain == c
                   for c in (pair.a, pair.b))
        ]  # fmt: skip

    def segment_rows(self, segment: Segment) -> Array:
        """(k, 5) keyframes of a segment."""
        items = self.chains[segment.robot]
        return np.asarray(items.rows[items.rows_of(segment.segment)])

    def digest(self, robots: set[int]) -> int:
        """A number that two robots share when they hold the same items of these robots."""
        h = blake2b(digest_size=8)
        for robot in sorted(robots & set(self.chains)):
            items = self.chains[robot]
            h.update(repr(items.chain).encode() + np.ascontiguousarray(items.rows).tobytes())
        for pair in self.usable():
            if {pair.a.robot, pair.b.robot} <= robots:
                h.update(np.ascontiguousarray(pair.ranges).tobytes())
                h.update(repr([c.number for c in pair.kept()]).encode())
        return int.from_bytes(h.digest(), "big", signed=True)
