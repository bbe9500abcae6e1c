"""Devices that speak on pseudo-terminals at a speed of their own, heard wrongly at any other."""

from __future__ import annotations

import asyncio
import math
import os
import termios
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

from lab.play.emulators import (
    AsciiEmulator,
    KobukiEmulator,
    LinkTrackEmulator,
    RoboteqEmulator,
    WheelEmulator,
    as_heard_at,
)
from lab.play.real_team import PseudoPort

Result = TypeVar("Result")

EVERY_S = 0.02
STANDS_S = 0.5
"""Before wheels begin to roll."""


class SpeakingPort:
    """A cable at whose other end something speaks by itself.

    Attributes:
        written: everything that was written to the device.
    """

    def __init__(self, name: Path, says: Callable[[float], bytes], baud: int) -> None:
        self.cable = PseudoPort(name)
        self.path = str(name)
        self.written = b""
        self.answers: Callable[[bytes], bytes] = lambda asked: b""
        self._says, self._baud = says, baud

    async def speak(self) -> None:
        """Until it is cancelled."""
        self.cable.answer_with(self._hear)
        step = 0
        while True:
            said = self._says(EVERY_S * step)
            if said:
                self.cable.write(as_heard_at(said, self._baud, self.speed()))
            step += 1
            await asyncio.sleep(EVERY_S)

    def speed(self) -> int:
        """At which the host listens."""
        line = os.open(self.path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            code = termios.tcgetattr(line)[4]
        finally:
            os.close(line)
        names = [n for n in dir(termios) if n[0] == "B" and n[1:].isdecimal()]
        return next(int(n[1:]) for n in names if getattr(termios, n) == code)

    def _hear(self, asked: bytes) -> bytes:
        self.written += asked
        return self.answers(asked)


def linktrack(name: Path, uwb_id: int, baud: int = 921_600, frame: int = 2) -> SpeakingPort:
    module = LinkTrackEmulator(uwb_id, frame)
    return SpeakingPort(name, lambda t: module.frame(t, [(1, 2.5)]), baud)


def kobuki(name: Path) -> SpeakingPort:
    base = KobukiEmulator()
    return SpeakingPort(name, lambda t: base.stream(t, 0.0, 0.0), 115_200)


def ascii_base(name: Path) -> SpeakingPort:
    base = AsciiEmulator()
    return SpeakingPort(name, lambda t: base.stream(t, 0.0, 0.0), 115_200)


def roboteq(name: Path) -> SpeakingPort:
    base = RoboteqEmulator()
    port = SpeakingPort(name, lambda t: base.stream(t, 0.0, 0.0), 115_200)
    port.answers = base.answer
    return port


def while_speaking(ports: list[SpeakingPort], listen: Callable[[], Awaitable[Result]]) -> Result:
    """What somebody makes of them."""

    async def run() -> Result:
        tasks = [asyncio.ensure_future(port.speak()) for port in ports]
        try:
            return await asyncio.wait_for(listen(), 30)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            for port in ports:
                port.cable.pull()

    return asyncio.run(run())


class PushedPort(SpeakingPort):
    """A base whose wheels stand until somebody says go, roll evenly over two ways, and stand."""

    def __init__(self, name: Path, base: WheelEmulator, ways: tuple[float, float], seconds: float):
        super().__init__(name, self._stream, 115_200)
        self.answers = base.answer
        self.goes = False
        self._base, self._ways, self._seconds = base, ways, seconds
        self._begin = math.inf

    def _stream(self, t: float) -> bytes:
        if self.goes:
            self._begin = min(self._begin, t + STANDS_S)
        share = min(max((t - self._begin) / self._seconds, 0.0), 1.0)
        left, right = self._ways
        return self._base.stream(t, left * share, right * share)


def pushed(
    name: Path, base: WheelEmulator, left_m: float, right_m: float, seconds: float = 1.5
) -> PushedPort:
    """One that goes at once."""
    port = PushedPort(name, base, (left_m, right_m), seconds)
    port.goes = True
    return port
