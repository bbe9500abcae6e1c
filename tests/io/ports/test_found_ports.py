"""All ports at once."""

from __future__ import annotations

import time
from pathlib import Path

from speaking_ports import ascii_base, kobuki, linktrack, roboteq, while_speaking

from drslamd.io.ports.found_ports import MAX_PORTS, devices_at, found_ports
from drslamd.io.ports.serial_devices import SerialDevice
from drslamd.sensors.recognition import Device

SHORT_S = 0.25


def test_ports_are_heard_side_by_side_and_told_one_by_one(tmp_path: Path) -> None:
    ports = [
        linktrack(tmp_path / "a", 7),
        kobuki(tmp_path / "b"),
        ascii_base(tmp_path / "c"),
        roboteq(tmp_path / "d"),
    ]
    told: list[str] = []
    devices = [SerialDevice(port.path) for port in ports]
    before = time.monotonic()
    found = while_speaking(
        ports,
        lambda: found_ports(
            devices, may_ask=True, listen_s=SHORT_S, heard_one=lambda p: told.append(p.path)
        ),
    )
    assert time.monotonic() - before < 3.0
    assert [p.base for p in found] == ["", "kobuki", "ascii", "roboteq"]
    assert found[0].who.device is Device.LINKTRACK
    assert sorted(told) == [port.path for port in ports]
    assert [bool(port.written) for port in ports] == [False, False, False, True]


def test_nobody_is_asked_without_leave_and_no_chip_of_a_linktrack_ever(tmp_path: Path) -> None:
    for usb_id, may_ask in (("20d2:5740", False), ("10c4:ea60", True)):
        port = roboteq(tmp_path / usb_id)
        device = SerialDevice(port.path, usb_id)
        look = lambda d=device, m=may_ask: found_ports([d], may_ask=m, listen_s=SHORT_S)  # noqa: E731
        (found,) = while_speaking([port], look)
        assert port.written == b""
        # its maker's USB id says what it is without a question
        assert found.base == ("roboteq" if usb_id == "20d2:5740" else "")


def test_a_device_is_heard_once_by_the_name_that_somebody_gave_it(tmp_path: Path) -> None:
    (tmp_path / "ttyUSB0").touch()
    (tmp_path / "by-id").symlink_to(tmp_path / "ttyUSB0")
    named, stable = str(tmp_path / "ttyUSB0"), SerialDevice(str(tmp_path / "by-id"))
    other = SerialDevice("/dev/other")
    assert [d.path for d in devices_at([named, named], [stable, other])] == [named, "/dev/other"]


def test_no_more_ports_are_opened_than_a_robot_can_have() -> None:
    many = [SerialDevice(f"/dev/tty{k}") for k in range(MAX_PORTS + 1)]
    assert len(devices_at([], many)) == MAX_PORTS
