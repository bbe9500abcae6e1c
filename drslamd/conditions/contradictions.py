"""What is said where measurements contradict each other: whose, why, and what to do.

Wheels that are not mounted as configured are named with the key to set. A pose in doubt is told
with what may be the cause, and so are robots to which ranges do not fit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from drslamd.conventions import FIRST_NODE, is_node
from drslamd.slam.doubt import Doubt, Reason
from drslamd.slam.odometry.mounting import Fault, Repair
from drslamd.slam.relative_pose.mistakes.mounting_search import MountingSearch
from drslamd.slam.relative_pose.mistakes.what_if import is_learned

CHECK = {
    Fault.MIRRORED: (
        "run backwards on both sides (set wheels.reverse_left and wheels.reverse_right) or are "
        "swapped (wheels.swap_channels, or left and right in [wheels])"
    ),
    Fault.LEFT_REVERSED: "run backwards on the left (set wheels.reverse_left)",
    Fault.RIGHT_REVERSED: "run backwards on the right (set wheels.reverse_right)",
}
"""Of the wheels of a robot."""


def mounting(
    own: int, peer: int, search: MountingSearch, peer_is_odd: bool, has_learned: bool
) -> str | None:
    """One sentence on a pair; None while nothing is wrong with it.

    Args:
        peer_is_odd: do we agree with other robots?
        has_learned: does module 3 find the same track or scale?
    """
    case = search.found
    if case is None:
        if not search.is_puzzled:
            return None
        return (
            f"ranges and odometry of robots {own} and {peer} contradict each other, and no usual "
            "mistake explains it; look at the wheels and the antennas of both"
        )
    if not search.is_clear or (is_learned(case) and not has_learned):
        return None
    if case.b.fault is Fault.MIRRORED:
        whose = f"robot {peer}" if peer_is_odd else f"robot {own} or {peer}"
        return f"the wheels of {whose} {CHECK[Fault.MIRRORED]}"
    found = ((own, case.a), (peer, case.b))
    return ", ".join(_of_one(robot, repair) for robot, repair in found if repair.fault.value)


def _of_one(robot: int, repair: Repair) -> str:
    if repair.fault is Fault.TRACK:
        return (
            f"wheels.track_m of robot {robot} should be about {1 / repair.turn:.1f} times what it "
            "is; it is learned meanwhile"
        )
    if repair.fault is Fault.SCALE:
        return (
            f"the odometry of robot {robot} should be about {repair.way:.1f} times as long; set "
            "wheels.counts_per_metre (or the radius of its wheels); it is learned meanwhile"
        )
    if repair.fault is Fault.CURVE:
        side, other = ("left", "right") if repair.bend < 0 else ("right", "left")
        return (
            f"the odometry of robot {robot} turns {side} by about "
            f"{abs(math.degrees(repair.bend)):.0f} degrees a metre that it does not drive: its "
            f"{other} wheel is smaller than the {side} one, or counts too much; look at both"
        )
    return f"the wheels of robot {robot} {CHECK[repair.fault]}"


def only_place(is_mirrored: bool) -> str:
    """Why no heading of the own pose is known.

    Args:
        is_mirrored: do its wheels tell the mirror image of its way?
    """
    why = (
        f"its wheels {CHECK[Fault.MIRRORED]}, and until they are set nobody knows which"
        if is_mirrored
        else "it stands, and other robots have found it; drive a metre or two"
    )
    return f"its place is known and its heading is not: {why}"


def doubt(found: Doubt | None) -> str | None:
    """One sentence on the own pose; None while nothing speaks against it."""
    if found is None:
        return None
    if found.reason is Reason.ODOMETRY:
        return (
            f"the pose is doubtful: odometry is {_times(found.level)} as wrong as configured; "
            "the wheels slip or spin, or a counter stands; look at them, or drive more slowly"
        )
    if found.reason is Reason.SCALE:
        return (
            f"the pose is doubtful: it fits only if odometry is {_long(found.level)} and turns as "
            "configured, which no usual mistake explains; look at the wheels of both sides, their "
            "size and their counts"
        )
    if found.reason is Reason.WINDOWS:
        named = " and ".join(map(str, found.peers))
        return (
            f"the pose is doubtful: most ranges with robot {named} fit no motion that wheels of "
            "both measured; look at the wheels, or drive more slowly; is sight blocked?"
        )
    if found.reason is Reason.MOUNTINGS:
        named = " and ".join(map(str, found.peers))
        return (
            f"the pose is doubtful: ranges with robot {named} would fit better if a track width or "
            "counts per metre were others than configured; drive on, and it is learned, or measure "
            "them with drslamd calibrate"
        )
    if found.reason is Reason.REVISIONS:
        return (
            "the pose is doubtful: later measurements moved it further than was claimed; wheels "
            "slipped or stood, or sight was blocked, within the last half minute"
        )
    if len(found.peers) == 1 and not is_node(found.peers[0]):
        return (
            f"the pose is doubtful: ranges to robot {found.peers[0]} and the odometry of both do "
            "not fit; wheels of one of them slip, or sight is blocked"
        )
    peers = " and ".join(map(named_robot, found.peers))
    return (
        f"the pose is doubtful: ranges to robots {peers} do not fit the odometry of this robot; "
        "its wheels slip or stand, or its antenna is covered so that sight is blocked"
    )


def odometry(is_worse: bool) -> str | None:
    """One sentence on the own wheels, where poses are told with what they have brought."""
    if not is_worse:
        return None
    return (
        "odometry is some times as wrong as configured, and poses are less sure by as much: wheels "
        "slip now and then, of this robot or of all; drive more slowly, or raise [odometry]"
    )


def _times(level: float) -> str:
    """In few words, so that a sentence stays the same while it means the same."""
    return "over ten times" if level > 10 else "some times"


def _long(level: float) -> str:
    """In halves, likewise."""
    return f"about {round(2 * level) / 2} times as long" if level > 1 else "at most half as long"


def named_robot(number: int) -> str:
    """A robot by its number, or a module that none carries by its UWB id."""
    return f"module {number - FIRST_NODE}" if is_node(number) else str(number)


def _listed(robots: Iterable[int]) -> str:
    return " and ".join(named_robot(robot) for robot in sorted(robots))


def sight(robots: Iterable[int]) -> str | None:
    """One sentence on robots that are often out of sight; None while there are none."""
    named = _listed(robots)
    if not named:
        return None
    return (
        f"many ranges to robot {named} are too long: sight between is blocked now and then; such "
        "ranges count for little; mount antennas higher, or drive where the robots see each other"
    )


def partners(robots: Iterable[int]) -> str | None:
    """One sentence on other robots to whom ranges do not fit; None while there are none."""
    named = _listed(robots)
    if not named:
        return None
    return (
        f"ranges to robot {named} do not fit where it should be; sight between is blocked, or its "
        "wheels slip"
    )
