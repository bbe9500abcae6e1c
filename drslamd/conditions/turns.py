"""What is said where wheels and gyro tell of different turns."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.sensors.gyro.comparison import GyroFault
from drslamd.sensors.gyro.gyro_heading import GyroHeading

MEANWHILE = "the heading comes from the wheels meanwhile"
REMEDIES = {
    GyroFault.ABSENT: "check its cable and its power",
    GyroFault.STUCK: "switch the base off and on",
    GyroFault.INVERTED: "set wheels.reverse_gyro",
    GyroFault.SCALED: "is its unit right (wheels.gyro_unit), and wheels.track_m?",
    GyroFault.BIASED: "let the robot stand for some seconds after it was switched on",
}
WRONG_TRACK = 0.1
"""So far off, as a fraction, the track is worth a word."""


def conditions(gyro: GyroHeading, utime: int) -> Iterator[tuple[str, str | None]]:
    """A key, and a sentence when something is wrong."""
    yield "gyro", _fault(gyro, utime)
    yield "wheels.slip", _slip(gyro, utime)
    yield "wheels.track", _track(gyro)


def _fault(gyro: GyroHeading, utime: int) -> str | None:
    fault = gyro.fault(utime)
    if fault is None:
        return None
    instead = "that is taken out" if gyro.is_in_use else MEANWHILE
    return f"the gyro {fault.value}; {instead}; {REMEDIES[fault]}"


def _slip(gyro: GyroHeading, utime: int) -> str | None:
    if not gyro.slips(utime):
        return None
    return (
        "the wheels slip: they turned otherwise than the gyro, whose heading counts; drive more "
        "slowly, or look at the wheels"
    )


def _track(gyro: GyroHeading) -> str | None:
    ratio = gyro.comparison.known.ratio
    if not gyro.is_in_use or abs(ratio - 1) < WRONG_TRACK:
        return None
    return (
        f"wheels.track_m should be about {ratio:.1f} times what it is: the wheels tell so much "
        "larger turns than the gyro, whose heading counts"
    )
