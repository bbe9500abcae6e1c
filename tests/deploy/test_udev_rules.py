"""The udev rules touch the robot's devices, and nobody else's."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest
from deploy_helpers import REPOSITORY
from udev_reader import Device, apply, read

RULES = REPOSITORY / "etc" / "udev" / "60-drslamd.rules"
HOST = {"idVendor": "1d6b", "idProduct": "0002", "serial": "0000:00:14.0"}
"""The root hub, which every USB device has above it."""

CP210X = {"idVendor": "10c4", "idProduct": "ea60"}
CH9102 = {"idVendor": "1a86", "idProduct": "55d4"}
FTDI = {"idVendor": "0403", "idProduct": "6001"}


def as_shipped() -> str:
    return RULES.read_text()


def with_templates(serial: str) -> str:
    """As somebody leaves it who uncomments every template."""
    return re.sub(r"^#(?=ATTRS)", "", as_shipped(), flags=re.MULTILINE).replace("NUMBER", serial)


def serial_port(usb: dict[str, str], serial: str) -> Device:
    return Device("tty", [{}, {"latency_timer": "16"}, {**usb, "serial": serial}, HOST])


def usb_device(usb: dict[str, str], serial: str) -> Device:
    return Device("usb", [{**usb, "serial": serial}, HOST])


def untouched(device: Device) -> bool:
    return device == Device(device.subsystem, device.parents, device.action)


def test_a_kobuki_gets_its_name_and_a_latency_of_one_millisecond() -> None:
    port = apply(read(as_shipped()), serial_port(FTDI, "kobuki_AI02MT8R"))
    assert port.symlinks == ["kobuki"]
    assert port.written == {"device/latency_timer": "1"}
    assert (port.group, port.mode, port.tags) == ("dialout", "0660", ["systemd"])


@pytest.mark.parametrize("usb", [CP210X, CH9102])
def test_a_linktrack_gets_its_name_once_its_serial_number_is_filled_in(usb: dict[str, str]) -> None:
    port = apply(read(with_templates("5A71045523")), serial_port(usb, "5A71045523"))
    assert port.symlinks == ["linktrack"]
    assert not port.written
    assert (port.group, port.mode, port.tags) == ("dialout", "0660", ["systemd"])


@pytest.mark.parametrize(
    ("usb", "serial"), [(FTDI, "kobuki_AI02MT8R"), (CP210X, "42"), (CH9102, "42")]
)
def test_modem_manager_is_kept_off_the_port_and_off_the_usb_device(
    usb: dict[str, str], serial: str
) -> None:
    for device in (serial_port(usb, serial), usb_device(usb, serial)):
        done = apply(read(with_templates("42")), device)
        assert done.properties["ID_MM_DEVICE_IGNORE"] == "1"


@pytest.mark.parametrize("usb", [CP210X, CH9102, FTDI])
@pytest.mark.parametrize("serial", ["42", "0001", "", "my_kobuki"])
def test_foreign_devices_with_the_same_chips_are_left_alone(
    usb: dict[str, str], serial: str
) -> None:
    for text in (as_shipped(), with_templates("5A71045523")):
        assert untouched(apply(read(text), serial_port(usb, serial)))
        assert untouched(apply(read(text), usb_device(usb, serial)))


def test_the_serial_number_of_another_device_on_the_way_up_does_not_count() -> None:
    behind_a_hub = Device("tty", [{**CH9102, "serial": "7"}, {**HOST, "serial": "5A71045523"}])
    assert untouched(apply(read(with_templates("5A71045523")), behind_a_hub))


def test_nothing_happens_when_a_device_goes_or_is_of_another_kind() -> None:
    going = serial_port(FTDI, "kobuki_AI02MT8R")
    going.action = "remove"
    block = Device("block", [{**FTDI, "serial": "kobuki_AI02MT8R"}])
    for device in (going, block):
        assert untouched(apply(read(as_shipped()), device))


def test_no_rule_opens_a_device_to_everybody() -> None:
    modes = [
        term.value for rule in read(with_templates("1")) for term in rule if term.key == "MODE"
    ]
    assert modes
    assert all(mode.endswith("0") for mode in modes)


def test_udevadm_finds_nothing_wrong() -> None:
    udevadm = shutil.which("udevadm")
    if udevadm is None:
        pytest.skip("no udevadm here")
    done = subprocess.run(
        [udevadm, "verify", str(RULES)], capture_output=True, text=True, check=False
    )
    if "Unknown command" in done.stderr:
        pytest.skip("udevadm verify came with systemd 254")
    assert done.returncode == 0, done.stdout + done.stderr
