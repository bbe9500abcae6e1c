"""Old keyframes are thinned, so that a graph stays bounded however long the team drives.

The last minutes keep every keyframe. Before them, each time the age doubles the keyframes stand
four times farther apart: all that is older than `recent` adds at most half as many again. What was
measured at a keyframe that goes is carried to the one before it by odometry, and is as much more
uncertain as the way was long. So later closures still move old times, as stiff pieces that grow
with their age.

Which keyframes stay follows from their numbers and the age of the newest alone: robots that hold
the same items thin them to the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ, Chain
from drslamd.slam import se2
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pose_graph import ChainData, PairData, PoseGraph
from drslamd.slam.odometry.track import covariance_between
from drslamd.slam.optimizer.problem import Index
from drslamd.slam.se2 import Array

RECENT_S = 300
"""Keyframes of the last five minutes all stay ..."""
TEAM_S = 3_000
"""... unless the team is large: this is shared among its robots."""
EVERY_S = 64
"""Thinned when the newest keyframe enters another such stretch of time."""


class Thinning:
    """Keeps one graph bounded; ask after each insertion."""

    def __init__(self, graph: PoseGraph) -> None:
        self._graph = graph
        self._done: dict[Chain, int] = {}
        """By chain: the stretch of time at which it was last thinned."""

    def after(self, robot: int) -> None:
        """Thin a chain that has grown by a stretch of time, and what was measured with it."""
        items = self._graph.chains.get(robot)
        if items is None or not len(items.rows):
            return
        stretch = int(items.rows[-1, 0]) // (EVERY_S * GRID_HZ)
        if self._done.get(items.chain) == stretch:
            return
        self._done = {key: s for key, s in self._done.items() if key.robot != robot}
        self._done[items.chain] = stretch
        stays = survivors(items, stretch * EVERY_S * GRID_HZ, recent_s(len(self._graph.chains)))
        if not stays.all():
            self._drop(items, stays)

    def _drop(self, items: ChainData, stays: NDArray[np.bool_]) -> None:
        for pair in self._graph.pairs.values():
            if pair.a == items.chain:
                _carry(pair, items, stays, own=True)
            elif pair.b == items.chain:
                _carry(pair, items, stays, own=False)
        items.keep(stays)


def recent_s(robots: int) -> int:
    """How long all keyframes stay in a team of so many robots; steps by two, rarely."""
    shares = max(1, TEAM_S // RECENT_S)
    while robots > shares:
        shares *= 2
    return TEAM_S // shares


def survivors(items: ChainData, now: int, recent: int) -> NDArray[np.bool_]:
    """Which keyframes of a chain stay at sample `now`.

    Args:
        recent: in seconds, the age up to which all stay.

    Returns:
        (k,): the first of each segment, and the first in each cell of time.
    """
    n, segment = items.n, items.rows[:, 1]
    age = (now - n) / (GRID_HZ * recent)
    level = np.where(age < 1, 0, 1 + np.floor(np.log2(np.maximum(age, 1)))).astype(int)
    cell = np.where(level > 0, n // (GRID_HZ * 4 ** np.minimum(level, 12)), n)
    first = np.ones(len(n), dtype=bool)
    first[1:] = (cell[1:] != cell[:-1]) | (level[1:] != level[:-1]) | (segment[1:] != segment[:-1])
    return first


def _carry(pair: PairData, items: ChainData, stays: NDArray[np.bool_], own: bool) -> None:
    """Take what a pair measured from the keyframes that go to those that stay."""
    anchors = np.maximum.accumulate(np.where(stays, np.arange(len(stays)), 0))
    _carry_ranges(pair, items, anchors, own)
    closures = dict(pair.closures)
    for number, (seq, closure) in closures.items():
        at, there = items.find(np.array([closure.a_n if own else closure.b_n]))
        if there[0] and not stays[at[0]]:
            pair.closures[number] = seq, _carried(closure, items, anchors, int(at[0]), own)
    seen: set[tuple[int, int]] = set()
    for number, (_, closure) in sorted(pair.closures.items()):
        if closure.kept and (closure.a_n, closure.b_n) in seen:
            del pair.closures[number]
        seen.add((closure.a_n, closure.b_n))


def _carry_ranges(pair: PairData, items: ChainData, anchors: Index, own: bool) -> None:
    table = pair.keyed_ranges.copy()
    if not len(table):
        return
    end, arm = (1, slice(3, 5)) if own else (2, slice(5, 7))
    at, there = items.find(table[:, end])
    moved = np.flatnonzero(there & (anchors[at] != at))
    body, anchor = at[moved], anchors[at[moved]]
    antenna = se2.transform(items.poses[body], table[moved, arm])
    table[moved, arm] = se2.transform(se2.inverse(items.poses[anchor]), antenna)
    table[moved, end] = items.n[anchor]
    table[moved, 8] = np.hypot(table[moved, 8], _spread(items, anchor, body, antenna))
    # of several between the same keyframes one stays: they share their slow bias
    touched = np.isin(table[:, end], items.n[np.unique(anchor)])
    _, first = np.unique(table[:, 1:3], axis=0, return_index=True)
    keep = ~touched
    keep[first] = True
    pair.replace_ranges(table[keep])


def _spread(items: ChainData, anchor: Index, body: Index, point: Array) -> Array:
    """Sigma, m, that odometry between two keyframes (m,) adds to a point (m, 2) of the body."""
    twist = covariance_between(items.noise, items.poses, items.sums, anchor, body)
    moves = np.zeros((len(point), 2, 3))
    moves[:, 0, 0] = moves[:, 1, 1] = 1.0
    moves[:, 0, 2], moves[:, 1, 2] = -point[:, 1], point[:, 0]
    place = moves @ twist @ np.swapaxes(moves, 1, 2)
    return np.asarray(np.sqrt(np.maximum(np.einsum("kii->k", place), 0.0)))


def _carried(
    closure: ClosureMeasurement, items: ChainData, anchors: Index, at: int, own: bool
) -> ClosureMeasurement:
    """A closure whose keyframe goes, at the keyframe before it."""
    anchor = int(anchors[at])
    k_T_body = se2.between(items.poses[anchor], items.poses[at])
    a_T_b = np.array(closure.a_T_b)
    moved = se2.compose(k_T_body, a_T_b) if own else se2.compose(a_T_b, se2.inverse(k_T_body))
    twist = covariance_between(items.noise, items.poses, items.sums, anchor, at)
    reach = float(np.hypot(*moved[:2])) + float(np.hypot(*items.poses[at, :2]))
    wider = np.diag([1.0, 1.0, 0.0]) * (twist[0, 0] + twist[1, 1] + reach**2 * twist[2, 2])
    wider[2, 2] = twist[2, 2]
    covariance = se2.unpacked(closure.covariance) + wider
    number = int(items.n[anchor])
    ends = {"a_n": number} if own else {"b_n": number}
    return replace(
        closure,
        a_T_b=(float(moved[0]), float(moved[1]), float(se2.wrap(moved[2]))),
        covariance=tuple(se2.packed(covariance)),
        **ends,  # type: ignore[arg-type]
    )
