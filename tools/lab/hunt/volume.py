"""Many bytes in little time: malformed datagrams to a robot with a key, noise on a serial line."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drslamd.config import parse
from drslamd.events import Datagram, SerialData, Tick
from drslamd.robot import Robot
from lab.hunt.targets import HEAD, KEY, SECOND_US, WHEELS, seeds

CHUNK = 512
"""Bytes that a serial port hands over at once."""
LOOK_EVERY = 20_000


class Poured(NamedTuple):
    """How it ended.

    Attributes:
        grew_kb: by how much the process grew after the first tenth.
        accepted: messages or samples that were believed.
    """

    what: str
    many: int
    seconds: float
    grew_kb: int
    accepted: int

    @property
    def is_kept(self) -> bool:
        return not self.accepted

    def line(self) -> str:
        rate = self.many / max(self.seconds, 1e-9)
        return (
            f"{self.many:.3g} {self.what}: {self.accepted} accepted, no exception, "
            f"{self.seconds:.0f} s ({rate:.3g} a second), memory +{self.grew_kb} kB"
        )


def a_robot() -> Robot:
    return Robot(parse(HEAD + WHEELS["kobuki"]), KEY, 1, {})


def datagrams(count: int, seed: int = 0, told: Callable[[float], None] = print) -> Poured:
    """Truncated, bent, made up: none is a message of the team."""
    rng, robot, good = np.random.default_rng(seed), a_robot(), seeds()
    noise = rng.bytes(1 << 20)
    began, memory, utime = time.perf_counter(), _memory_kb(), SECOND_US
    for first in range(0, count, LOOK_EVERY):
        many = min(LOOK_EVERY, count - first)
        kinds = rng.integers(0, 5, many).tolist()
        draws = rng.integers(0, 1 << 19, (many, 2)).tolist()
        utime += 100_000
        for kind, (a, b) in zip(kinds, draws, strict=True):
            data = _malformed(kind, a, b, good, noise)
            robot.handle(Datagram(utime, data, "10.0.0.66"))
        robot.handle(Tick(utime))
        if first <= count // 10:
            memory = _memory_kb()
        told(first + many)
    grown = _memory_kb() - memory
    seconds = time.perf_counter() - began
    return Poured("malformed datagrams", count, seconds, grown, robot.team.accepted)


def _malformed(kind: int, a: int, b: int, good: list[bytes], noise: bytes) -> bytes:
    data = good[a % len(good)]
    if kind == 0:
        return data[: b % len(data)]
    if kind == 1:
        bent = bytearray(data)
        bent[8 + b % (len(data) - 8)] ^= 1 << a % 8
        return bytes(bent)
    if kind == 2:
        return noise[a : a + b % 200]
    if kind == 3:
        return data[: 8 + b % 40] + noise[a : a + b % 1500]
    return (b"LC03" if a % 2 else b"LC02") + noise[a : a + b % 1400]


def serial_bytes(count: int, seed: int = 0, told: Callable[[float], None] = print) -> Poured:
    """Noise on both serial lines of a robot, half of the bytes on each.

    A frame that fits by chance is not believed: no range comes of it, and no linked motion.
    """
    rng, robot = np.random.default_rng(seed), a_robot()
    began, memory, utime = time.perf_counter(), _memory_kb(), SECOND_US
    step = LOOK_EVERY * CHUNK // 10
    for first in range(0, count, step):
        many = min(step, count - first)
        noise = rng.bytes(many)
        for at in range(0, many, CHUNK):
            utime += 5_000
            port = "uwb" if (at // CHUNK) % 2 else "wheels"
            robot.handle(SerialData(utime, port, noise[at : at + CHUNK]))  # type: ignore[arg-type]
        if first <= count // 10:
            memory = _memory_kb()
        told(first + many)
    grown = _memory_kb() - memory
    accepted = robot.uwb.ranges.accepted + robot.wheels.base.tally.accepted
    seconds = time.perf_counter() - began
    return Poured("random serial bytes", count, seconds, grown, accepted)


def _memory_kb() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
