"""Public poses (paper III-C): all that robots exchange while they optimise by `rbcd`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drslamd.slam.se2 import Array

MAX_PUBLIC = 4_000
"""Lifted poses remembered of one peer, 1.3 MB at rank 5; as many as keyframes of a chain."""


@dataclass(frozen=True)
class PublicPoses:
    """Lifted poses of one robot: those of its keyframes that carry closures.

    Attributes:
        frame, frame_epoch: whose first pose anchors the frame.
        keyframes: n of them.
        values: (n + 1, 2 * rank) complex, rotation then translation; the first row is the pose that
            anchors the frame.
    """

    frame: int
    frame_epoch: int
    rank: int
    keyframes: tuple[int, ...]
    values: Array = field(compare=False)

    def table(self) -> dict[int, Array]:
        """(2 * rank,) lifted pose of each keyframe."""
        return dict(zip(self.keyframes, self.values[1:], strict=True))

    def part(self, first: int, end: int) -> PublicPoses:
        """Keyframes first .. end - 1 of these, with the anchor."""
        values = np.concatenate([self.values[:1], self.values[1 + first : 1 + end]])
        keyframes = self.keyframes[first:end]
        return PublicPoses(self.frame, self.frame_epoch, self.rank, keyframes, values)

    def after(self, before: PublicPoses | None) -> PublicPoses:
        """These poses, and those of an earlier message that they do not replace."""
        same = before is not None and (before.frame, before.frame_epoch, before.rank) == (
            self.frame,
            self.frame_epoch,
            self.rank,
        )
        if before is None or not same:
            return self
        table = {**before.table(), **self.table()}
        keyframes = tuple(sorted(table)[-MAX_PUBLIC:])
        values = np.array([self.values[0], *(table[n] for n in keyframes)])
        return PublicPoses(self.frame, self.frame_epoch, self.rank, keyframes, values)
