"""A recording as the bytes that modules and controllers would have sent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from drslamd.config import Config, parse
from lab.play.emulators import (
    AsciiEmulator,
    KobukiEmulator,
    LinkTrackEmulator,
    RoboteqEmulator,
    WheelEmulator,
)
from lab.recordings.recording import Array, Recording, Trail, wheel_paths

BASES: tuple[type, ...] = (KobukiEmulator, RoboteqEmulator, AsciiEmulator)

Wiring = Callable[[Array, Array, Array], tuple[Array, Array]]
"""What counters say, m, of times s and the ways of the left and the right wheel, m, (m,) each."""


@dataclass(frozen=True)
class Chunk:
    """What a device prints at time t (s); asked only then, because printing changes it."""

    t: float
    port: str
    printed: Callable[[], bytes]


class Hardware:
    """What is bolted onto one robot: a UWB module and wheels with their controller."""

    def __init__(self, recording: Recording, robot: int, base: WheelEmulator, frame: int) -> None:
        self.robot = robot
        self.base = base
        self.uwb = LinkTrackEmulator(robot, frame, power_up_s=11.0 + 7 * robot)
        self.antenna = recording.antennas.get(robot, (0.0, 0.0))
        self.antenna_z_m = 0.0
        self.wiring: Wiring = lambda t, left, right: (left, right)
        self._recording = recording
        if isinstance(base, KobukiEmulator):
            base.gyro = self.gyro_angle
        self.gyro_wiring: Callable[[float, float], float | None] = lambda t, angle: angle

    @property
    def trail(self) -> Trail:
        """Of its robot."""
        return self._recording.trails[self.robot]

    def gyro_angle(self, t: float) -> float | None:
        """What the gyro of the base says, rad; None without one."""
        trail = self._recording.trails[self.robot]
        if trail.gyro is None:
            return None
        return self.gyro_wiring(t, float(np.interp(t, trail.t, trail.gyro)))

    def uwb_chunks(self) -> Iterator[Chunk]:
        """One frame for each moment at which this module measured anything."""
        rows = self._recording.ranges
        rows = rows[rows[:, 1] == self.robot]
        moments, first = np.unique(rows[:, 0], return_index=True)
        blocks = np.split(rows, first[1:]) if len(rows) else []
        for t, block in zip(moments.tolist(), blocks, strict=True):
            ranges = [(int(peer), float(metres)) for _, _, peer, metres in block]
            yield Chunk(t, "uwb", partial(self.uwb.frame, t, ranges))

    def wheel_chunks(self) -> Iterator[Chunk]:
        """One message for each stamp of the odometry (empty where the base has to be asked)."""
        trail = self._recording.trails[self.robot]
        left, right = self.wiring(trail.t, *wheel_paths(trail, self.base.track_m))
        for t, one, other in zip(trail.t.tolist(), left.tolist(), right.tolist(), strict=True):
            yield Chunk(t, "wheels", partial(self.base.stream, t, one, other))

    def chunks(self) -> list[Chunk]:
        """Everything in the order of time."""
        return sorted([*self.uwb_chunks(), *self.wheel_chunks()], key=lambda c: c.t)


def equip(recording: Recording, varied: bool = False, frame: int = 2) -> dict[int, Hardware]:
    """Hardware for every robot; `varied` gives them different bases, in turn."""
    return {
        robot: Hardware(recording, robot, BASES[k % len(BASES) if varied else 0](), frame)
        for k, robot in enumerate(sorted(recording.trails))
    }


def robot_toml(hardware: Hardware, uwb_port: str, wheel_port: str, extra: str = "") -> str:
    """A configuration that fits the hardware; `extra` holds further sections."""
    team = "" if "[team]" in extra else "[team]\ninsecure = true\n"
    return (
        f"[robot]\nid = {hardware.robot}\n{team}"
        f'[uwb]\nport = "{uwb_port}"\nid = {hardware.uwb.uwb_id}\n'
        f"antenna_x_m = {hardware.antenna[0]}\nantenna_y_m = {hardware.antenna[1]}\n"
        f"antenna_z_m = {hardware.antenna_z_m}\n"
        f"[wheels]\n{hardware.base.config(wheel_port)}{extra}"
    )


def robot_config(hardware: Hardware, extra: str = "") -> Config:
    return parse(robot_toml(hardware, "/dev/uwb", "/dev/wheels", extra))
