"""Public poses (paper III-C): all that robots exchange while they optimise by `rbcd`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from drslamd.slam.se2 import Array

MAX_PUBLIC = 4_000
"""Lifted poses remembered of one peer, 1.3 MB at rank 5; as many as keyframes of a chain."""
MAX_HELD = 64
"""Neighbours named in one message, 384 bytes; no radio cell holds more modules."""


@dataclass(frozen=True)
class PublicPoses:
    """Lifted poses of one robot: those of its keyframes that carry closures.

    Attributes:
        frame, frame_epoch: whose first pose anchors the frame.
        keyframes: n of them, ascending.
        values: (n + 1, 2 * rank) complex, rotation then translation; the first row is the pose that
            anchors the frame.
        round: number of the robot's move; these are poses after that one, 0 before the first.
        since: they are those that were said anew after this move.
        part, parts: which part of these, and of how many.
        asks: nothing is said of poses, the robot waits for neighbours.
        held: (robot, round) of these neighbours: the last move that it holds.
    """

    frame: int
    frame_epoch: int
    rank: int
    keyframes: tuple[int, ...]
    values: Array = field(compare=False)
    round: int = 1
    since: int = 0
    part: int = 0
    parts: int = 1
    asks: bool = False
    held: tuple[tuple[int, int], ...] = ()

    def is_in_frame_of(self, other: PublicPoses) -> bool:
        """Are both in one frame?"""
        return (self.frame, self.frame_epoch) == (other.frame, other.frame_epoch)

    def table(self) -> dict[int, Array]:
        """(2 * rank,) lifted pose of each keyframe."""
        return dict(zip(self.keyframes, self.values[1:], strict=True))

    def of_rank(self, rank: int) -> PublicPoses:
        """The same with other directions: new ones are zero, what lay in those that go is lost."""
        kept = min(rank, self.rank)
        values = np.zeros((len(self.values), 2 * rank), dtype=complex)
        values[:, :kept] = self.values[:, :kept]
        values[:, rank : rank + kept] = self.values[:, self.rank : self.rank + kept]
        return replace(self, rank=rank, values=values)

    def occupied(self) -> PublicPoses:
        """The same without the last directions as far as they are zero: those of planar poses,
        which descent in a plane never leaves, are one of many."""
        ends = self.values.reshape(len(self.values), 2, self.rank).any(axis=(0, 1))
        return self.of_rank(int(np.flatnonzero(ends).max(initial=0)) + 1)

    def chosen(self, keyframes: Iterable[int]) -> PublicPoses:
        """Of some of the keyframes, with the anchor."""
        wanted = set(keyframes)
        rows = [k for k, n in enumerate(self.keyframes) if n in wanted]
        values = self.values[[0, *(1 + k for k in rows)]]
        return replace(self, keyframes=tuple(self.keyframes[k] for k in rows), values=values)

    def split(self, at_once: int) -> Iterator[PublicPoses]:
        """In numbered parts of at most so many poses each, with the anchor."""
        starts = range(0, len(self.keyframes), at_once) or range(1)
        for part, first in enumerate(starts):
            keyframes = self.keyframes[first : first + at_once]
            values = np.concatenate([self.values[:1], self.values[1 + first :][: len(keyframes)]])
            yield replace(self, keyframes=keyframes, values=values, part=part, parts=len(starts))

    def after(self, before: PublicPoses | None) -> PublicPoses:
        """These poses, and those that were said before and that they do not replace."""
        if before is None or not before.is_in_frame_of(self):
            return replace(self, part=0, parts=1)
        rank = max(self.rank, before.rank)
        table = {**before.of_rank(rank).table(), **self.of_rank(rank).table()}
        keyframes = tuple(sorted(table)[-MAX_PUBLIC:])
        values = np.array([self.of_rank(rank).values[0], *(table[n] for n in keyframes)])
        return replace(self, rank=rank, keyframes=keyframes, values=values, part=0, parts=1)


class HeardPoses:
    """What one start of a peer said of its public poses.

    Attributes:
        poses: as they were after the last of its moves that is held completely; None of none.
        newest: the last of its moves that was heard of.
    """

    def __init__(self) -> None:
        self.poses: PublicPoses | None = None
        self.newest = 0
        self._parts: dict[int, PublicPoses] = {}

    @property
    def round(self) -> int:
        """The last of its moves that is held completely, 0 of none."""
        return self.poses.round if self.poses else 0

    @property
    def lacks(self) -> bool:
        """Is there a later one that is not held?"""
        return self.newest > self.round

    def take(self, message: PublicPoses) -> bool:
        """Keep a part until all of them are here; older ones come too late.

        Returns:
            is it held by this part that the peer is elsewhere now?
        """
        self.newest = max(self.newest, message.round)
        if message.asks or message.round <= self.round or message.since > self.round:
            return False
        first = next(iter(self._parts.values()), message)
        if message.round < first.round:
            return False
        if (message.round, message.since, message.parts) != (first.round, first.since, first.parts):
            self._parts = {}
        self._parts[message.part] = message
        if sum(len(part.keyframes) for part in self._parts.values()) > MAX_PUBLIC:
            self._parts = {}
        if len(self._parts) < message.parts:
            return False
        before = whole = self.poses
        for _, part in sorted(self._parts.items()):
            whole = part.after(whole)
        is_said = any(part.keyframes for part in self._parts.values())
        self.poses, self._parts = whole, {}
        # a turn may be passed on without a move
        return is_said or before is None or not before.is_in_frame_of(message)
