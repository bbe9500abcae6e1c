"""A CAN bus through python-can, kept open for ever like a serial port.

python-can's own Notifier is not used: an exception in its reader ends it without a word.

Adapters raise what their authors left out: struct.error and TypeError at a frame that was cut,
ValueError at a damaged line, USB errors, ImportError where a library is missing. None of it is a
fault of ours, so all of it is caught here. A bus that raises is read on, since a damaged line is
one line; one that does nothing but raise is opened anew.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from drslamd.config import ConfigError
from drslamd.config_wheels import CanSection
from drslamd.events import CanFrame, Event, PortCondition, PortState
from drslamd.io.backoff import Backoff
from drslamd.io.clock import Clock
from drslamd.sensors.can_errors import CanErrors

if TYPE_CHECKING:
    import can

MOST_DAMAGED = 20
"""Faults without a frame between them after which a bus is taken for lost."""
PATIENCE_S = 0.2
"""How long a bus without a file descriptor is waited for at a time."""


def require_python_can() -> None:
    """
    Raises:
        ConfigError: python-can is not installed.
    """
    try:
        import can  # noqa: F401
    except ImportError:
        raise ConfigError(
            ['wheels.can: python-can is not installed; pip install "drslamd[can]"']
        ) from None


class CanBus:
    """Feeds frames, and each change of the bus's state, into `deliver`.

    Attributes:
        reads: how often it has read since the start.
        errors: what its error frames say.
    """

    def __init__(self, section: CanSection, clock: Clock, deliver: Callable[[Event], None]) -> None:
        self._section = section
        self._clock = clock
        self._deliver = deliver
        self._damaged = 0
        self._last_state: tuple[PortCondition, str] | None = None
        self._read_from = -1
        self.reads = 0
        self.errors = CanErrors(has_classes=section.interface == "socketcan")

    @property
    def name(self) -> str:
        return _name(self._section)

    def counters(self) -> dict[str, int]:
        """What only the bus can count, by flat names."""
        return self.errors.counters()

    def descriptor(self) -> int:
        """Of the open bus; -1 where it is closed or has none."""
        return self._read_from

    async def run(self) -> None:
        """Open, read until it fails, wait, again; ends only by cancellation."""
        backoff = Backoff()
        while True:
            bus = await self._open()
            if bus is not None:
                backoff.reset()
                await self._read_until_it_fails(bus)
            await backoff.wait()

    async def _open(self) -> can.BusABC | None:
        # some adapters sleep while they are set up
        bus = await asyncio.to_thread(opened, self._section)
        if isinstance(bus, str):
            self._state(PortCondition.MISSING, bus)
            return None
        self.errors.begin()
        self._state(PortCondition.OPEN, self.name)
        return bus

    async def _read_until_it_fails(self, bus: can.BusABC) -> None:
        """Deliver frames in the loop until the bus raises."""
        try:
            read = self._read_in_a_thread if _descriptor(bus) < 0 else self._read_when_ready
            error = await read(bus)
            self._state(PortCondition.LOST, f"{self.name}: {_said(error)}")
        finally:
            await asyncio.to_thread(_shut, bus)

    async def _read_when_ready(self, bus: can.BusABC) -> Exception:
        loop, descriptor = asyncio.get_running_loop(), _descriptor(bus)
        failed: asyncio.Future[Exception] = loop.create_future()

        def ready() -> None:
            self.reads += 1
            received = _receive(bus, 0.0)
            end = self._end(bus, received)
            if end is not None and not failed.done():
                failed.set_result(end)

        loop.add_reader(descriptor, ready)
        self._read_from = descriptor
        try:
            return await failed
        finally:
            self._read_from = -1
            loop.remove_reader(descriptor)

    async def _read_in_a_thread(self, bus: can.BusABC) -> Exception:
        while True:
            received = await asyncio.to_thread(_receive, bus, PATIENCE_S)
            end = self._end(bus, received)
            if end is not None:
                return end

    def _end(self, bus: can.BusABC, received: can.Message | Exception | None) -> Exception | None:
        """Deliver what came; the fault that is one too many."""
        if not isinstance(received, Exception):
            self._damaged = 0 if received is not None else self._damaged
            self._take(received)
            return None
        self._damaged += 1
        if self._damaged >= MOST_DAMAGED:
            self._damaged = 0
            return received
        _forget_the_damaged(bus)
        return None

    def _take(self, message: can.Message | None) -> None:
        if message is None or message.is_remote_frame:
            return
        utime, data, before = self._clock.now(), bytes(message.data), self.errors.trouble
        if message.is_error_frame:
            self.errors.on_error(message.arbitration_id, data, utime)
        else:
            self.errors.on_frame(utime)
        if (trouble := self.errors.trouble) != before:
            condition = PortCondition.LOST if trouble else PortCondition.OPEN
            self._state(condition, f"{self.name}: {trouble}" if trouble else self.name)
        if not message.is_error_frame:
            frame = CanFrame(utime, message.arbitration_id, message.is_extended_id, data)
            self._deliver(frame)

    def _state(self, condition: PortCondition, detail: str) -> None:
        if (condition, detail) != self._last_state:
            self._last_state = (condition, detail)
            self._deliver(PortState(self._clock.now(), "wheels", condition, detail))


def opened(section: CanSection) -> can.BusABC | str:
    """The bus, or why there is none."""
    import can

    extra: dict[str, Any] = dict(section.options)
    if section.bitrate is not None:
        extra["bitrate"] = section.bitrate
    if section.interface == "udp_multicast":
        extra.setdefault("hop_limit", 0)
    try:
        return can.Bus(section.channel, interface=section.interface, **extra)
    except Exception as error:
        return f"{_name(section)}: {_said(error)}"


def _name(section: CanSection) -> str:
    return f"{section.interface} {section.channel}"


def _receive(bus: can.BusABC, patience_s: float) -> can.Message | Exception | None:
    """One frame, nothing yet, or what ended the bus."""
    try:
        return bus.recv(patience_s)
    except Exception as error:
        return error


def _descriptor(bus: can.BusABC) -> int:
    try:
        return int(bus.fileno())
    except Exception:
        return -1


def _forget_the_damaged(bus: can.BusABC) -> None:
    """python-can's slcan keeps bytes that it cannot decode, and fails on them for ever."""
    kept = getattr(bus, "_buffer", None)
    if isinstance(kept, bytearray):
        kept.clear()


def _shut(bus: can.BusABC) -> None:
    """A bus that is lost may not let itself be closed, either."""
    with suppress(Exception):
        bus.shutdown()


def _said(error: Exception) -> str:
    """Its words, in one line, or its kind where it has none."""
    return " ".join(str(error).split()) or type(error).__name__
