"""What people get wrong when they mount and configure wheels, and what makes odometry right again.

A counter says how far each side went. A side that counts backwards, sides that are swapped, a wrong
track and a wrong number of counts per metre each change way d and turn t of a step as one matrix,
with h half of the track:

    d' = way d + cross h t        t' = turn t + cross d / h + bend |d|

Wheels that both run backwards and sides that are swapped give the same path, mirrored, once from
the front and once from the back of the robot. Ranges do not tell which.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.se2 import Array


class Fault(Enum):
    """Of one robot's wheels."""

    NONE = ""
    MIRRORED = "mirrored"
    LEFT_REVERSED = "left reversed"
    RIGHT_REVERSED = "right reversed"
    TRACK = "track"
    SCALE = "scale"
    CURVE = "curve"


LEARNED = (Fault.TRACK, Fault.SCALE)
"""Faults that module 3 learns once it is close."""
CORRECTED = (*LEARNED, Fault.MIRRORED)
"""Faults that are taken out of a way that was already told, of which keyframes are left."""


FINER = 1.06
"""Odometry that is wrong by half of that is right enough for windows of a minute."""
FACTORS = (1.0, 1 / FINER, FINER)


class Repair(NamedTuple):
    """What makes the odometry of one robot right (see above), if it has this fault."""

    fault: Fault = Fault.NONE
    way: float = 1.0
    turn: float = 1.0
    cross: float = 0.0
    bend: float = 0.0

    def variants(self) -> tuple[Repair, ...]:
        """The same, way and turn a little more or less; of what has no factor only itself."""
        if self.fault not in LEARNED:
            return (self,)
        return tuple(
            self._replace(way=self.way * way, turn=self.turn * turn)
            for way in FACTORS
            for turn in FACTORS
        )

    def alike(self) -> tuple[Repair, ...]:
        """The tracks and the scales that turn as much, a little more or less: windows hardly tell
        one from the other; of what has no factor none."""
        if self.fault not in LEARNED:
            return ()
        turns = [self.turn * factor for factor in FACTORS]
        tracks = [Repair(Fault.TRACK, turn=turn) for turn in turns]
        return (*tracks, *(Repair(Fault.SCALE, turn, turn) for turn in turns))


def paths(repairs: Sequence[Repair], poses: Array, half_track_m: float) -> Array:
    """(r, k, 3) of a 10 Hz track o_T_i, as each repair (r) has it, from its first pose on.

    Args:
        half_track_m: only where `cross` is not 0.
    """
    step = se2.between(poses[:-1], poses[1:])
    turn = se2.wrap(step[:, 2])
    along = se2.rotate(-turn / 2, step[:, :2])
    gone = along[:, 0] / _chord(turn)
    way, turned, cross, bend = np.array([repair[1:] for repair in repairs]).T[..., None]
    by_turn = cross * half_track_m
    by_way = np.divide(cross, half_track_m, out=np.zeros_like(cross), where=cross != 0)
    d = way * gone + by_turn * turn
    t = turned * turn + by_way * gone + bend * np.abs(gone)
    chord = np.stack([d * _chord(t), way * along[:, 1]], axis=-1)
    out = np.empty((len(repairs), len(poses), 3))
    out[:, 0], out[:, 1:, 2] = poses[0], poses[0, 2] + np.cumsum(t, axis=1)
    moved = np.cumsum(se2.rotate(out[:, :-1, 2] + t / 2, chord), axis=1)
    out[:, 1:, :2] = poses[0, :2] + moved
    return out


def _chord(turn: Array) -> Array:
    """Of an arc of length 1."""
    return np.asarray(np.sinc(turn / (2 * np.pi)))


AS_CONFIGURED = Repair()
MIRRORED = Repair(Fault.MIRRORED, turn=-1.0)
SIDES = (
    Repair(Fault.LEFT_REVERSED, way=0.0, turn=0.0, cross=1.0),
    Repair(Fault.RIGHT_REVERSED, way=0.0, turn=0.0, cross=-1.0),
)
TRACKS = tuple(Repair(Fault.TRACK, turn=k) for k in (0.67, 0.8, 1.25, 1.5))
"""What lies between is found by `Repair.variants`."""
SCALES = tuple(Repair(Fault.SCALE, k, k) for k in (0.5, 0.58, 0.67, 0.8, 1.25, 1.5, 1.73, 2.0))
"""See `TRACKS`; all counts are wrong by the same factor, those of turns too."""
COARSE_SCALES = SCALES[::2]
"""Of a whole team that was configured from one file."""
LEAST_BEND = math.radians(4.0)
"""rad/m. A wheel a tenth larger than the other, 0.3 m beside it, makes five times as much."""
CURVES = tuple(
    Repair(Fault.CURVE, bend=k * LEAST_BEND) for k in (-9, -6, -4, -2, -1, 1, 2, 4, 6, 9)
)
"""One wheel is larger than the other, by up to a seventh on a base as narrow as 0.23 m: where no
such case is near, wheels that run backwards fit best, and would be named. Backwards they turn the
same way, as module 3 has it."""
