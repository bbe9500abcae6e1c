"""Where peers may be until one answer stands, and what would decide: numbers, and a sentence."""

from __future__ import annotations

import math
from itertools import groupby
from typing import Any

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.gossip.message_types import Hypotheses
from drslamd.slam import se2
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, WAYS_M, DecidingMotion, Sector
from drslamd.slam.hypotheses.places_left import PossiblePlace

COUNTS = ("no", "one", "two", "three", "four")
LIKELY = 0.995
"""A share above it is no longer given in per cent."""
SAME_TURN = math.radians(7.5)
"""Sectors to both sides that differ by less are one and the same."""
ALL_ROUND = math.radians(172.5)
"""A sector that ends beyond has no end."""
SIDES = (
    "ahead",
    "ahead on the left",
    "on the left",
    "behind on the left",
    "behind",
    "behind on the right",
    "on the right",
    "ahead on the right",
)
"""Eighths of a circle, counter-clockwise, the first about straight ahead."""


def rows(said: Hypotheses | None, own: int, utime: int) -> list[dict[str, Any]]:
    """One for each peer of which places are left, the nearest first.

    Args:
        said: by the robot `own`, from which lengths and angles are seen; utime: now, its clock.
    """
    if said is None:
        return []
    motions = {motion.peer: motion for motion in said.motions}
    out = []
    for peer, group in groupby(said.places, key=lambda place: place.peer):
        places, motion = list(group), motions.get(peer)
        seen = [_seen(place, said) for place in places]
        out.append(
            {
                "robot": peer,
                "age_s": round((utime - places[0].utime) / SECOND_US, 3),
                "what": sentence(peer, seen, motion, own),
                "places": seen,
                "motion": None if motion is None else _motion(motion),
            }
        )
    return out


def _seen(place: PossiblePlace, said: Hypotheses) -> dict[str, Any]:
    x, y, theta = se2.between(np.array(said.odom), np.array(place.pose)).tolist()
    spread = float(np.linalg.eigvalsh(se2.unpacked(place.covariance)[:2, :2])[-1])
    return {
        "share": round(place.share, 4),
        "x_m": round(x, 3),
        "y_m": round(y, 3),
        "theta_deg": round(math.degrees(float(se2.wrap(theta))), 2),
        "sigma_m": round(math.sqrt(max(0.0, spread)), 3),
        "sigma_deg": round(math.degrees(math.sqrt(max(0.0, place.covariance[5]))), 2),
    }


def _motion(motion: DecidingMotion) -> dict[str, Any]:
    return {
        "robot": motion.mover,
        "way_m": round(motion.way_m, 2),
        "turn_left_deg": _degrees(motion.left),
        "turn_right_deg": _degrees(motion.right),
        "leaves": motion.leaves,
    }


def _degrees(sector: Sector) -> list[int] | None:
    return None if sector == NO_TURN else [round(math.degrees(turn)) for turn in sector]


def sentence(
    peer: int, places: list[dict[str, Any]], motion: DecidingMotion | None, own: int
) -> str:
    """Where it may be, and what to do.

    Args:
        places: as in `rows`; own: the robot from which they are seen.
    """
    words = [_side(place) for place in places]
    where = [
        f"{math.hypot(place['x_m'], place['y_m']):.1f} m "
        + (word if words.count(word) == 1 else _bearing(place))
        for place, word in zip(places, words, strict=True)
    ]
    if len(places) == 1:
        return f"robot {peer} is {where[0]}, if the next windows agree"
    *first, last = (
        f"{there} ({_share(place['share'])})" for there, place in zip(where, places, strict=True)
    )
    listed = f"{', '.join(first)} or {last}"
    return f"robot {peer} is at one of {len(places)} places: {listed}; {_advice(motion, own)}"


def _side(place: dict[str, Any]) -> str:
    return SIDES[round(math.atan2(place["y_m"], place["x_m"]) / (math.pi / 4)) % len(SIDES)]


def _bearing(place: dict[str, Any]) -> str:
    """Where two are on the same side."""
    degrees = math.degrees(math.atan2(place["y_m"], place["x_m"]))
    return f"{abs(degrees):.0f} degrees to the {'left' if degrees > 0 else 'right'}"


def _share(share: float) -> str:
    if share > LIKELY:
        return "nearly sure"
    return f"{100 * share:.0f} %" if share >= 1 - LIKELY else "hardly"


def _advice(motion: DecidingMotion | None, own: int) -> str:
    if motion is None:
        return f"no straight way of up to {WAYS_M[-1]:.0f} m decides: both drive curves"
    turn = _turns(motion)
    drive = f"drive {motion.way_m:g} m"
    what = f"{turn} and {drive}" if turn else f"{drive} straight on"
    who = "" if motion.mover == own else f"let robot {motion.mover} "
    left = "" if motion.leaves == 1 else f", that leaves {COUNTS[motion.leaves]} at most"
    return f"to decide, {who}{what}{left}"


def _turns(motion: DecidingMotion) -> str:
    left, right = motion.left, motion.right
    if left[0] == right[0] == 0.0:
        return ""
    if left != NO_TURN and right != NO_TURN:
        if max(abs(a - b) for a, b in zip(left, right, strict=True)) < SAME_TURN:
            return f"turn left or right by {_by(left)}"
        return f"turn left by {_by(left)} or right by {_by(right)}"
    return f"turn left by {_by(left)}" if left != NO_TURN else f"turn right by {_by(right)}"


def _by(sector: Sector) -> str:
    least, largest = (math.degrees(turn) for turn in sector)
    if not least:
        return f"up to {largest:.0f} degrees"
    if sector[1] > ALL_ROUND:
        return f"{least:.0f} degrees or more"
    return f"{least:.0f} to {largest:.0f} degrees"
