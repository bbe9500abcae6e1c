"""What one pair measured, as module 3 sees it, stretch by stretch of its owner's time.

Stretches in which nothing has changed are not made again; those that have are made for all pairs
of a team at once (`thinned_pairs`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drslamd.conventions import Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.tables import ClosureTable, RangeTable
from drslamd.slam.graph.thinning.chain_view import ChainPart, ChainView, OldParts
from drslamd.slam.graph.thinning.thinned_pairs import NOTHING, PairPart, Unthinned
from drslamd.slam.graph.thinning.time_cells import Kind, Stretch
from drslamd.slam.graph.timed_rows import NEVER
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.se2 import Array


@dataclass(frozen=True, eq=False)
class PairView:
    """One pair, thinned: a is the owner's chain, b the peer's.

    Attributes:
        parts: at least one, oldest first.
    """

    a: Chain
    b: Chain
    parts: tuple[PairPart, ...]

    @cached_property
    def ranges(self) -> RangeTable:
        """Between keyframes that stay."""
        return RangeTable(_joined([part.ranges.rows for part in self.parts]))

    @cached_property
    def moves(self) -> Array:
        """(k, 2, 2, 2) m: how the antennas of the ranges, seen from the keyframes of a and of b
        (second axis), move with yaw rate (per rad/m) and scale of that robot (third axis)."""
        return _joined([part.moves for part in self.parts])

    @cached_property
    def closures(self) -> ClosureTable:
        """Between keyframes that stay."""
        return ClosureTable(_joined([part.closures.rows for part in self.parts]))

    @cached_property
    def believed(self) -> tuple[ClosureTable, bool, bool]:
        """See `believed`, of all closures."""
        return believed(self.closures)

    @cached_property
    def digested(self) -> bytes:
        """All that its parts hold."""
        return b"".join(part.digest for part in self.parts)

    def kept_closures(self) -> list[ClosureMeasurement]:
        """The closures one by one."""
        return self.closures.measurements(self.b)


def believed(closures: ClosureTable) -> tuple[ClosureTable, bool, bool]:
    """Which of closures between two segments join them: those that say a whole pose before those
    that say but a place, and of wheels as configured before any that turn the other way. Do they
    say a place only, and were they found with b turning the other way?"""
    place_only, mirrored = closures.tells_place_only, closures.is_mirrored
    kinds = (~place_only & ~mirrored, ~place_only, np.ones(len(closures), dtype=bool))
    best = next(kind for kind in kinds if kind.any())
    found = closures if best.all() else closures.chosen(best)
    says_pose, is_mirrored = not place_only[best].any(), bool(mirrored[best].all())
    return found, not says_pose, says_pose and is_mirrored


def _joined(parts: list[Array]) -> Array:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


@dataclass
class _Made:
    """A part, and what it was made of.

    Attributes:
        models: of both robots; own: the part of a; others: the old ones of b.
        of_a, of_b: the first and the last keyframe of each that it names.
    """

    part: PairPart
    models: tuple[RobotModel, RobotModel]
    own: ChainPart
    of_a: tuple[int, int]
    of_b: tuple[int, int]
    others: tuple[ChainPart, ...]


class PairThinning:
    """Views of one pair; parts in which nothing has changed are not made again."""

    def __init__(self) -> None:
        self._made: dict[Kind, _Made] = {}
        self._view: PairView | None = None
        self._seen = Changes()
        self._last: Within | None = None

    def begin(
        self, pair: PairData, data: tuple[ChainData, ChainData], a: ChainView, b: ChainView
    ) -> tuple[list[Unthinned], Callable[[list[PairPart]], PairView]]:
        """What has to be thinned for a view of the pair as it is now, and what makes the view once
        that is done.

        Args:
            data: of both chains, of which a and b are the views.
        """
        look = _Look.of(self._seen, pair, data, a, b)
        view = self._view
        if view is not None and look.is_all_the_same(self._last, self._made.values()):
            self._seen, self._last = look.now, look.within
            # (or a part would hold a table of long ago)
            for part, own in zip(self._made.values(), a.parts, strict=True):
                part.own = own
            return [], lambda _: view
        before, self._made = self._made, {}
        said: list[Unthinned] = []
        new: list[_Made] = []
        for own in a.parts:
            made = before.get(own.stretch.kind)
            if made is None or not look.is_same(made, own):
                made, what = look.begun(own)
                if what is not None:
                    said.append(what)
                    new.append(made)
            made.own = own
            self._made[own.stretch.kind] = made
        self._seen, self._last = look.now, look.within

        def finish(parts: list[PairPart]) -> PairView:
            for made, part in zip(new, parts, strict=True):
                made.part = part
            every = (made.part for made in self._made.values())
            found = tuple(part for part in every if part is not NOTHING) or NONE
            if self._view is None or self._view.parts != found:
                self._view = PairView(pair.a, pair.b, found)
            return self._view

        return said, finish


NONE = (NOTHING,)


class Changes(NamedTuple):
    """So many of ranges, closures and both chains when a pair was looked at."""

    ranges: int = 0
    closures: int = 0
    a: int = 0
    b: int = 0


class Within(NamedTuple):
    """What the parts of a pair are made within, the same while nothing old changes.

    Attributes:
        models: of both robots; old: what is thinned of both chains.
        stretches: of a.
    """

    models: tuple[RobotModel, RobotModel]
    old: tuple[OldParts, OldParts]
    stretches: list[Stretch]


@dataclass(frozen=True)
class _Look:
    """A pair as it is now, and what of it is as it was.

    Attributes:
        data: of both chains.
        seen, now: changes then and now.
        same: before these samples of a, and of b, nothing was said since.
    """

    pair: PairData
    data: tuple[ChainData, ChainData]
    b: ChainView
    within: Within
    seen: Changes
    now: Changes
    same: tuple[int, int]

    @staticmethod
    def of(
        seen: Changes,
        pair: PairData,
        data: tuple[ChainData, ChainData],
        a: ChainView,
        b: ChainView,
    ) -> _Look:
        ranges, closures = pair.said_ranges, pair.said_closures
        now = Changes(ranges.changes, closures.changes, *(chain.changes for chain in data))
        of_a = min(ranges.unchanged_before(seen.ranges), closures.unchanged_before(seen.closures))
        same = of_a, data[1].unchanged_before(seen.b)
        within = Within((a.model, b.model), (a.old, b.old), a.stretches)
        return _Look(pair, data, b, within, seen, now, same)

    def is_all_the_same(self, last: Within | None, made: Iterable[_Made]) -> bool:
        """Would every part of the pair be made of the same again? Of most pairs of a large team,
        which are out of reach."""
        if self.seen[:2] != self.now[:2] or self.within != last:
            return False
        of_a, of_b = self.data[0].unchanged_before(self.seen.a), self.same[1]
        return all(part.of_a[1] < of_a and part.of_b[1] < of_b for part in made)

    def is_same(self, made: _Made, own: ChainPart) -> bool:
        """Would a part of a pair be made of the same again?"""
        if made.models != self.within.models or not self._is_own(made, own):
            return False
        if made.others != self.b.old_parts(*made.of_b):
            return False
        _, first, end = own.stretch
        of_a, of_b = self.same
        (low, high), seen = made.of_b, self.seen
        return (
            end <= of_a
            or (
                self.pair.said_ranges.is_same(seen.ranges, first, end)
                and self.pair.said_closures.is_same(seen.closures, first, end)
            )
        ) and (high < of_b or self.data[1].is_same(seen.b, max(low, self.b.recent_n), high + 1))

    def _is_own(self, made: _Made, own: ChainPart) -> bool:
        """Is the part of a what it was? Where all keyframes stay it grows each second, and what was
        measured asks only for those that it names."""
        if made.own is own:
            return True
        if own.stretch.level or own.stretch != made.own.stretch:
            return False
        low, high = made.of_a
        return self.data[0].is_same(self.seen.a, low, high + 1)

    def begun(self, own: ChainPart) -> tuple[_Made, Unthinned | None]:
        """A part that is yet to be thinned, or has nothing."""
        _, first, end = own.stretch
        ranges = RangeTable(self.pair.said_ranges.between(first, end))
        closures = ClosureTable(self.pair.said_closures.between(first, end)).kept()
        of_a, of_b = _named(ranges.a_n, closures.a_n), _named(ranges.b_n, closures.b_n)
        others = self.b.old_parts(*of_b)
        made = _Made(NOTHING, self.within.models, own, of_a, of_b, others)
        if of_a == NOBODY:
            return made, None
        robots = self.pair.a.robot, self.pair.b.robot
        return made, Unthinned(*robots, ranges, closures, of_a, of_b, own.stretch.level > 0)


NOBODY = NEVER, -1


def _named(*tables: Array) -> tuple[int, int]:
    """The first and the last of keyframes."""
    n = np.concatenate(tables)
    return (int(n.min()), int(n.max())) if len(n) else NOBODY
