"""What the kernel shows of devices and of those who hold them."""

from __future__ import annotations

from pathlib import Path

from host_trees import HostTree


def test_lasting_names_come_first_and_no_device_is_named_twice(tmp_path: Path) -> None:
    host = HostTree(tmp_path)
    for name in ("ttyUSB0", "ttyUSB1", "ttyACM0", "tty1"):
        host.put(host.dev / name, "")
    by_id = host.dev / "serial" / "by-id"
    by_id.mkdir(parents=True)
    (by_id / "usb-module").symlink_to("../../ttyUSB1")
    found = [Path(name).name for name in host.serial_devices()]
    assert found == ["usb-module", "ttyACM0", "ttyUSB0"]


def test_whoever_has_a_device_open_is_named(tmp_path: Path) -> None:
    host = HostTree(tmp_path)
    for process, name, target in (("12", "minicom", "/dev/ttyUSB0"), ("13", "cat", "/dev/null")):
        host.put(host.proc / process / "comm", name)
        (host.proc / process / "fd").mkdir()
        (host.proc / process / "fd" / "3").symlink_to(target)
    (host.proc / "14").mkdir()  # of somebody else: nothing is seen of it
    assert host.holders("/dev/ttyUSB0") == ["minicom (process 12)"]
    assert host.holders("/dev/ttyUSB7") == []


def test_what_is_not_there_says_nothing(tmp_path: Path) -> None:
    assert HostTree(tmp_path).text(tmp_path / "nowhere") == ""
