"""A serial port that is opened exclusively, read as it speaks, and reopened for ever."""

from __future__ import annotations

import asyncio
import errno
import os
import termios
from collections.abc import Callable
from typing import NamedTuple

import serial

from drslamd.events import Event, Port, PortCondition, PortState, SerialData
from drslamd.io.backoff import Backoff
from drslamd.io.clock import Clock
from drslamd.io.ports.readiness import has_bytes
from drslamd.io.ports.reading_round import ReadingRound

READ_BYTES = 65_536

_CONDITIONS = {
    errno.ENOENT: PortCondition.MISSING,
    errno.ENODEV: PortCondition.MISSING,
    errno.ENXIO: PortCondition.MISSING,
    errno.EACCES: PortCondition.DENIED,
    errno.EPERM: PortCondition.DENIED,
    errno.EBUSY: PortCondition.BUSY,
    errno.EAGAIN: PortCondition.BUSY,
    errno.ENOTTY: PortCondition.UNFIT,
    errno.EISDIR: PortCondition.UNFIT,
}


class PortFault(NamedTuple):
    """Why a port cannot be opened."""

    condition: PortCondition
    detail: str


def opened(path: str, baud: int) -> serial.Serial | PortFault:
    """A port of our own: nobody else who asks gets it meanwhile."""
    try:
        return serial.Serial(path, baud, timeout=0, write_timeout=0, exclusive=True)
    except OSError as error:
        # pyserial says only in words that a device takes no terminal's settings
        code = error.errno or (errno.ENOTTY if _is_of_terminals(error) else errno.EIO)
        condition = _CONDITIONS.get(code, PortCondition.LOST)
        detail = "not a serial port" if condition is PortCondition.UNFIT else os.strerror(code)
        return PortFault(condition, f"{path}: {detail}")
    except ValueError as error:
        return PortFault(PortCondition.UNFIT, f"{path}: {error}")


def _is_of_terminals(error: OSError) -> bool:
    return isinstance(error.__context__, termios.error)


def _come(descriptor: int) -> bytes | None:
    """What has come: None of a silent line, nothing at all of one that was pulled.

    Both read alike, so only then it is asked which of them it is: that takes as long as reading.
    """
    data = os.read(descriptor, READ_BYTES)
    if data or has_bytes(descriptor):
        return data or os.read(descriptor, READ_BYTES)
    return None


class SerialPort:
    """Feeds what it reads, and each change of its state, into `deliver`.

    Attributes:
        reads: how often it has read since the start.
    """

    def __init__(
        self,
        port: Port,
        path: str,
        baud: int,
        clock: Clock,
        deliver: Callable[[Event], None],
        rounds: ReadingRound | None = None,
    ) -> None:
        """
        Args:
            rounds: in which it is read; None where bytes bear no time of their own.
        """
        self._rounds = rounds
        self._port = port
        self._path = path
        self._baud = baud
        self._clock = clock
        self._deliver = deliver
        self._line: serial.Serial | None = None
        self._lost = asyncio.Event()
        self.reads = 0
        self._last_state: tuple[PortCondition, str] | None = None

    async def run(self) -> None:
        """Open, read until lost, wait, again; ends only by cancellation."""
        backoff = Backoff()
        try:
            while True:
                if self._open():
                    backoff.reset()
                    await self._lost.wait()
                    self._close()
                await backoff.wait()
        finally:
            self._close()

    def descriptor(self) -> int:
        """Of the open port, or -1."""
        return -1 if self._line is None or self._lost.is_set() else self._line.fileno()

    def counters(self) -> dict[str, int]:
        """What only a port can count; a serial line says nothing of what it lost."""
        return {}

    def write(self, data: bytes) -> None:
        """Send without waiting; what a full or dead line does not take is dropped."""
        if self._line is None:
            return
        try:
            os.write(self._line.fileno(), data)
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(error)

    def _open(self) -> bool:
        line = opened(self._path, self._baud)
        if isinstance(line, PortFault):
            self._state(*line)
            return False
        self._line = line
        self._lost.clear()
        self._state(PortCondition.OPEN, self._path)
        asyncio.get_running_loop().add_reader(line.fileno(), self._on_bytes)
        return True

    def _on_bytes(self) -> None:
        """Something has come."""
        has_read, rounds = self._read(), self._rounds
        if has_read and self._line is not None and rounds is not None and rounds.has_time():
            asyncio.get_running_loop().remove_reader(self._line.fileno())
            rounds.join(self._on_round)

    def _on_round(self) -> None:
        """A round has come, and perhaps something to read."""
        assert self._line is not None
        assert self._rounds is not None
        if self._read() and self._rounds.has_time():
            self._rounds.join(self._on_round)
        elif not self._lost.is_set():
            asyncio.get_running_loop().add_reader(self._line.fileno(), self._on_bytes)

    def _read(self) -> bool:
        """Is the port still there, and was there anything?"""
        assert self._line is not None
        self.reads += 1
        try:
            data = _come(self._line.fileno())
        except BlockingIOError:
            return False
        except OSError as error:
            self._lose(error)
            return False
        if data is None:
            return False
        if not data:
            self._lose(OSError(errno.EIO, os.strerror(errno.EIO)))
            return False
        self._deliver(SerialData(self._clock.now(), self._port, data))
        return not self._lost.is_set()

    def _lose(self, error: OSError) -> None:
        # the descriptor stays readable after a hang-up; unhook it before anything else
        if self._line is not None:
            self._unhook(self._line)
        self._state(PortCondition.LOST, f"{self._path}: {error.strerror or error}")
        self._lost.set()

    def _close(self) -> None:
        if self._line is not None:
            self._unhook(self._line)
            self._line.close()
            self._line = None

    def _unhook(self, line: serial.Serial) -> None:
        asyncio.get_running_loop().remove_reader(line.fileno())
        if self._rounds is not None:
            self._rounds.leave(self._on_round)

    def _state(self, condition: PortCondition, detail: str) -> None:
        if (condition, detail) != self._last_state:
            self._last_state = (condition, detail)
            self._deliver(PortState(self._clock.now(), self._port, condition, detail))
