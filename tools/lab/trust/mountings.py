"""Mountings that the configuration does not know of, and wheels that break on the way.

A fault of the wheels is what their counters make of the ways of both wheels; `Hardware.wiring`
takes it. One robot of a team has it, another one with the next seed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.play.playback import Hardware, Wiring, equip
from lab.recordings.recording import Array, Recording, wheel_paths
from lab.trust import sensor_faults
from lab.trust.sensor_faults import EVIDENT_DEG, EVIDENT_M, Fault


@dataclass(frozen=True)
class Mounting:
    """What is wrong with a team of robots.

    Attributes:
        wiring: of one robot's wheels.
        antennas: where they really are, (x, y) m: of one robot, of the next and so on.
        onset_s: when it begins.
    """

    wiring: Wiring | None = None
    antennas: tuple[tuple[float, float], ...] = ()
    onset_s: float = 0.0

    def robots(self, seed: int, count: int) -> frozenset[int]:
        """Those at fault in a team of so many."""
        ill = len(self.antennas) or int(self.wiring is not None)
        return frozenset((seed + place) % count for place in range(min(ill, count)))

    def fault(self, seed: int, count: int) -> Fault:
        """Where the antennas of a team really are."""
        places = {(seed + k) % count: xy for k, xy in enumerate(self.antennas[:count])}
        return sensor_faults.off_axle(places, configured=False)

    def hardware(self, recording: Recording, seed: int) -> dict[int, Hardware]:
        devices = equip(recording)
        if self.wiring is not None:
            for robot in self.robots(seed, len(devices)):
                devices[robot].wiring = self.wiring
        return devices

    def evident_s(self, recording: Recording, seed: int) -> float:
        """When the wheels could be known to be wrong; infinite where the robot does not move."""
        if self.wiring is None or not self.onset_s:
            return 0.0
        (robot,) = self.robots(seed, len(recording.trails))
        device, trail = equip(recording)[robot], recording.trails[robot]
        ways = np.array(wheel_paths(trail, device.base.track_m))
        off = np.array(self.wiring(trail.t, *ways)) - ways
        off -= off[:, [int(np.searchsorted(trail.t, self.onset_s))]]
        turned = np.degrees(np.abs(off[1] - off[0])) / device.base.track_m
        wrong = (np.abs(off.mean(axis=0)) > EVIDENT_M) | (turned > EVIDENT_DEG)
        wrong &= trail.t >= self.onset_s
        return float(trail.t[wrong][0]) if wrong.any() else float("inf")


HEALTHY = Mounting()

# what counters say


def both_reversed(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
    return -left, -right


def swapped(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
    return right, left


def left_reversed(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
    return -left, right


def scaled(times: float) -> Wiring:
    """Every metre counts as so many."""
    return lambda t, left, right: (times * left, times * right)


def turning(times: float) -> Wiring:
    """Every turn counts as so many: the wheels are so many times farther apart than configured."""

    def wiring(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
        middle, half = (left + right) / 2, times * (right - left) / 2
        return middle - half, middle + half

    return wiring


def standing(since: float, until: float = np.inf) -> Wiring:
    """Counters that stand for a while, and go on from there."""

    return lambda t, left, right: (
        _held(t, left, since, until),
        _held(t, right, since, until),
    )


def left_standing(since: float) -> Wiring:
    """The counter of one side stands from then on."""
    return lambda t, left, right: (_held(t, left, since, np.inf), right)


def _held(t: Array, way: Array, since: float, until: float) -> Array:
    first, last = np.interp([since, min(until, t[-1])], t, way)
    return np.where(t < since, way, np.where(t < until, first, way - (last - first)))


def uneven(times: float) -> Wiring:
    """Every metre of the left side counts as so many: its wheel is so much smaller."""
    return lambda t, left, right: (times * left, right)


def left_spinning(since: float, until: float, speed: float) -> Wiring:
    """The left wheel has no hold: it counts more than the robot drives, by so much a second."""
    return lambda t, left, right: (left + speed * (np.clip(t, since, until) - since), right)


def spinning(since: float, until: float, speed: float) -> Wiring:
    """Both wheels turn faster than the robot drives, by so many m/s."""

    def wiring(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
        more = speed * (np.clip(t, since, until) - since)
        return left + more, right + more

    return wiring
