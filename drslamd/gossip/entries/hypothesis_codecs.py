"""How hypotheses fill their LCM structs, and how they are read back.

A reader raises ValueError (or IndexError) for whatever its filler could not have made.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from drslamd import lcmtypes
from drslamd.conventions import LAST_UTIME
from drslamd.gossip import bounds
from drslamd.gossip.bounds import bounded
from drslamd.gossip.message_types import MAX_MOTIONS, MAX_PLACES, Hypotheses
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, WAYS_M, DecidingMotion, Sector
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.slam.relative_pose.solver import HYPOTHESES

ROUNDING = 1e-6
"""Of shares and turns, in 32 bits."""


def fill_hypotheses(out: Any, m: Hypotheses) -> None:
    out.odom_utime, out.odom = m.odom_utime, list(m.odom)
    out.places = [_filled_place(place) for place in m.places]
    out.motions = [_filled_motion(motion) for motion in m.motions]
    out.n_places, out.n_motions = len(m.places), len(m.motions)


def _filled_place(place: PossiblePlace) -> Any:
    out: Any = lcmtypes.possible_place_t()
    out.peer, out.utime, out.share = place.peer, place.utime, place.share
    out.pose, out.covariance = list(place.pose), list(place.covariance)
    return out


def _filled_motion(motion: DecidingMotion) -> Any:
    out: Any = lcmtypes.deciding_motion_t()
    out.peer, out.mover, out.way = motion.peer, motion.mover, motion.way_m
    out.left, out.right, out.leaves = list(motion.left), list(motion.right), motion.leaves
    return out


def read_hypotheses(raw: Any) -> Hypotheses:
    bounded("places", raw.n_places, 0, MAX_PLACES)
    bounded("motions", raw.n_motions, 0, MAX_MOTIONS)
    x, y, theta = raw.odom
    said = Hypotheses(
        odom_utime=bounded("time", raw.odom_utime, 0, LAST_UTIME),
        odom=(x, y, theta),
        places=tuple(_read_place(place) for place in raw.places),
        motions=tuple(_read_motion(motion) for motion in raw.motions),
    )
    if not bounds.is_sayable(said):
        raise ValueError("pose or covariance that is none")
    return said


def _read_place(raw: Any) -> PossiblePlace:
    if not 0 <= raw.share <= 1 + ROUNDING:
        raise ValueError("share that is none")
    x, y, theta = raw.pose
    return PossiblePlace(
        bounds.robot(raw.peer),
        bounded("time", raw.utime, 0, LAST_UTIME),
        raw.share,
        (x, y, theta),
        tuple(raw.covariance),
    )


def _read_motion(raw: Any) -> DecidingMotion:
    if not 0 < raw.way <= WAYS_M[-1]:
        raise ValueError("way that is none")
    return DecidingMotion(
        bounds.robot(raw.peer),
        bounds.robot(raw.mover),
        raw.way,
        _read_sector(raw.left),
        _read_sector(raw.right),
        bounded("places left", raw.leaves, 1, HYPOTHESES),
    )


def _read_sector(raw: Sequence[float]) -> Sector:
    least, largest = raw
    if (least, largest) != NO_TURN and not 0 <= least <= largest <= math.pi + ROUNDING:
        raise ValueError("turns that are none")
    return least, largest
