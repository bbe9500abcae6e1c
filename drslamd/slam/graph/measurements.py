"""What robots tell each other about their graph; every item is keyed by who made it and when."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drslamd.conventions import Chain
from drslamd.slam.se2 import Array

MAX_PUBLIC = 4_000
"""Lifted poses remembered of one peer, 1.3 MB at rank 5; as many as keyframes of a chain."""


@dataclass(frozen=True)
class Keyframe:
    """Sample n of the odometry, whole steps."""

    n: int
    segment: int
    x: int
    y: int
    theta: int


@dataclass(frozen=True)
class RangeMeasurement:
    """One distance between two keyframes; q is the antenna in their body frames, metres."""

    a_n: int
    peer: Chain
    b_n: int
    q_a: tuple[float, float]
    q_b: tuple[float, float]
    range_m: float
    sigma_m: float


@dataclass(frozen=True)
class ClosureMeasurement:
    """One relative pose a_T_b between two keyframes, kept or withdrawn."""

    number: int
    kept: bool
    a_n: int
    peer: Chain
    b_n: int
    a_T_b: tuple[float, float, float]
    covariance: tuple[float, ...]
    """xx xy xt yy yt tt."""


@dataclass(frozen=True)
class GraphEntry:
    """One message of a robot's log."""

    seq: int
    traits: tuple[float, ...] = ()
    """Now and then: the four sigmas of `OdometryNoise`, antenna x, y, z in the body frame."""
    keyframes: tuple[Keyframe, ...] = ()
    ranges: tuple[RangeMeasurement, ...] = ()
    closures: tuple[ClosureMeasurement, ...] = ()


@dataclass(frozen=True)
class PublicPoses:
    """Lifted poses of `rbcd`: values (n + 1, 2 * rank) complex, rotation then translation.

    The first row is the pose that anchors the frame; the others belong to the keyframes.
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
            self.frame, self.frame_epoch, self.rank,
        )  # fmt: skip
        if before is None or not same:
            return self
        table = {**before.table(), **self.table()}
        keyframes = tuple(sorted(table)[-MAX_PUBLIC:])
        values = np.array([self.values[0], *(table[n] for n in keyframes)])
        return PublicPoses(self.frame, self.frame_epoch, self.rank, keyframes, values)
