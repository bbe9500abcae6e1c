"""A serial port on a pseudo-terminal: opened, read, lost, found again."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from lab.play.real_team import PseudoPort

from drslamd.events import Event, PortCondition, PortState, SerialData
from drslamd.io.clock import MonotonicClock
from drslamd.io.ports.reading_round import PERIOD_S, ReadingRound
from drslamd.io.serial_port import SerialPort, opened

Script = Callable[[PseudoPort, SerialPort, "list[Event]"], Awaitable[None]]


def with_port(
    folder: Path, script: Script, is_urgent: Callable[[], bool] | None = None
) -> list[Event]:
    """Run a script against an open port; every event that the port delivered.

    Args:
        is_urgent: of the rounds in which it is read, where it is.
    """

    async def run() -> list[Event]:
        cable = PseudoPort(folder / "tty")
        events: list[Event] = []
        rounds = ReadingRound(is_urgent) if is_urgent else None
        port = SerialPort("uwb", str(cable.name), 921_600, MonotonicClock(), events.append, rounds)
        task = asyncio.ensure_future(port.run())
        await until(lambda: len(events) > 0)
        await script(cable, port, events)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        cable.pull()
        return events

    return asyncio.run(asyncio.wait_for(run(), 20))


async def until(so: Callable[[], bool], within_s: float = 8.0) -> None:
    for _ in range(int(within_s / 0.01)):
        if so():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("not in time")


def received(events: list[Event]) -> bytes:
    return b"".join(e.data for e in events if isinstance(e, SerialData))


def conditions(events: list[Event]) -> list[PortCondition]:
    return [e.condition for e in events if isinstance(e, PortState)]


def test_all_256_byte_values_arrive_as_they_were_sent(tmp_path: Path) -> None:
    everything = bytes(range(256)) * 4

    async def script(cable: PseudoPort, _: SerialPort, events: list[Event]) -> None:
        cable.write(everything)
        await until(lambda: len(received(events)) == len(everything))

    assert received(with_port(tmp_path, script)) == everything


@pytest.mark.row("T1")
def test_bytes_are_stamped_when_they_arrive(tmp_path: Path) -> None:
    async def script(cable: PseudoPort, _: SerialPort, events: list[Event]) -> None:
        for _again in range(10):
            before = MonotonicClock().now()
            count = len(events)
            cable.write(b"x")
            await until(lambda count=count: len(events) > count)  # type: ignore[misc]
            assert 0 <= events[-1].utime - before < 200_000

    with_port(tmp_path, script)


async def spoken(cable: PseudoPort, events: list[Event]) -> list[bytes]:
    """What came of twenty bytes, one every five milliseconds, after a silence: read by read."""
    await asyncio.sleep(3 * PERIOD_S)
    count = len(events)
    for k in range(20):
        cable.write(bytes([k]))
        await asyncio.sleep(0.005)
    await until(lambda: len(received(events)) % 20 == 0 and len(events) > count)
    return [e.data for e in events[count:] if isinstance(e, SerialData)]


def test_in_rounds_a_port_is_read_a_few_times_a_second_and_at_once_after_a_silence(
    tmp_path: Path,
) -> None:
    async def script(cable: PseudoPort, _: SerialPort, events: list[Event]) -> None:
        for _again in range(2):
            first, *rest = await spoken(cable, events)
            assert len(first) < 5
            assert len(rest) <= 8

    with_port(tmp_path, script, lambda: False)


def test_while_somebody_waits_every_byte_is_read_as_it_comes(tmp_path: Path) -> None:
    waits = [True]

    async def script(cable: PseudoPort, _: SerialPort, events: list[Event]) -> None:
        at_once = await spoken(cable, events)
        waits[0] = False
        in_rounds = await spoken(cable, events)
        waits[0] = True
        again = await spoken(cable, events)
        assert len(at_once) > 2 * len(in_rounds) < len(again)

    with_port(tmp_path, script, lambda: waits[0])


def test_a_cable_that_is_pulled_between_two_rounds_is_told_and_comes_back(tmp_path: Path) -> None:
    async def script(cable: PseudoPort, _: SerialPort, events: list[Event]) -> None:
        cable.write(b"x")
        await until(lambda: received(events) == b"x")
        cable.pull()
        await until(lambda: PortCondition.LOST in conditions(events))
        cable.plug()
        await until(lambda: conditions(events)[-1] is PortCondition.OPEN)
        cable.write(b"y")
        await until(lambda: received(events) == b"xy")

    with_port(tmp_path, script, lambda: False)


def test_what_is_written_reaches_the_device(tmp_path: Path) -> None:
    asked = []

    def device(data: bytes) -> bytes:
        asked.append(data)
        return b"C=1:2\r"

    async def script(cable: PseudoPort, port: SerialPort, events: list[Event]) -> None:
        cable.answer_with(device)
        port.write(b"?C\r")
        await until(lambda: received(events) == b"C=1:2\r")

    with_port(tmp_path, script)
    assert asked == [b"?C\r"]


@pytest.mark.row("D5")
def test_a_pulled_cable_is_told_once_and_the_port_comes_back(tmp_path: Path) -> None:
    async def script(cable: PseudoPort, _: SerialPort, events: list[Event]) -> None:
        cable.pull()
        await until(lambda: PortCondition.MISSING in conditions(events))
        await asyncio.sleep(0.5)
        cable.plug()
        await until(lambda: conditions(events)[-1] is PortCondition.OPEN)
        cable.write(b"again")
        await until(lambda: received(events) == b"again")

    states = conditions(with_port(tmp_path, script))
    assert states == [
        PortCondition.OPEN,
        PortCondition.LOST,
        PortCondition.MISSING,
        PortCondition.OPEN,
    ]


@pytest.mark.row("D6")
def test_a_device_that_comes_back_under_another_number_is_found_by_its_lasting_name(
    tmp_path: Path,
) -> None:
    """ttyUSB0 is pulled and comes back as ttyUSB1; below by-id the name stays."""
    lasting = tmp_path / "by-id-of-it"

    async def run() -> list[Event]:
        first, second = PseudoPort(tmp_path / "ttyUSB0"), PseudoPort(tmp_path / "ttyUSB1")
        lasting.symlink_to(first.name)
        events: list[Event] = []
        port = SerialPort("uwb", str(lasting), 921_600, MonotonicClock(), events.append)
        task = asyncio.ensure_future(port.run())
        await until(lambda: len(events) > 0)
        first.write(b"before")
        await until(lambda: received(events) == b"before")
        first.pull()
        lasting.unlink()
        await until(lambda: PortCondition.LOST in conditions(events), 1.0)
        lasting.symlink_to(second.name)
        await until(lambda: conditions(events)[-1] is PortCondition.OPEN, 3.0)
        second.write(b"after")
        await until(lambda: received(events) == b"beforeafter", 1.0)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        second.pull()
        return events

    states = conditions(asyncio.run(asyncio.wait_for(run(), 20)))
    assert states[0] is states[-1] is PortCondition.OPEN


@pytest.mark.row("D8")
def test_a_port_that_another_program_holds_is_busy_until_it_lets_go(tmp_path: Path) -> None:
    async def run() -> None:
        cable = PseudoPort(tmp_path / "tty")
        events: list[Event] = []
        other: list[Event] = []
        path, clock = str(cable.name), MonotonicClock()
        first = asyncio.ensure_future(SerialPort("uwb", path, 9600, clock, other.append).run())
        await until(lambda: PortCondition.OPEN in conditions(other))
        second = asyncio.ensure_future(SerialPort("uwb", path, 9600, clock, events.append).run())
        await until(lambda: PortCondition.BUSY in conditions(events))
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        await until(lambda: conditions(events)[-1] is PortCondition.OPEN)
        second.cancel()
        await asyncio.gather(second, return_exceptions=True)
        cable.pull()

    asyncio.run(asyncio.wait_for(run(), 20))


@pytest.mark.row("D8")
@pytest.mark.skipif(os.getuid() == 0, reason="root may open everything")
def test_a_port_without_permission_says_so(tmp_path: Path) -> None:
    forbidden = tmp_path / "tty"
    forbidden.write_text("")
    forbidden.chmod(0)
    events = first_events(forbidden)
    assert conditions(events) == [PortCondition.DENIED]


def test_a_file_that_is_no_terminal_is_refused_with_its_name(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_text("not a tty")
    events = first_events(plain)
    assert conditions(events) == [PortCondition.UNFIT]
    assert isinstance(events[0], PortState)
    assert events[0].detail == f"{plain}: not a serial port"


def test_a_device_that_is_no_terminal_is_none_either() -> None:
    assert opened("/dev/zero", 9600) == (PortCondition.UNFIT, "/dev/zero: not a serial port")


def first_events(path: Path) -> list[Event]:
    """What a port says of a path in its first tries."""

    async def run() -> list[Event]:
        events: list[Event] = []
        port = SerialPort("uwb", str(path), 9600, MonotonicClock(), events.append)
        task = asyncio.ensure_future(port.run())
        await asyncio.sleep(0.7)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return events

    return asyncio.run(run())


@pytest.mark.row("D8")
def test_a_port_that_is_not_there_is_told_once_not_at_every_try(tmp_path: Path) -> None:
    events = first_events(tmp_path / "nothing")
    assert conditions(events) == [PortCondition.MISSING]
