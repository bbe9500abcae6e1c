"""The wheel odometry of one robot: from its configuration to motions of its body.

A table says which driver and which geometry belong to each section of the configuration; what a
driver reads, `WheelBase` turns into motions. `advice` puts the present trouble into one sentence
with a remedy.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from drslamd.config import OdometrySection
from drslamd.config_wheels import (
    AgilexSection,
    AsciiSection,
    DbcSection,
    GyroKeys,
    KobukiSection,
    OdriveSection,
    RoboteqSection,
    WheelSection,
    WheeltecSection,
)
from drslamd.conventions import SECOND_US
from drslamd.events import CanFrame
from drslamd.sensors.gyro.gyro_heading import GyroHeading
from drslamd.sensors.rhythm import Rhythm
from drslamd.sensors.samples import GyroAngle, GyroRate, GyroSigmas, Motion, WheelSample
from drslamd.sensors.wheels import agilex
from drslamd.sensors.wheels.agilex import AgilexDriver
from drslamd.sensors.wheels.ascii_odometry import AsciiDriver
from drslamd.sensors.wheels.dbc import DbcDriver
from drslamd.sensors.wheels.kobuki import KobukiDriver
from drslamd.sensors.wheels.odrive import OdriveDriver
from drslamd.sensors.wheels.roboteq import RoboteqDriver
from drslamd.sensors.wheels.wheel_base import DriveGeometry, Gap, ReadingRefusal, WheelBase
from drslamd.sensors.wheels.wheel_driver import (
    CanDriver,
    PolledDriver,
    SerialDriver,
    WheelRefusal,
)
from drslamd.sensors.wheels.wheeltec import WheeltecDriver

SILENCE_US: Final = SECOND_US
"""The slowest base that is any use sends twice a second."""
NO_MOTION_US: Final = 5 * SECOND_US
"""Input for this long without a motion is a finding."""


class Source(NamedTuple):
    """What a section of the configuration asks for: `per_metre` counts or turns of the driver."""

    driver: SerialDriver | CanDriver
    per_metre: float


def _kobuki(section: KobukiSection, _dbc_text: str) -> Source:
    return Source(KobukiDriver(), section.counts_per_metre)


def _roboteq(section: RoboteqSection, _dbc_text: str) -> Source:
    driver = RoboteqDriver(section.poll_hz, section.swap_channels, section.counter)
    return Source(driver, section.counts_per_metre)


def _ascii(section: AsciiSection, _dbc_text: str) -> Source:
    return Source(AsciiDriver(), section.counts_per_metre)


def _wheeltec(_section: WheeltecSection, _dbc_text: str) -> Source:
    return Source(WheeltecDriver(), 1.0)


def _odrive(section: OdriveSection, _dbc_text: str) -> Source:
    driver = OdriveDriver(section.left_axis, section.right_axis)
    return Source(driver, section.gear / (2 * math.pi * section.wheel_radius_m))


def _agilex(section: AgilexSection, _dbc_text: str) -> Source:
    base, track = section.wheelbase_m, section.track_m
    steering = agilex.Steering(base, track) if base is not None else None
    return Source(AgilexDriver(steering), agilex.COUNTS_PER_METRE)


def _dbc(section: DbcSection, dbc_text: str) -> Source:
    return Source(DbcDriver(section, dbc_text), section.counts_per_metre or 1.0)


SOURCES: Final[dict[type[WheelSection], Callable[[Any, str], Source]]] = {
    KobukiSection: _kobuki,
    RoboteqSection: _roboteq,
    AsciiSection: _ascii,
    WheeltecSection: _wheeltec,
    OdriveSection: _odrive,
    AgilexSection: _agilex,
    DbcSection: _dbc,
}


def is_stamped(section: WheelSection) -> bool:
    """Does the base send its own time with what it says?"""
    return isinstance(section, (KobukiSection, AsciiSection))


_TOO_FAST: Final = (
    "the wheels seem to move faster than wheels.max_speed_mps: are it and counts_per_metre (or "
    "unit) right?"
)
_TOO_RARE: Final = "the wheel samples come too rarely: make the base send 20 or more a second"

_NOT_FINITE: Final = (
    "the wheels send values that are not finite numbers: does the base report a fault, are the "
    "factors of its DBC file and wheels.unit right?"
)

REPEATED: Final = 3
"""So many refusals for one reason are a finding; noise is refused in fewer."""
_WRONG_LINE: Final = "are wheels.source and wheels.baud right?"
_WRONG_BUS: Final = "is this the bus of the base?"
_DAMAGES: Final = {
    WheelRefusal.CHECKSUM: "they come with wrong checksums; check the cable, below 2 m, and its "
    "shield",
    WheelRefusal.MALFORMED: "they are not of the form of the protocol; is wheels.source right, has "
    "the base another firmware?",
    WheelRefusal.SHORT: "the frames are too short; is wheels.source right, does the DBC file "
    "belong to this base?",
    WheelRefusal.NOT_AVAILABLE: "the base marks its values as not available; does it report a "
    "fault, is it switched on?",
    WheelRefusal.TIME: "the time of the base does not go on; does it restart again and again?",
}

_REMEDIES: Final[dict[Gap | ReadingRefusal | None, str]] = {
    ReadingRefusal.TOO_FAST: _TOO_FAST,
    ReadingRefusal.JUMP: _TOO_FAST,
    ReadingRefusal.NOT_FINITE: _NOT_FINITE,
    ReadingRefusal.TOO_FAR: "the wheels count more turns than a 32-bit float can tell apart: "
    "switch the base off and on",
    Gap.JUMP: _TOO_FAST,
    Gap.WRAP: _TOO_RARE,
    Gap.SILENCE: _TOO_RARE,
}


def _gyro(section: WheelSection, odometry: OdometrySection) -> GyroHeading:
    keys = section if isinstance(section, GyroKeys) else GyroKeys()
    sigmas = GyroSigmas(
        math.radians(keys.gyro_noise_deg_per_sqrt_s), math.radians(keys.gyro_bias_deg_per_h / 3600)
    )
    per_m, per_sqrt_m = odometry.yaw_sigma_deg_per_m, odometry.random_yaw_deg_per_sqrt_m
    wheels_yaw = math.radians(per_m), math.radians(per_sqrt_m)
    half_track_m = section.track_m / 2
    return GyroHeading(sigmas, wheels_yaw, half_track_m, is_reversed=keys.reverse_gyro)


class WheelInput:
    """The wheel sensor of one robot.

    Args:
        section: the ``wheels`` section of the configuration.
        dbc_text: content of its DBC file, for ``source = "dbc"``.
        odometry: how wrong its heading by wheels may be, for a gyro to be held against.

    Raises:
        ConfigError: the DBC file cannot be used with this section.

    Attributes:
        driver: the codec, with a tally of its packets, lines or frames.
        base: the kinematics, with tallies of samples and gaps.
        gyro: what becomes of the readings of its gyro, if it sends any.
        last_motion_utime: arrival of the input that gave the last motion without ``gap``.
        rhythm: how long that motion is one of now.
    """

    def __init__(
        self,
        section: WheelSection,
        dbc_text: str = "",
        odometry: OdometrySection | None = None,
    ) -> None:
        self.driver, per_metre = SOURCES[type(section)](section, dbc_text)
        self._serial = self.driver if isinstance(self.driver, SerialDriver) else None
        self._polled = self.driver if isinstance(self.driver, PolledDriver) else None
        self._can = self.driver if isinstance(self.driver, CanDriver) else None
        self.base = WheelBase(
            DriveGeometry(
                track_m=section.track_m,
                max_speed_mps=section.max_speed_mps,
                per_metre=per_metre,
                reverse_left=section.reverse_left,
                reverse_right=section.reverse_right,
            )
        )
        self.gyro = _gyro(section, odometry or OdometrySection())
        self._last_input: int | None = None
        self._trying_since = 0
        self._samples_before = 0
        self._not_finite_before = 0
        self._refused_before: dict[WheelRefusal, int] = {}
        self.last_motion_utime: int | None = None
        self.rhythm = Rhythm()

    def feed(self, data: bytes, utime: int) -> list[Motion]:
        """Motions in `data` of the serial port, which arrived at `utime` (us).

        Raises:
            TypeError: this base is on a CAN bus.
        """
        if self._serial is None:
            raise TypeError(f"{type(self.driver).__name__} reads CAN frames, not bytes")
        if data:
            self._note_input(utime)
        return self._motions(self._serial.feed(data, utime), utime)

    def on_frame(self, frame: CanFrame) -> list[Motion]:
        """Motions that a frame of the CAN bus completes.

        Raises:
            TypeError: this base is on a serial port.
        """
        if self._can is None:
            raise TypeError(f"{type(self.driver).__name__} reads bytes, not CAN frames")
        self._note_input(frame.utime)
        return self._motions(self._can.on_frame(frame), frame.utime)

    @property
    def must_be_asked(self) -> bool:
        """Does this base say nothing by itself?"""
        return self._polled is not None

    def poll(self, utime: int) -> bytes:
        """What has to be written to the serial port at `utime` (us); mostly nothing."""
        return b"" if self._polled is None else self._polled.poll(utime)

    def counters(self) -> dict[str, int]:
        """Everything that is counted, by flat names."""
        gaps = {f"gaps.{gap.name}": count for gap, count in self.base.gaps.items()}
        return {
            **self.driver.tally.counters("messages"),
            "messages.unpaired": self.driver.unpaired(),
            **self.base.tally.counters("samples"),
            **gaps,
            **(self.gyro.counters() if self.gyro.is_there else {}),
        }

    def advice(self, utime: int) -> str | None:
        """One sentence about the present trouble and its remedy, or None.

        Ask once the port has been open for some seconds: before, silence is no trouble.
        """
        return self._silence(utime) or self.driver.fault() or self._no_motion(utime)

    def _note_input(self, utime: int) -> None:
        if self._last_input is None or utime - self._last_input > SILENCE_US:
            self._trying_since = utime
        self._last_input = utime

    def _motions(self, samples: list[WheelSample], utime: int) -> list[Motion]:
        motions, is_linked = [], False
        for sample in samples:
            motion = self._motion(sample)
            if motion is not None:
                motions.append(motion)
                is_linked = is_linked or not motion.gap
        if is_linked:
            self.rhythm.add(len(motions), utime)
            refused = self.driver.tally.refused
            self.last_motion_utime = self._trying_since = utime
            self._samples_before = self.base.tally.received
            self._refused_before = dict(refused)
            self._not_finite_before = refused[WheelRefusal.NOT_FINITE]
        return motions

    def _motion(self, sample: WheelSample) -> Motion | None:
        if isinstance(sample, (GyroAngle, GyroRate)):
            self.gyro.add(sample)
            return None
        motion = self.base.add(sample)
        return motion if motion is None or not self.gyro.is_there else self.gyro.turned(motion)

    def _silence(self, utime: int) -> str | None:
        if self._last_input is None:
            return "nothing from the wheels yet: check the power of the base and the cable"
        silent_us = utime - self._last_input
        if silent_us <= SILENCE_US:
            return None
        seconds = silent_us // SECOND_US
        return f"nothing from the wheels for {seconds} s: check the power of the base and the cable"

    def _damaged(self) -> str | None:
        """What is wrong with most of what was meant for us and came to nothing."""
        refused = self.driver.tally.refused - Counter(self._refused_before)
        worst = max(_DAMAGES, key=lambda reason: refused[reason])
        return _DAMAGES[worst] if refused[worst] >= REPEATED else None

    def _no_motion(self, utime: int) -> str | None:
        if utime - self._trying_since < NO_MOTION_US:
            return None
        if self.base.tally.received > self._samples_before:
            return _REMEDIES.get(self.base.trouble, "the wheel samples make no sense")
        if why := self.driver.why_no_sample(utime):
            return why
        if self.driver.tally.refused[WheelRefusal.NOT_FINITE] > self._not_finite_before:
            return _NOT_FINITE
        seconds = (utime - self._trying_since) // SECOND_US
        remedy = _WRONG_LINE if self._serial else _WRONG_BUS
        if damaged := self._damaged():
            # (noise at a wrong rate has frames too, now and then)
            cause = f"{damaged.rstrip('?')}, {remedy}" if self._serial else damaged
            return f"input, but no usable {self.driver.expects} for {seconds} s: {cause}"
        return f"input, but no {self.driver.expects} for {seconds} s: {remedy}"
