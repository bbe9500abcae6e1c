"""What one pair measured, as module 3 sees it, stretch by stretch of its owner's time.

Stretches in which nothing has changed are not made again; those that have are made for all pairs
of a team at once (`thinned_pairs`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drslamd.conventions import Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pair_data import PairData
from drslamd.slam.graph.tables import ClosureTable, RangeTable
from drslamd.slam.graph.thinning.chain_view import ChainPart, ChainView
from drslamd.slam.graph.thinning.thinned_pairs import NOTHING, PairPart, Unthinned
from drslamd.slam.graph.thinning.time_cells import Kind
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

    def kept_closures(self) -> list[ClosureMeasurement]:
        """The closures one by one."""
        return self.closures.measurements(self.b)


def _joined(parts: list[Array]) -> Array:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


@dataclass
class _Made:
    """A part, and what it was made of.

    Attributes:
        models: of both robots; own: the part of a; others: the old ones of b.
        first, last: what it names of b lies between these keyframes.
    """

    part: PairPart
    models: tuple[RobotModel, RobotModel]
    own: ChainPart
    first: int
    last: int
    others: tuple[ChainPart, ...]


class PairThinning:
    """Views of one pair; parts in which nothing has changed are not made again."""

    def __init__(self) -> None:
        self._made: dict[Kind, _Made] = {}
        self._seen = (0, 0, 0)
        """Changes of ranges, closures and the chain of b when parts were last looked at."""

    def begin(
        self, pair: PairData, b_data: ChainData, a: ChainView, b: ChainView
    ) -> tuple[list[Unthinned], Callable[[list[PairPart]], PairView]]:
        """What has to be thinned for a view of the pair as it is now, and what makes the view once
        that is done.

        Args:
            b_data: of which b is the view.
        """
        before, self._made = self._made, {}
        look = _Look.of(self._seen, pair, b_data, a, b)
        said: list[Unthinned] = []
        new: list[_Made] = []
        for own in a.parts:
            made = before.get(own.stretch.kind)
            if made is None or not look.is_same(made, own):
                made, what = look.begun(own)
                if what is not None:
                    said.append(what)
                    new.append(made)
            self._made[own.stretch.kind] = made
        self._seen = look.now

        def finish(parts: list[PairPart]) -> PairView:
            for made, part in zip(new, parts, strict=True):
                made.part = part
            found = (made.part for made in self._made.values())
            return PairView(pair.a, pair.b, tuple(p for p in found if p is not NOTHING) or NONE)

        return said, finish


NONE = (NOTHING,)


@dataclass(frozen=True)
class _Look:
    """A pair as it is now, and what of it is as it was.

    Attributes:
        seen, now: changes of ranges, closures and the chain of b, then and now.
        same: before these samples of a, and of b, nothing was said since.
    """

    pair: PairData
    b_data: ChainData
    a: ChainView
    b: ChainView
    models: tuple[RobotModel, RobotModel]
    seen: tuple[int, int, int]
    now: tuple[int, int, int]
    same: tuple[int, int]

    @staticmethod
    def of(
        seen: tuple[int, int, int], pair: PairData, b_data: ChainData, a: ChainView, b: ChainView
    ) -> _Look:
        ranges, closures = pair.said_ranges, pair.said_closures
        now = ranges.changes, closures.changes, b_data.changes
        of_a = min(ranges.unchanged_before(seen[0]), closures.unchanged_before(seen[1]))
        same = of_a, b_data.unchanged_before(seen[2])
        return _Look(pair, b_data, a, b, (a.model, b.model), seen, now, same)

    def is_same(self, made: _Made, own: ChainPart) -> bool:
        """Would a part of a pair be made of the same again?"""
        if made.own is not own or made.models != self.models:
            return False
        if made.others != self.b.old_parts(made.first, made.last):
            return False
        _, first, end = own.stretch
        ranges, closures, others = self.seen
        of_a, of_b = self.same
        return (
            end <= of_a
            or (
                self.pair.said_ranges.is_same(ranges, first, end)
                and self.pair.said_closures.is_same(closures, first, end)
            )
        ) and (
            made.last < of_b
            or self.b_data.is_same(others, max(made.first, self.b.recent_n), made.last + 1)
        )

    def begun(self, own: ChainPart) -> tuple[_Made, Unthinned | None]:
        """A part that is yet to be thinned, or has nothing."""
        _, first, end = own.stretch
        ranges = RangeTable(self.pair.said_ranges.between(first, end))
        closures = ClosureTable(self.pair.said_closures.between(first, end)).kept()
        named = np.concatenate([ranges.b_n, closures.b_n])
        low, high = (int(named.min()), int(named.max())) if len(named) else (NEVER, -1)
        others = self.b.old_parts(low, high)
        made = _Made(NOTHING, self.models, own, low, high, others)
        if not len(named):
            return made, None
        robots = self.pair.a.robot, self.pair.b.robot
        return made, Unthinned(*robots, ranges, closures, (low, high))
