"""What the configuration says of one base's wheels that a tape can tell better, and its keys."""

from __future__ import annotations

import math
from typing import Any

from drslamd.config_wheels import (
    AgilexSection,
    AsciiSection,
    DbcSection,
    KobukiSection,
    OdriveSection,
    RoboteqSection,
    WheelSection,
    WheeltecSection,
)
from drslamd.sensors.wheels import agilex

NOT_OF_THE_WHEELS = {"port", "baud", "poll_hz", "max_speed_mps", "can", "dbc_file"}
"""Keys of ``[wheels]`` that change nothing about what a metre and a turn are."""
SPEED_SIGMA = 0.01
"""Speeds are integrated over times of arrival; the way is as uncertain as this share of it."""


def has_two_sides(wheels: WheelSection) -> bool:
    """Is each wheel measured, or only what the whole base did?"""
    if isinstance(wheels, DbcSection):
        return wheels.measures != "twist"
    return not isinstance(wheels, WheeltecSection)


def step_m(wheels: WheelSection) -> float | None:
    """What one count of a wheel stands for; 0 where it is infinitely small, None for speeds."""
    if isinstance(wheels, AgilexSection):
        return 1 / agilex.COUNTS_PER_METRE
    if isinstance(wheels, OdriveSection):
        return 0.0
    if isinstance(wheels, WheeltecSection):
        return None
    if isinstance(wheels, (KobukiSection, RoboteqSection, AsciiSection)):
        return 1 / wheels.counts_per_metre
    assert isinstance(wheels, DbcSection)
    if wheels.measures != "counts" or wheels.counts_per_metre is None:
        return None
    return 1 / wheels.counts_per_metre


def path_variance(wheels: WheelSection, path_m: float) -> float:
    """Of the way of one side, m^2: two readings, each off by up to half a count."""
    step = step_m(wheels)
    return (SPEED_SIGMA * path_m) ** 2 if step is None else step**2 / 6


def scale_key(wheels: WheelSection, longer: float) -> str:
    """The key, with its value, that makes ways `longer` times what they are; empty without one."""
    if isinstance(wheels, OdriveSection):
        return f"wheels.wheel_radius_m = {_rounded(wheels.wheel_radius_m * longer)}"
    if isinstance(wheels, (KobukiSection, RoboteqSection, AsciiSection)):
        return f"wheels.counts_per_metre = {_rounded(wheels.counts_per_metre / longer)}"
    if isinstance(wheels, DbcSection) and wheels.measures == "counts":
        return f"wheels.counts_per_metre = {_rounded((wheels.counts_per_metre or 1) / longer)}"
    if isinstance(wheels, DbcSection) and wheels.unit is not None:
        return f"wheels.unit = {_rounded(wheels.unit * longer)}"
    return ""


def track_key(wheels: WheelSection, longer: float) -> str:
    """The key, with its value, that makes turns `longer` times what they are."""
    return f"wheels.track_m = {_rounded(wheels.track_m / longer)}"


def keys_instead(wheels: WheelSection, scale: float | None, turn: float | None) -> list[str]:
    """The keys, with their values, that say the same as a scale and a turn of a calibration."""
    shorter = 1 - (scale or 0.0)
    key = scale_key(wheels, shorter) if scale is not None else ""
    # what mends the counts mends turns by as much
    mended = shorter if key and has_two_sides(wheels) else 1.0
    keys = [key] if key else []
    return keys + ([track_key(wheels, (1 + turn) / mended)] if turn is not None else [])


def reverse_key(wheels: WheelSection, side: str) -> str:
    """The key, with its value, that lets a side, left or right, count the other way."""
    key = f"reverse_{side}"
    return f"wheels.{key} = {str(not getattr(wheels, key)).lower()}"


def swap_remedy(wheels: WheelSection) -> str:
    """What makes the left wheel the right one."""
    if isinstance(wheels, RoboteqSection):
        return f"set wheels.swap_channels = {str(not wheels.swap_channels).lower()}"
    if isinstance(wheels, OdriveSection):
        return (
            f"set wheels.left_axis = {wheels.right_axis} and wheels.right_axis = {wheels.left_axis}"
        )
    if isinstance(wheels, DbcSection) and not has_two_sides(wheels):
        return "turn the sign of wheels.angular in the DBC file"
    if isinstance(wheels, DbcSection):
        return "exchange wheels.left and wheels.right"
    if isinstance(wheels, AsciiSection):
        return "exchange both counters in the line that the base prints"
    return "exchange the plugs of both wheels"


def as_configured(wheels: WheelSection) -> dict[str, Any]:
    """The keys that a measurement belongs to, with their values."""
    return wheels.model_dump(exclude=NOT_OF_THE_WHEELS, exclude_none=True)


def _rounded(value: float) -> float:
    """Four digits are more than a tape gives."""
    return round(value, 3 - math.floor(math.log10(abs(value))))
