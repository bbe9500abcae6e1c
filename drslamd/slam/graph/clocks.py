"""How the clocks of robots differ, as their measurements say.

Both keyframes of a measurement are of one time, unless a robot stood still: then it names an old
one. So most measurements of a pair that drove say by how much its clocks differ, to some tenths of
a second. That is enough to order keyframes by time, and every robot that holds the same
measurements finds the same. How clocks really differ, to milliseconds, is not asked here
(`drslamd.gossip.peer_clock`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from drslamd.slam.graph.timed_rows import TimedRows
from drslamd.slam.se2 import Index

SAME_TIME = 20
"""Samples: the keyframes of one measurement are at most 1.5 s from it (`pair_end.NEAR_US`)."""


class Ahead(NamedTuple):
    """By how many samples the clock of b is ahead of that of a, as so many measurements say."""

    samples: float
    witnesses: int


class ClockDifferences:
    """Of one pair, counted block by block, because a block once counted rarely changes."""

    def __init__(self) -> None:
        self._counted: dict[int, tuple[Counter[int], Counter[int]]] = {}
        self._count: Counter[int] = Counter()
        self._sum: Counter[int] = Counter()
        self._changes = 0

    def take(self, table: TimedRows, column: int) -> None:
        """Count what is new in a table, and what is gone.

        Args:
            column: of its rows, where they name the keyframe of b; the first names that of a.
        """
        if table.changes == self._changes:
            return
        new, floor = table.changed_since(self._changes), table.floor
        known = self._counted
        gone = [b for b in new if b in known] + [b for b in known if b < floor]
        for block in gone:
            count, total = known.pop(block)
            self._count.subtract(count)
            self._sum.subtract(total)
            for place in [p for p in count if not self._count[p]]:
                del self._count[place], self._sum[place]
        for block in new:
            rows = table.of_block(block)
            difference = (rows[:, column] - rows[:, 0]).astype(np.int64)
            count, total = known[block] = _binned(difference)
            self._count.update(count)
            self._sum.update(total)
        self._changes = table.changes

    def together(self, other: ClockDifferences) -> Ahead | None:
        """What most measurements of two tables of one pair say; None when there are none."""
        counts = self._count + other._count
        if not counts:
            return None
        most = max(counts, key=lambda place: (counts[place], -place))
        total = self._sum[most] + other._sum[most]
        return Ahead(total / counts[most], counts[most])


def _binned(difference: Index) -> tuple[Counter[int], Counter[int]]:
    """How many of the differences (m,) are in each bin of `SAME_TIME`, and their sums."""
    bins = (difference // SAME_TIME).tolist()
    total: Counter[int] = Counter()
    for name, samples in zip(bins, difference.tolist(), strict=True):
        total[name] += samples
    return Counter(bins), total


def shifts(robots: set[int], ahead: Mapping[tuple[int, int], Ahead]) -> list[dict[int, float]]:
    """Clock of each robot minus that of the first of those with whom measurements connect it.

    Pairs with many witnesses are believed before those with few.

    Args:
        ahead: of pairs (a, b) of these robots.

    Returns:
        Samples by robot, one table for all that are connected.
    """
    # rough counts: so that two pairs that grow together do not take turns
    order = sorted(ahead, key=lambda pair: (-ahead[pair].witnesses.bit_length(), pair))
    team = {robot: {robot: 0.0} for robot in sorted(robots)}
    for a, b in order:
        one, other = team[a], team[b]
        if one is other:
            continue
        moved = one[a] + ahead[a, b].samples - other[b]
        for robot, shift in other.items():
            one[robot] = shift + moved
            team[robot] = one
    distinct = {min(table): table for table in team.values()}
    return [
        {robot: shift - table[first] for robot, shift in sorted(table.items())}
        for first, table in sorted(distinct.items())
    ]
