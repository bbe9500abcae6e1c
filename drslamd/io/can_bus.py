"""A CAN bus through python-can, kept open for ever like a serial port."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from drslamd.config import CanSection, ConfigError
from drslamd.events import CanFrame, Event, PortCondition, PortState
from drslamd.io.backoff import Backoff
from drslamd.io.clock import Clock

if TYPE_CHECKING:
    import can

CHECK_S = 0.5
"""How often a bus is asked whether its reader still lives (python-can ends it in silence)."""


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
    """Feeds frames, and each change of the bus's state, into `deliver`."""

    def __init__(self, section: CanSection, clock: Clock, deliver: Callable[[Event], None]) -> None:
        self._section = section
        self._clock = clock
        self._deliver = deliver
        self._last_state: tuple[PortCondition, str] | None = None

    @property
    def name(self) -> str:
        return f"{self._section.interface} {self._section.channel}"

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
        import can

        extra: dict[str, Any] = {}
        if self._section.bitrate is not None:
            extra["bitrate"] = self._section.bitrate
        if self._section.interface == "udp_multicast":
            extra["hop_limit"] = 0
        try:
            # some adapters sleep while they are set up
            bus = await asyncio.to_thread(
                can.Bus, self._section.channel, interface=self._section.interface, **extra
            )
        except (can.CanError, OSError, ValueError) as error:
            self._state(PortCondition.MISSING, f"{self.name}: {error}")
            return None
        self._state(PortCondition.OPEN, self.name)
        return bus

    async def _read_until_it_fails(self, bus: can.BusABC) -> None:
        import can

        notifier = can.Notifier(bus, [self._frame], timeout=0.2, loop=asyncio.get_running_loop())
        try:
            while notifier.exception is None:
                await asyncio.sleep(CHECK_S)
            self._state(PortCondition.LOST, f"{self.name}: {notifier.exception}")
        finally:
            await asyncio.to_thread(notifier.stop)
            await asyncio.to_thread(bus.shutdown)

    def _frame(self, message: can.Message) -> None:
        if message.is_error_frame or message.is_remote_frame:
            return
        self._deliver(
            CanFrame(
                self._clock.now(),
                message.arbitration_id,
                message.is_extended_id,
                bytes(message.data),
            )
        )

    def _state(self, condition: PortCondition, detail: str) -> None:
        if (condition, detail) != self._last_state:
            self._last_state = (condition, detail)
            self._deliver(PortState(self._clock.now(), "wheels", condition, detail))
