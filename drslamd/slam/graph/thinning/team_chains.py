"""The chains of a team side by side, as far as measurements name their keyframes.

What pairs measured is looked up and carried for all of them at once: a team of fifty has a thousand
pairs, and numpy takes as long for the few rows of one as for those of many.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import se2
from drslamd.slam.graph.thinning.chain_view import Carried, ChainView, summed_between
from drslamd.slam.odometry.noise import OdometryNoise, seen_from
from drslamd.slam.se2 import Array, Index

FAR_APART = 2**42
"""Between the numbers by which keyframes of two chains are looked for; no chain has so many."""


@dataclass(frozen=True, eq=False)
class Ends:
    """Where measurements (m,) end.

    Attributes:
        rows: of `TeamChains`; there: (m,) is that keyframe held?
    """

    rows: Index
    there: NDArray[np.bool_]

    def chosen(self, which: Index) -> Ends:
        return Ends(self.rows[which], self.there[which])


class TeamChains:
    """Rows of what some chains hold, numbered through.

    Attributes:
        chain: (r,) which of the chains each row is of.
        n: (r,) its keyframe; poses: (r, 3).
        is_old: (r,) does it lie in times that are thinned?
        near: (r,) the row that stands for it.
    """

    def __init__(self, views: Mapping[int, ChainView], spans: Mapping[int, tuple[int, int]]):
        """
        Args:
            spans: first and last keyframe of each robot that is asked for.
        """
        self._number = {robot: k for k, robot in enumerate(spans)}
        kinds: dict[OdometryNoise, int] = {}
        noise = (views[robot].model.noise for robot in spans)
        self._kind = np.array([kinds.setdefault(each, len(kinds)) for each in noise], int)
        self._kinds = list(kinds)
        parts = [views[robot].rows_about(*span) for robot, span in spans.items()]
        starts = np.cumsum([0, *(len(part.held) for part in parts)])[:-1].tolist()
        each = list(zip(parts, starts, strict=True))
        counts = [len(part.held) for part in parts]
        held = np.concatenate([np.zeros((0, 5)), *(part.held for part in parts)])
        none = np.zeros(0, dtype=np.int64)
        self.chain = np.repeat(np.arange(len(parts)), counts)
        self.n, self.poses = held[:, 0], held[:, 2:]
        self.is_old = np.concatenate([none > 0, *(part.is_old for part in parts)])
        self.near = np.concatenate([none, *(part.near + start for part, start in each)])
        self._own = np.concatenate([none, *(part.own + start for part, start in each)])
        self._steps = np.concatenate([np.zeros((0, 13)), *(part.steps for part in parts)])
        self._keys = self.chain * FAR_APART + self.n.astype(np.int64)

    def numbers(self, robots: list[int]) -> Index:
        """Which of the chains robots (k,) are."""
        return np.array([self._number[robot] for robot in robots], dtype=np.int64)

    def find(self, chain: Index, n: Array) -> Ends:
        """Keyframes n (m,) of chains (m,)."""
        wanted = chain * FAR_APART + n.astype(np.int64)
        if not len(self._keys):
            return Ends(np.zeros(len(wanted), dtype=np.int64), np.zeros(len(wanted), dtype=bool))
        rows = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        return Ends(rows, self._keys[rows] == wanted)

    def carried(self, rows: Index) -> Carried:
        """Where the bodies of rows (m,) were, seen from the keyframes that stand for them."""
        near = self.near[rows]
        is_after = rows >= near
        sums = np.zeros((len(rows), self._steps.shape[1]))
        for which, first, end in ((rows > near, near, rows), (rows < near, rows, near)):
            sums[which] = summed_between(self._steps, first[which], end[which])
        # the sums of a way are in the frame of the cell that it crosses
        before = np.flatnonzero(~is_after)
        here, start = self.poses[near], self.poses[self._own[rows[before]]]
        sums[before] = seen_from(sums[before], se2.between(here[before], start))
        return Carried(self.n[near], se2.between(here, self.poses[rows]), sums, is_after)

    def by_noise(self, rows: Index) -> list[tuple[OdometryNoise, Index]]:
        """Rows (m,) sorted by the noise of their odometry: which of them have it."""
        if len(self._kinds) == 1:
            return [(noise, np.arange(len(rows))) for noise in self._kinds]
        which = self._kind[self.chain[rows]]
        return [(noise, np.flatnonzero(which == k)) for k, noise in enumerate(self._kinds)]
