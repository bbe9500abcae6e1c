"""One chain as module 3 sees it: keyframes that stand for cells of time, and the ways between.

A cell that is thinned loses keyframes and no odometry: the link to the next cell is as long and as
uncertain as the way that was driven, and what was measured at a keyframe that went is carried to
the nearest one that stayed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ
from drslamd.slam import se2
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.graph.thinning.rounding import as_digested
from drslamd.slam.graph.thinning.time_cells import Kind, Stretch, stretches, with_edge
from drslamd.slam.graph.timed_rows import NEVER
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.odometry.noise import SUMS, step_sums
from drslamd.slam.se2 import Array, Index


@dataclass(frozen=True)
class ChainLinks:
    """Odometry between keyframes i (m,) and those after them, across no break.

    Attributes:
        measured: (m, 3) relative poses, scale and yaw rate left in.
        sums: (m, 13) `noise.growth` over the way that was driven, in frames i.
        by_turn: (m, 3) how `measured` moves when turns are longer by a fraction.
    """

    i: Index
    measured: Array
    sums: Array
    by_turn: Array


@dataclass(frozen=True)
class Carried:
    """Where bodies (m,) were, seen from the keyframes that stand for them.

    Attributes:
        n: (m,) those keyframes.
        keyframe_T_body: (m, 3).
        sums: (m, 13) `noise.growth` over the ways between, in the frames of the keyframes.
        is_after: (m,) was the body there after its keyframe?
    """

    n: Array
    keyframe_T_body: Array
    sums: Array
    is_after: NDArray[np.bool_]

    def chosen(self, which: Index) -> Carried:
        columns = (self.n, self.keyframe_T_body, self.sums, self.is_after)
        return Carried(*(column[which] for column in columns))


@dataclass(frozen=True, eq=False)
class ChainPart:
    """A stretch of a chain; r rows of what was said make k keyframes that stay.

    Attributes:
        held: what was said.
        stays: (k,) which rows stay.
        own: (r,) for each row, the row that begins its cell.
        near: (r,) for each row, the row that stands for it: r is that which follows the stretch.
        steps: (r, 13) `noise.step_sums` from each row to the next, in the frame of its `own`; what
            they are across a break nobody asks.
        links: between the rows `stays` and on to the next stretch, numbered as `stays` is.
    """

    stretch: Stretch
    held: KeyframeTable
    stays: Index
    own: Index
    near: Index
    steps: Array
    links: ChainLinks

    @cached_property
    def digested(self) -> tuple[bytes, ...]:
        """Keyframes that stay, and the columns of links that a digest takes."""
        links = self.links
        columns = self.held.rows[self.stays], links.measured, links.sums, links.by_turn
        return tuple(map(as_digested, columns))


def thinned(
    stretch: Stretch, rows: Array, after: Array, gyro: GyroNoise | None = None
) -> ChainPart:
    """Thin a stretch of a chain.

    Args:
        rows: (r, 5) of `KeyframeTable`; after: (0 or 1, 5) the row that follows.
        gyro: of the chain.
    """
    both = KeyframeTable(np.concatenate([rows, after]))
    n, segment, poses, count = both.n, both.segment, both.poses, len(rows)
    cell = n // (GRID_HZ * 4**stretch.level) if stretch.level else n
    is_joined = segment[1:] == segment[:-1]
    begins = np.ones(len(n), dtype=bool)
    begins[1:] = (cell[1:] != cell[:-1]) | ~is_joined
    begins[count:] = True
    stays = np.flatnonzero(begins)
    own = stays[np.cumsum(begins) - 1]
    start = poses[own[:-1]]
    here, there = se2.between(start, poses[:-1]), se2.between(start, poses[1:])
    steps, at = np.zeros((count, SUMS)), (there[:, :2] + here[:, :2]) / 2
    seconds = None if gyro is None else gyro.seconds(both.rows[:, 0], poses)
    steps[: len(there)] = step_sums(there[:, :2] - here[:, :2], at, seconds)
    last = stays[1:] - 1
    linked = np.flatnonzero(is_joined[last])
    turn = se2.wrap(there[:, 2] - here[:, 2])
    turned = np.zeros((count, 3))
    turned[: len(there)] = np.column_stack([turn, turn[:, None] * at])
    first = stays[stays < count]
    sums = np.add.reduceat(steps, first) if count else steps
    turns = np.add.reduceat(turned, first) if count else turned
    ends = there[last[linked]]
    return ChainPart(
        stretch=stretch,
        held=KeyframeTable(rows),
        stays=stays[stays < count],
        own=own[:count],
        near=_nearest(n, stays, own, is_joined)[:count],
        steps=steps,
        links=ChainLinks(linked, ends, sums[linked], _by_turn(ends, turns[linked])),
    )


def _by_turn(ends: Array, turns: Array) -> Array:
    """(m, 3) derivative of the ends (m, 3) of ways by the fraction that turns are longer.

    Args:
        turns: (m, 3) sums over the steps of a way: of their turns, and of these times where they
            were made.
    """
    turn, x, y = turns.T
    return np.stack([y - turn * ends[:, 1], turn * ends[:, 0] - x, turn], axis=-1)


def _nearest(n: Index, stays: Index, own: Index, is_joined: NDArray[np.bool_]) -> Index:
    """The row that stands for each row (r,): that which begins its cell, or the next to stay."""
    following = np.searchsorted(stays, np.arange(len(n)), side="right")
    after = stays[np.minimum(following, len(stays) - 1)]
    is_near = (following < len(stays)) & (n[after] - n < n - n[own])
    # (what precedes the very first row is never asked for)
    joined = np.append(is_joined, False)[after - 1]
    return np.asarray(np.where(is_near & joined, after, own))


class OldParts:
    """The thinned parts of a chain side by side, their rows numbered through.

    Attributes:
        end: sample after the last.
        own, near, steps: see `ChainPart`.
    """

    def __init__(self, parts: list[ChainPart]) -> None:
        self.parts = parts
        self.end = parts[-1].stretch.end if parts else 0
        starts = np.cumsum([0, *(len(part.held) for part in parts)])[:-1].tolist()
        each = list(zip(parts, starts, strict=True))
        none = np.zeros(0, dtype=np.int64)
        self.own = np.concatenate([none, *(part.own + start for part, start in each)])
        self.near = np.concatenate([none, *(part.near + start for part, start in each)])
        self.steps = np.concatenate([*(part.steps for part in parts), np.zeros((1, SUMS))])


def summed_between(steps: Array, first: Index, end: Index) -> Array:
    """(m, 13) sums of steps first .. end - 1 of (r, 13), each of one step at least.

    What is the `end` of one must be the number of a step as well.
    """
    if not len(first):
        return np.zeros((0, SUMS))
    order = np.argsort(first, kind="stable")
    ends = np.stack([first[order], end[order]], axis=-1).ravel()
    out = np.empty((len(first), SUMS))
    out[order] = np.add.reduceat(steps[: ends.max() + 1], ends)[::2]
    return out


class HeldRows(NamedTuple):
    """Some rows (r,) of what a chain holds, and all that they are seen from.

    Attributes:
        held: (r, 5) of `KeyframeTable`.
        is_old: (r,) do they lie in times that are thinned?
        own, near: (r,) of these rows, see `ChainPart`; where nothing is thinned each is its own.
        steps: (r, 13) likewise, zero there.
    """

    held: Array
    is_old: NDArray[np.bool_]
    own: Index
    near: Index
    steps: Array


class ChainView:
    """One chain, thinned.

    Attributes:
        held: keyframes that were said; model: of the robot's sensors.
        keyframes: those that stay; links: between them.
        parts: oldest first; the last one is recent and whole.
        old: those of them that are thinned; the same while nothing of them changes.
    """

    def __init__(self, data: ChainData, old: OldParts, recent: list[ChainPart]) -> None:
        self.chain, self.model, self.held = data.chain, data.model, data.keyframes
        self.old, self.parts = old, [*old.parts, *recent]
        rows = [part.held.rows[part.stays] for part in self.parts]
        starts = np.cumsum([0, *map(len, rows)])[:-1].tolist()
        self.keyframes = KeyframeTable(np.concatenate(rows))
        self.links = ChainLinks(
            np.concatenate(
                [p.links.i + start for p, start in zip(self.parts, starts, strict=True)]
            ),
            np.concatenate([part.links.measured for part in self.parts]),
            np.concatenate([part.links.sums for part in self.parts]),
            np.concatenate([part.links.by_turn for part in self.parts]),
        )

    @cached_property
    def digested(self) -> bytes:
        """What all of it is to a digest, however it is cut into parts."""
        columns = zip(*(part.digested for part in self.parts), strict=True)
        h = blake2b(digest_size=16)
        for part in (part for column in columns for part in column):
            h.update(part)
        return h.digest()

    @cached_property
    def stretches(self) -> list[Stretch]:
        """Of all parts."""
        return [part.stretch for part in self.parts]

    @property
    def recent_n(self) -> int:
        """From this sample on all keyframes stay."""
        return self.old.end

    def old_parts(self, first: int, last: int) -> tuple[ChainPart, ...]:
        """Those that samples first .. last touch."""
        parts = self.old.parts
        return tuple(p for p in parts if p.stretch.first <= last and first < p.stretch.end)

    def rows_about(self, first: int, last: int) -> HeldRows:
        """What is held of samples first .. last, and of what these are seen from."""
        old = self.old
        between = self.held.between(first, last + 1)
        low, high = between.start, between.stop
        if low < min(high, len(old.near)):
            low = int(old.own[low])
        if low < high <= len(old.near):
            high = max(high, int(old.near[high - 1]) + 1)
        end = min(high, len(old.near))
        rows = np.arange(low, high)
        own, near, steps = rows.copy(), rows.copy(), np.zeros((len(rows), SUMS))
        count = max(end - low, 0)
        own[:count], near[:count] = old.own[low:end], old.near[low:end]
        steps[:count] = old.steps[low:end]
        return HeldRows(self.held.rows[low:high], rows < end, own - low, near - low, steps)


def whole(data: ChainData) -> ChainView:
    """A chain of which nothing is thinned."""
    rows = data.keyframes.rows
    gyro = data.model.noise.gyro
    return ChainView(data, OldParts([]), [thinned(Stretch(0, 0, NEVER), rows, rows[:0], gyro)])


@dataclass
class _Made:
    """A part, and what it was made of.

    Attributes:
        changes: of the chain, when it was last seen to be the same.
        edge: segment of its first row, and the row that follows.
        span: samples whose heading a gyro gave.
    """

    part: ChainPart
    changes: int
    edge: list[float]
    span: tuple[int, int] | None


class ChainThinning:
    """Views of one chain; parts in which nothing has changed are not made again.

    Attributes:
        made: how many parts the last view took.
    """

    def __init__(self) -> None:
        self.made = 0
        self._made: dict[Kind, _Made] = {}
        self._old = OldParts([])

    def view(self, data: ChainData, step: int, recent: int) -> ChainView:
        """The chain as it is now; it has a keyframe.

        Args:
            step, recent: see `time_cells.stretches`.
        """
        parts, self.made = [], 0
        for stretch in reversed(with_edge(stretches(step, recent))):
            rows = data.keyframes.between(stretch.first, stretch.end)
            if rows.start < rows.stop:
                parts.append(self._part(data, stretch, rows))
        old = [part for part in parts if part.stretch.level]
        if old != self._old.parts:
            self._old = OldParts(old)
        return ChainView(data, self._old, parts[len(old) :])

    def _part(self, data: ChainData, stretch: Stretch, which: slice) -> ChainPart:
        rows = data.keyframes.rows[which]
        after = data.keyframes.rows[which.stop : which.stop + 1]
        # (a row in front of a part may change its segments)
        edge = [rows[0, 1], *after.ravel().tolist()]
        gyro, span = data.model.noise.gyro, data.model.noise.gyro_span
        made = self._made.get(stretch.kind)
        is_same = (
            made is not None
            and made.part.stretch == stretch
            and made.edge == edge
            and made.span == span
            and data.is_same(made.changes, stretch.first, stretch.end)
        )
        if made is None or not is_same:
            made = _Made(thinned(stretch, rows, after, gyro), 0, edge, span)
            self._made[stretch.kind] = made
            self.made += 1
        made.changes = data.changes
        return made.part
