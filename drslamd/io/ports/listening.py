"""Listen to a serial port without a word: who is it?

A port is opened for reading alone, so the kernel itself would refuse a write: a LinkTrack
broadcasts what is written to it. Linux raises DTR and RTS whenever a port is first opened, which
resets some boards; what can be avoided is a second time. So a port stays open while speeds change,
and the lines are not dropped when it is closed.

Asking, which some bases need, is another function, and called only with a person's leave.
"""

from __future__ import annotations

import asyncio
import errno
import fcntl
import os
import termios
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

from drslamd.sensors.recognition import LINKTRACK_BAUDS, Device, Recognised, recognised
from drslamd.sensors.wheels.roboteq import RoboteqDriver

LISTEN_S = 1.2
"""At each speed; the slowest module sends once a second, and noise keeps nobody waiting."""
SILENT_SPEEDS = 2
"""Bytes come at any speed, only not the right ones; after so many silent ones nobody speaks."""
MAX_BYTES = 16_384
"""Of one speed; a team's largest frames are forty times shorter."""
ASK_S = 1.0
ASK_EVERY_S = 0.1
MICROSECONDS = 1e6
READ_BYTES = 4096

_FAULTS = {
    errno.EBUSY: "in use by another program",
    errno.EAGAIN: "in use by another program",
    errno.EACCES: "no permission; become a member of group dialout, or use sudo",
    errno.EPERM: "no permission; become a member of group dialout, or use sudo",
    errno.ENOENT: "no such port",
    errno.ENODEV: "no device behind it",
    errno.ENXIO: "no device behind it",
    errno.EIO: "no device behind it",
    errno.ENOTTY: "no serial port",
}


class Listened(NamedTuple):
    """
    Attributes:
        baud: at which it was recognised; 0 when it was not.
        fault: why nothing could be heard, empty otherwise.
    """

    who: Recognised
    baud: int = 0
    fault: str = ""


async def listen(
    path: str, bauds: Sequence[int] = LINKTRACK_BAUDS, listen_s: float = LISTEN_S
) -> Listened:
    """Who speaks there unasked; at most `listen_s` at each speed."""
    try:
        line = _opened(path, os.O_RDONLY)
    except OSError as error:
        return Listened(Recognised(Device.SILENT), fault=_fault(error))
    best = Recognised(Device.SILENT)
    try:
        for tried, baud in enumerate(bauds, 1):
            _set_speed(line, baud)
            who = recognised(await _read(line, listen_s, lambda d: recognised(d).is_certain))
            if who.is_certain:
                return Listened(who, baud)
            best = who if who.device is Device.UNKNOWN else best
            if best.device is Device.SILENT and tried >= SILENT_SPEEDS:
                break
    except OSError as error:
        return Listened(Recognised(Device.SILENT), fault=_fault(error))
    finally:
        os.close(line)
    return Listened(best)


async def answers_as_roboteq(path: str, baud: int, ask_s: float = ASK_S) -> bool:
    """Ask for counters, which moves nothing. WRITES to the port: never call it for a LinkTrack."""
    driver, loop = RoboteqDriver(1 / ASK_EVERY_S, False), asyncio.get_running_loop()
    try:
        line = _opened(path, os.O_RDWR)
    except OSError:
        return False
    try:
        _set_speed(line, baud)
        end = loop.time() + ask_s
        while loop.time() < end and not driver.tally.accepted:
            os.write(line, driver.poll(round(loop.time() * MICROSECONDS)))
            data = await _read(line, ASK_EVERY_S, lambda d: False)
            driver.feed(data, round(loop.time() * MICROSECONDS))
    except OSError:
        return False
    finally:
        os.close(line)
    return driver.tally.accepted > 0


def _opened(path: str, mode: int) -> int:
    """A descriptor that no daemon shares.

    Raises:
        OSError: there is no port, or another program has it.
    """
    line = os.open(path, mode | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        if not os.isatty(line):
            raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
        fcntl.flock(line, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(line)
        raise
    return line


def _set_speed(line: int, baud: int) -> None:
    """Raw, 8N1, without flow control; DTR and RTS stay as they are, also when it is closed.

    Raises:
        OSError: the port does not take it.
    """
    speed = getattr(termios, f"B{baud}")
    try:
        _, _, control, _, _, _, special = termios.tcgetattr(line)
        control &= ~(termios.CSIZE | termios.PARENB | termios.CSTOPB | termios.CRTSCTS)
        control &= ~termios.HUPCL
        control |= termios.CS8 | termios.CREAD | termios.CLOCAL
        # a port keeps what its last user set: with pyserial's VMIN of 0 nothing to read looks like
        # a device that is gone
        special[termios.VMIN], special[termios.VTIME] = 1, 0
        termios.tcsetattr(line, termios.TCSANOW, [0, 0, control, 0, speed, speed, special])
        termios.tcflush(line, termios.TCIFLUSH)
    except termios.error as error:
        raise OSError(*error.args) from None


async def _read(line: int, seconds: float, is_enough: Callable[[bytes], bool]) -> bytes:
    """What comes within some seconds, or until it is enough.

    Raises:
        OSError: the port is gone.
    """
    loop = asyncio.get_running_loop()
    heard, judged, ready = bytearray(), 0, asyncio.Event()
    end = loop.time() + seconds
    loop.add_reader(line, ready.set)
    try:
        while (left := end - loop.time()) > 0 and len(heard) < MAX_BYTES:
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(ready.wait(), left)
            if not ready.is_set():
                break
            ready.clear()
            with suppress(BlockingIOError):
                data = os.read(line, READ_BYTES)
                if not data:
                    raise OSError(errno.EIO, os.strerror(errno.EIO))
                heard += data
            if len(heard) >= 2 * judged:  # not over and over again, byte by byte
                judged = len(heard)
                if is_enough(bytes(heard)):
                    break
    finally:
        loop.remove_reader(line)
    return bytes(heard)


def _fault(error: OSError) -> str:
    return _FAULTS.get(error.errno or 0, error.strerror or str(error))
