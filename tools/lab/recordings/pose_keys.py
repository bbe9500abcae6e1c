"""Names of poses in pose graphs: whose each one is, and which comes after which.

``A12``, ``robot1_12``, ``r1:12`` and ``front-7`` are pose 12 (7) of `A`, `robot1`, `r1`, `front`;
``L`` without a number is a robot or a landmark of that name. Whole numbers from 2^56 on are those
of GTSAM, whose upper byte is the letter of the robot; smaller ones are all of one robot that has no
name.
"""

from __future__ import annotations

import re

GTSAM_BITS = 56
KEY = re.compile(r"(?P<name>.*?)(?P<gap>[_:.\-/]?)(?P<number>\d{0,18})")


def _parts(key: str) -> tuple[str, int]:
    if key.isdecimal() and len(key) < 20:
        whole = int(key)
        letter = chr(whole >> GTSAM_BITS)
        return ("", whole) if whole < 1 << GTSAM_BITS else (letter, whole % (1 << GTSAM_BITS))
    match = KEY.fullmatch(key)
    if match is None or not match["name"]:
        return key, 0
    return match["name"], int(match["number"] or 0)


def robot_of(key: str) -> str:
    """The name of its robot."""
    return _parts(key)[0]


def order_of(key: str) -> int:
    """Its number among the poses of its robot."""
    return _parts(key)[1]
