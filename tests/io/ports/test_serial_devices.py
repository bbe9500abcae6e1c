"""Serial ports of a host whose kernel shows them below another folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from drslamd.io.ports.serial_devices import SerialDevice, described, serial_devices


@pytest.fixture
def host(tmp_path: Path) -> tuple[Path, Path]:
    """A CP210x, a board's own port, a phantom, a console, and one whose device file is missing."""
    sysfs, devices = tmp_path / "sys", tmp_path / "dev"
    usb = tmp_path / "bus" / "1-2"
    (usb / "1-2:1.0" / "ttyUSB0").mkdir(parents=True)
    for name, text in {
        "idVendor": "10c4\n",
        "idProduct": "ea60\n",
        "manufacturer": "Silicon Labs\n",
        "product": "CP2102N\n",
    }.items():
        (usb / name).write_text(text)
    for name in ("serial8250", "uart-pl011"):
        (tmp_path / "drivers" / name).mkdir(parents=True)
    for name, hardware, driver in (
        ("ttyUSB0", usb / "1-2:1.0" / "ttyUSB0", ""),
        ("ttyAMA0", tmp_path / "bus" / "uart", "uart-pl011"),
        ("ttyS0", tmp_path / "bus" / "isa", "serial8250"),
        ("ttyACM9", tmp_path / "bus" / "gone", ""),
    ):
        hardware.mkdir(parents=True, exist_ok=True)
        (sysfs / name).mkdir(parents=True)
        (sysfs / name / "device").symlink_to(hardware)
        if driver:
            (hardware / "driver").symlink_to(tmp_path / "drivers" / driver)
    (sysfs / "tty1").mkdir()
    by_id = devices / "serial" / "by-id"
    by_id.mkdir(parents=True)
    for name in ("ttyUSB0", "ttyAMA0", "ttyS0", "tty1"):
        (devices / name).touch()
    (by_id / "usb-Silicon_Labs_0001-if00").symlink_to("../../ttyUSB0")
    return sysfs, devices


@pytest.mark.row("D6")
def test_ports_with_hardware_are_listed_by_the_name_that_survives_replugging(
    host: tuple[Path, Path],
) -> None:
    sysfs, devices = host
    assert serial_devices(sysfs, devices) == [
        SerialDevice(str(devices / "ttyAMA0")),
        SerialDevice(
            str(devices / "serial/by-id/usb-Silicon_Labs_0001-if00"),
            "10c4:ea60",
            "Silicon Labs CP2102N",
        ),
    ]


def test_a_port_that_somebody_names_keeps_its_name(host: tuple[Path, Path]) -> None:
    sysfs, devices = host
    named = str(devices / "ttyUSB0")
    assert described(named, sysfs) == SerialDevice(named, "10c4:ea60", "Silicon Labs CP2102N")


def test_a_host_that_shows_nothing_has_no_ports(tmp_path: Path) -> None:
    assert serial_devices(tmp_path / "none", tmp_path) == []
