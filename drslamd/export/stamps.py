"""Stamps of every robot's clock as UNIX time, and how wrong they may be.

A stamp goes two ways: from the clock of the robot that drove to that of the robot that was asked
(`readings` of `clock_report.clock`, straight lines between them), and from there to UTC (`wall` of
`io.wall_clock`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

DRIFT = 200e-6
"""Quartz clocks drift apart by 100 ppm and more; beyond what was read a clock may be so wrong."""
SECOND_US = 1e6


@dataclass(frozen=True)
class Stamps:
    """One robot's.

    Attributes:
        unix_us: (k,) us since 1970.
        uncertainty_s: (k,) at most so wrong, as far as the host that was asked knows UTC.
    """

    unix_us: NDArray[np.int64]
    uncertainty_s: NDArray[np.float64]


def unix_stamps(
    utime: Sequence[int], clock: Mapping[str, Any], wall: Mapping[str, Any]
) -> Stamps | None:
    """Of one robot; None when nobody knows its clock.

    Args:
        utime: (k,) us on its clock.
        clock: its clock against that of the robot that was asked.
        wall: of that robot.
    """
    readings = np.array(clock["readings"], dtype=np.float64).reshape(-1, 3)
    if not len(readings):
        return None
    told = np.array(utime, dtype=np.int64)
    there = readings[:, 0] + readings[:, 1]
    ahead = np.rint(np.interp(told, there, readings[:, 1])).astype(np.int64)
    beyond = np.maximum(np.maximum(there[0] - told, told - there[-1]), 0.0)
    own = 0.0 if clock["source"] == "own" else DRIFT
    unsure = np.interp(told, there, readings[:, 2]) + own * beyond + (wall["uncertainty_us"] or 0)
    return Stamps(told - ahead + int(wall["utc_minus_clock_us"]), unsure / SECOND_US)


def sentences(robot: str, clock: Mapping[str, Any], stamps: Stamps, wall: Mapping[str, Any]) -> str:
    """How far the stamps of a robot can be trusted, for the head of a file."""
    most = float(stamps.uncertainty_s.max(initial=0.0))
    by = "" if clock["source"] == "own" else f" by {clock['source']}"
    if wall["uncertainty_us"] is None:
        return f"robot {robot}: UNIX time, if that of the host is right, +-{most:.3f} s{by}"
    return f"robot {robot}: UNIX time, +-{most:.3f} s{by}"


def complaints(answer: Mapping[str, Any], clocks: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """What whoever compares the stamps with others must know, and what to do about it."""
    out = []
    if answer["wall"]["uncertainty_us"] is None:
        out.append(
            "nobody sets this host's wall clock, so UNIX times are as wrong as it is; start "
            "systemd-timesyncd or chrony, or export at a robot where one runs"
        )
    unknown = sorted(robot for robot, clock in clocks.items() if not clock["readings"])
    if unknown:
        out.append(
            f"the clock of robot {', '.join(unknown)} is not known here, so its path is left out; "
            "export where it is heard"
        )
    return out
