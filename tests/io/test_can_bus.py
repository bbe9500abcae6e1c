"""CAN through python-can: in one process on `virtual`, across sockets on `udp_multicast`."""

from __future__ import annotations

import asyncio
import os
import socket
import struct
import time
import tty
from collections.abc import Callable
from typing import Any

import pytest
from machine_speed import allowed_s
from places import Recorded

can = pytest.importorskip("can", reason="python-can is not installed")

from drslamd.config_wheels import AgilexSection, CanSection, OdriveSection  # noqa: E402
from drslamd.events import CanFrame, Event, PortCondition, PortState  # noqa: E402
from drslamd.io.can_bus import MOST_DAMAGED, CanBus, opened  # noqa: E402
from drslamd.io.clock import MonotonicClock  # noqa: E402
from drslamd.sensors.wheels.wheel_input import WheelInput  # noqa: E402

with can.Bus("nobody", interface="virtual"):
    """What python-can reads once of the computer, it reads before a loop waits for it."""


async def until(so: Callable[[], bool], within_s: float = 8.0) -> None:
    for _ in range(int(within_s / 0.01)):
        if so():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("not in time")


def exchange(section: CanSection, sent: list[Any], extra: dict[str, Any]) -> list[Event]:
    """Put messages on a bus; what the daemon's side delivered."""

    async def run() -> list[Event]:
        events: list[Event] = []
        task = asyncio.ensure_future(CanBus(section, MonotonicClock(), events.append).run())
        await until(lambda: len(events) > 0)
        with can.Bus(section.channel, interface=section.interface, **extra) as other:
            for number, message in enumerate(sent):
                other.send(message)
                if number % 2:
                    await asyncio.sleep(0.01)
            wanted = sum(not (m.is_remote_frame or m.is_error_frame) for m in sent)
            await until(lambda: sum(isinstance(e, CanFrame) for e in events) >= wanted)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return events

    return asyncio.run(asyncio.wait_for(run(), 20))


BUSES = [
    pytest.param(CanSection(interface="virtual", channel="test"), {}, id="virtual"),
    pytest.param(
        CanSection(interface="udp_multicast", channel="239.74.163.77"),
        {"hop_limit": 0},
        id="udp_multicast",
    ),
]


@pytest.mark.parametrize(("section", "extra"), BUSES)
def test_frames_arrive_with_id_width_and_data(section: CanSection, extra: dict[str, Any]) -> None:
    if section.interface == "udp_multicast":
        pytest.importorskip("msgpack", reason="msgpack is not installed")
    sent = [
        can.Message(arbitration_id=0x311, is_extended_id=False, data=bytes(range(8))),
        can.Message(arbitration_id=0x12345678, is_extended_id=True, data=b"\x01"),
        can.Message(arbitration_id=0x29, is_extended_id=False, is_remote_frame=True, dlc=8),
        can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b""),
    ]
    try:
        events = exchange(section, sent, extra)
    except (can.CanError, OSError) as error:
        pytest.skip(f"no multicast route on this host: {error}")
    assert isinstance(events[0], PortState)
    assert events[0].condition is PortCondition.OPEN
    frames = [(e.can_id, e.extended, e.data) for e in events if isinstance(e, CanFrame)]
    assert frames == [
        (0x311, False, bytes(range(8))),
        (0x12345678, True, b"\x01"),
        (0x7FF, False, b""),
    ]


def test_an_agilex_base_on_a_bus_becomes_motion() -> None:
    section = AgilexSection(source="agilex", track_m=0.5)
    sent = [
        can.Message(
            arbitration_id=0x311, is_extended_id=False, data=struct.pack(">ii", 10 * k, 10 * k)
        )
        for k in range(20)
    ]
    events = exchange(CanSection(interface="virtual", channel="agilex"), sent, {})
    wheels = WheelInput(section)
    motions = [m for e in events if isinstance(e, CanFrame) for m in wheels.on_frame(e)]
    assert sum(m.distance_m for m in motions) == pytest.approx(0.19)


def test_an_odrive_pair_on_a_bus_becomes_motion() -> None:
    section = OdriveSection(
        source="odrive", track_m=0.5, left_axis=0, right_axis=1, wheel_radius_m=0.1
    )
    sent = [
        can.Message(
            arbitration_id=axis << 5 | 0x09,
            is_extended_id=False,
            data=struct.pack("<ff", 0.01 * k, 1.0),
        )
        for k in range(20)
        for axis in (0, 1)
    ]
    events = exchange(CanSection(interface="virtual", channel="odrive"), sent, {})
    wheels = WheelInput(section)
    motions = [m for e in events if isinstance(e, CanFrame) for m in wheels.on_frame(e)]
    turns = sum(m.distance_m for m in motions) / (2 * 3.14159265 * 0.1)
    assert turns == pytest.approx(0.19, abs=0.015)


@pytest.mark.row("D8")
def test_a_bus_that_cannot_be_opened_is_named_and_tried_again() -> None:
    async def run() -> list[Event]:
        events: list[Event] = []
        section = CanSection(interface="socketcan", channel="nocan7")
        task = asyncio.ensure_future(CanBus(section, MonotonicClock(), events.append).run())
        await until(lambda: len(events) > 0)
        await asyncio.sleep(0.5)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return events

    events = asyncio.run(asyncio.wait_for(run(), 20))
    assert len(events) == 1
    assert isinstance(events[0], PortState)
    assert events[0].condition is PortCondition.MISSING
    assert "nocan7" in events[0].detail


@pytest.mark.row("D9")
def test_a_bus_whose_reader_dies_is_opened_again(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Any] = []

    class Broken(can.BusABC):  # type: ignore[misc,name-defined]
        """A bus whose second receive raises, as a damaged adapter does."""

        def __init__(self) -> None:
            super().__init__(channel="broken")
            self._left = 1

        def _recv_internal(self, timeout: float | None) -> tuple[Any, bool]:
            if self._left:
                self._left -= 1
                return can.Message(arbitration_id=1, is_extended_id=False, data=b"a"), True
            raise can.CanOperationError("adapter gone")

        def send(self, msg: Any, timeout: float | None = None) -> None: ...

    def open_bus(*_: Any, **__: Any) -> Broken:
        opened.append(Broken())
        bus = opened[-1]
        assert isinstance(bus, Broken)
        return bus

    monkeypatch.setattr(can, "Bus", open_bus)

    async def run() -> list[Event]:
        events: list[Event] = []
        section = CanSection(interface="virtual", channel="broken")
        task = asyncio.ensure_future(CanBus(section, MonotonicClock(), events.append).run())
        await until(lambda: len(opened) >= 2)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return events

    events = asyncio.run(asyncio.wait_for(run(), 20))
    states = [e.condition for e in events if isinstance(e, PortState)]
    assert states[:2] == [PortCondition.OPEN, PortCondition.LOST]
    assert any("adapter gone" in e.detail for e in events if isinstance(e, PortState))


# error frames and floods


@pytest.mark.row("D9")
def test_a_bus_that_is_off_is_named_and_comes_back() -> None:
    events: list[Event] = []
    now = [0]
    clock = MonotonicClock()
    clock.now = lambda: now[0]  # type: ignore[method-assign]
    bus = CanBus(CanSection(), clock, events.append)
    bus._take(can.Message(arbitration_id=0x40, is_error_frame=True, data=bytes(8)))
    bus._take(can.Message(arbitration_id=0x40, is_error_frame=True, data=bytes(8)))
    now[0] = 6_000_000
    bus._take(can.Message(arbitration_id=0x311, is_extended_id=False, data=bytes(8)))
    lost, well, frame = events
    assert isinstance(lost, PortState)
    assert lost.condition is PortCondition.LOST
    assert lost.detail.startswith("socketcan can0: the controller is off the bus (bus-off)")
    assert well == PortState(6_000_000, "wheels", PortCondition.OPEN, "socketcan can0")
    assert isinstance(frame, CanFrame)


class Pipe(can.BusABC):  # type: ignore[misc,name-defined]
    """A bus with a descriptor, as SocketCAN has: frames are datagrams of 16 bytes."""

    def __init__(self, ours: socket.socket) -> None:
        super().__init__(channel="pipe")
        self._ours = ours

    def fileno(self) -> int:
        return self._ours.fileno()

    def _recv_internal(self, timeout: float | None) -> tuple[Any, bool]:
        can_id, length, data = struct.unpack("=IB3x8s", self._ours.recv(16))
        message = can.Message(arbitration_id=can_id, is_extended_id=False, data=data[:length])
        return message, True

    def send(self, msg: Any, timeout: float | None = None) -> None: ...


FLOOD_HZ, ODOMETRY_HZ = 8_000, 50
"""As many frames as a bus of 1 Mbit/s has room for, and how many of them are meant for us."""


@pytest.mark.row("D9")
def test_on_a_full_bus_the_others_have_their_turn_after_each_frame(
    record_property: Recorded,
) -> None:
    """So nobody is late by more than a frame takes; and a second of it takes less than half a
    second (a quarter where nothing else runs)."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    events: list[Event] = []
    between: list[int] = []

    def pour() -> None:
        for k in range(FLOOD_HZ):
            is_odometry = k % (FLOOD_HZ // ODOMETRY_HZ) == 0
            can_id, data = (0x311, struct.pack(">ii", k, k)) if is_odometry else (0x500, bytes(8))
            theirs.send(struct.pack("=IB3x8s", can_id, 8, data))

    async def run() -> float:
        bus = CanBus(CanSection(), MonotonicClock(), events.append)
        reading = asyncio.ensure_future(bus._read_until_it_fails(Pipe(ours)))
        took = 0.0
        pouring = asyncio.ensure_future(asyncio.to_thread(pour))
        while not pouring.done() or len(events) < FLOOD_HZ:
            before, began = len(events), time.thread_time()
            await asyncio.sleep(0)
            between.append(len(events) - before)
            # turns in which nothing has come are those of a loop that waits
            took += (time.thread_time() - began) * between[-1]
        reading.cancel()
        await asyncio.gather(reading, return_exceptions=True)
        return took

    with ours, theirs:
        took_s = asyncio.run(asyncio.wait_for(run(), 20))
    assert sum(isinstance(e, CanFrame) and e.can_id == 0x311 for e in events) == ODOMETRY_HZ
    assert len(events) == FLOOD_HZ
    assert max(between) == 1
    assert took_s < allowed_s(0.5)
    record_property("measured", f"a second of {FLOOD_HZ} frames takes {took_s:.2f} s of a core")


# adapters that raise


def heard_of(interface: str, *pieces: bytes, frames: int, **options: Any) -> list[Event]:
    """What the daemon's side delivers of bytes that come on a serial line, piece by piece."""

    async def run() -> list[Event]:
        events: list[Event] = []
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        # the adapter takes what it is told; what nobody reads would hold up the other side
        asyncio.get_running_loop().add_reader(ours, os.read, ours, 1000)
        section = CanSection(interface=interface, channel=os.ttyname(theirs), options=options)
        task = asyncio.ensure_future(CanBus(section, MonotonicClock(), events.append).run())
        try:
            await until(lambda: len(events) > 0)
            for number, piece in enumerate(pieces):
                await asyncio.sleep(0.3 if number else 0.0)
                os.write(ours, piece)
            await until(lambda: sum(isinstance(e, CanFrame) for e in events) >= frames, 4.0)
            assert not task.done()
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
            asyncio.get_running_loop().remove_reader(ours)
            os.close(ours)
            os.close(theirs)
        return events

    return asyncio.run(asyncio.wait_for(run(), 20))


GOOD_SLCAN = b"t3118FFFFFFC100000012\r"
DAMAGED = [
    pytest.param(b"t3118FFFFFFC10000001\r", id="a digit is missing"),
    pytest.param(b"t311\r", id="the length is missing"),
    pytest.param(b"t3", id="cut and then glued to the next line"),
    pytest.param(b"\xff\xfe\r", id="noise"),
    pytest.param(b"\x80", id="one byte that is no ASCII"),
    pytest.param(b"\xff\x07T\x00zz\r\r\x07", id="rubbish"),
]


@pytest.mark.row("D3")
@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_line_of_slcan_costs_no_more_than_itself_and_the_one_it_ran_into(
    damage: bytes,
) -> None:
    good = [GOOD_SLCAN] * 5
    line = b"".join([GOOD_SLCAN, damage, *good])
    events = heard_of("slcan", line, frames=5, sleep_after_open=0.0)
    frames = [e for e in events if isinstance(e, CanFrame)]
    assert len(frames) >= 5
    assert all((f.can_id, f.data.hex()) == (0x311, "ffffffc100000012") for f in frames[-4:])
    assert [e.condition for e in events if isinstance(e, PortState)] == [PortCondition.OPEN]


SEEED = bytes.fromhex("aac8110312345678aabbccdd55")
SERIAL = bytes.fromhex("aa6673000008010000001122334455667788bb")


@pytest.mark.row("D3")
@pytest.mark.parametrize(
    ("interface", "good"), [("seeedstudio", SEEED), ("serial", SERIAL)], ids=["seeed", "serial"]
)
@pytest.mark.parametrize("cut", [1, 11])
def test_a_frame_that_is_cut_on_a_serial_adapter_is_no_end(
    interface: str, good: bytes, cut: int
) -> None:
    events = heard_of(interface, good[:cut], good, frames=1)
    frame = next(e for e in events if isinstance(e, CanFrame))
    assert len(frame.data) == 8
    assert [e.condition for e in events if isinstance(e, PortState)] == [PortCondition.OPEN]


@pytest.mark.parametrize(
    "fault",
    [TypeError("no index"), struct.error("4 bytes"), ImportError("no usb"), KeyError("x"),
     AssertionError(), RuntimeError("libusb"), can.CanInterfaceNotImplementedError("pcan")],
    ids=lambda fault: type(fault).__name__,
)  # fmt: skip
def test_whatever_an_adapter_raises_at_its_opening_is_why_there_is_none(
    monkeypatch: pytest.MonkeyPatch, fault: Exception
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise fault

    monkeypatch.setattr(can, "Bus", refuse)
    said = opened(CanSection(interface="gs_usb", channel=0))
    assert isinstance(said, str)
    assert said.startswith("gs_usb 0: ")
    assert len(said) > len("gs_usb 0: ")


def test_an_interface_gets_the_keys_that_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    got: dict[str, Any] = {}
    monkeypatch.setattr(can, "Bus", lambda channel, **keys: got.update(keys, channel=channel))
    options: dict[str, Any] = {"index": 0, "rtscts": True, "host": "10.0.0.9", "timeout": 0.5}
    opened(CanSection(interface="gs_usb", channel=2, bitrate=500_000, options=options))
    assert got == {"interface": "gs_usb", "channel": 2, "bitrate": 500_000, **options}


def test_an_option_that_has_a_key_of_its_own_is_one_sentence() -> None:
    said = opened(CanSection(interface="virtual", options={"interface": "slcan"}))
    assert isinstance(said, str)
    assert "multiple values for keyword argument 'interface'" in said


@pytest.mark.parametrize(("count", "fits"), [(16, True), (17, False)])
def test_options_are_few(count: int, fits: bool) -> None:
    options: dict[str, Any] = {f"key{k}": k for k in range(count)}
    if fits:
        assert len(CanSection(options=options).options) == count
    else:
        with pytest.raises(ValueError, match="at most 16"):
            CanSection(options=options)


@pytest.mark.parametrize(("faults", "is_lost"), [(MOST_DAMAGED - 1, False), (MOST_DAMAGED, True)])
def test_a_bus_that_does_nothing_but_raise_is_lost(faults: int, is_lost: bool) -> None:
    events: list[Event] = []
    bus = CanBus(CanSection(interface="virtual"), MonotonicClock(), events.append)
    frame = can.Message(arbitration_id=1, is_extended_id=False, data=b"a")
    ends = [bus._end(frame, fault) for fault in [KeyError(1)] * faults]
    assert (ends[-1] is not None) == is_lost
    assert not any(ends[:-1])
    bus._end(frame, frame)
    assert len(events) == 1
    assert bus._end(frame, KeyError(1)) is None
