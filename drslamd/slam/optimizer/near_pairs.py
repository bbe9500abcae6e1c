"""Of which pairs of a large team ranges are solved: of those that are near each other.

Each pair has a bias, and a bias is a column of the border: what a solution holds grows with all who
ever met, and that with the square of the team. So of a team with more than `MOST` pairs those count
that measure each other in times of which nothing is thinned, as many of each robot as there is room
for, those first that have done so longest. Between two steps of time (`time_cells`) others only
join them. Who is near nobody keeps the pairs that it left last, which hold its way.

What is left out says nothing, so poses are less sure, and claim no more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import is_node
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.optimizer.factors import Numbering
from drslamd.slam.optimizer.problem import RangeFactors
from drslamd.slam.se2 import Index

MOST = 1225
"""Pairs, as many as fifty robots have. With the poses of a hundred robots their columns are 130 MB
of 32 bits, with those of two hundred twice as much; the work grows with their square."""
FEW = 4
"""Pairs that hold a robot: it keeps as many, whatever those have with whom it keeps them."""

Pair = tuple[int, int]


def solvable(
    graph: PoseGraph, places: Numbering, ranges: RangeFactors, pairs: list[Pair]
) -> tuple[RangeFactors, list[Pair]]:
    """Ranges that are solved, and the pairs that their `pair` numbers; all of a small team."""
    if len(pairs) <= MOST:
        return ranges, pairs
    recent = np.zeros(len(places.n), dtype=bool)
    for robot in places.place:
        if not is_node(robot):
            mine = places.of_robot(robot)
            recent[mine] = places.n[mine] >= graph.view.chains[robot].recent_n
    stays = near_ones(ranges, len(pairs), recent, most=MOST)
    number = np.cumsum(stays) - 1
    chosen = ranges.chosen(stays[ranges.pair])
    named = [pair for pair, is_in in zip(pairs, stays.tolist(), strict=True) if is_in]
    return replace(chosen, pair=number[chosen.pair]), named


def near_ones(
    ranges: RangeFactors, pairs: int, recent: NDArray[np.bool_], most: int
) -> NDArray[np.bool_]:
    """(pairs,) which of them count.

    Args:
        recent: (k,) of which poses nothing is thinned.
        most: pairs, more or less: `FEW` of each robot beside half of those.
    """
    when = np.maximum(ranges.i, ranges.j)
    is_recent = recent[ranges.i] | recent[ranges.j]
    never = len(recent)
    first, last = np.full(pairs, never), np.full(pairs, -1)
    np.minimum.at(first, ranges.pair[is_recent], when[is_recent])
    np.maximum.at(last, ranges.pair, when)
    ends = np.zeros((pairs, 2), dtype=np.int64)
    ends[ranges.pair] = ranges.robots
    robots = int(ends.max(initial=0)) + 1
    room = max(2 * most // robots - FEW, FEW)
    is_near = first < never
    order = np.lexsort((np.where(is_near, first, -last), ~is_near))
    return _taken(ends, order[: int(np.count_nonzero(last >= 0))], is_near, robots, room)


def _taken(
    ends: Index, order: Index, is_near: NDArray[np.bool_], robots: int, room: int
) -> NDArray[np.bool_]:
    """(pairs,) one after the other, while there is room for both of them, or one has too few."""
    taken, count = np.zeros(len(ends), dtype=bool), [0] * robots
    for pair, (i, j), near in zip(
        order.tolist(), ends[order].tolist(), is_near[order].tolist(), strict=True
    ):
        has_room = near and max(count[i], count[j]) < room
        if has_room or min(count[i], count[j]) < FEW:
            taken[pair] = True
            count[i] += 1
            count[j] += 1
    return taken
