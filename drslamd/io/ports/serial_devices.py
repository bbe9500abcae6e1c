"""The serial ports of this host, as the kernel shows them, by the names that survive replugging."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

SYSFS = Path("/sys/class/tty")
DEVICES = Path("/dev")
PHANTOM_DRIVER = "serial8250"
"""Makes ports of which most mainboards have none."""
USB_LEVELS = 6
"""A USB device is no further above its port."""


class SerialDevice(NamedTuple):
    """
    Attributes:
        path: below /dev/serial/by-id where udev made such a name.
        usb_id: vendor:product in hexadecimal, empty where it is not on USB.
        name: what the maker calls it, empty where nobody says.
    """

    path: str
    usb_id: str = ""
    name: str = ""


def serial_devices(sysfs: Path = SYSFS, devices: Path = DEVICES) -> list[SerialDevice]:
    """All that have hardware behind them, by their kernel's names; empty without any."""
    try:
        names = sorted(path.name for path in sysfs.iterdir() if (path / "device").exists())
    except OSError:
        return []
    stable = _stable_names(devices)
    found = []
    for name in names:
        hardware = sysfs / name / "device"
        if _target(hardware / "driver") != PHANTOM_DRIVER and (devices / name).exists():
            usb_id, words = _usb(hardware)
            path = stable.get(os.path.realpath(devices / name), str(devices / name))
            found.append(SerialDevice(path, usb_id, words))
    return found


def described(path: str, sysfs: Path = SYSFS) -> SerialDevice:
    """A port that somebody named, with what the kernel knows of it."""
    usb_id, words = _usb(sysfs / os.path.basename(os.path.realpath(path)) / "device")
    return SerialDevice(path, usb_id, words)


def _stable_names(devices: Path) -> dict[str, str]:
    """Names by-id, by the device that they point to."""
    try:
        links = sorted((devices / "serial" / "by-id").iterdir())
    except OSError:
        return {}
    return {os.path.realpath(link): str(link) for link in links}


def _usb(hardware: Path) -> tuple[str, str]:
    """Id and name of the USB device that has this port."""
    place = Path(os.path.realpath(hardware))
    for folder in (place, *place.parents)[:USB_LEVELS]:
        vendor, product = _text(folder / "idVendor"), _text(folder / "idProduct")
        if vendor and product:
            words = [_text(folder / "manufacturer"), _text(folder / "product")]
            return f"{vendor}:{product}", " ".join(word for word in words if word)
    return "", ""


def _target(link: Path) -> str:
    return os.path.basename(os.path.realpath(link)) if link.exists() else ""


def _text(path: Path) -> str:
    try:
        return path.read_text(errors="replace").strip()
    except OSError:
        return ""
