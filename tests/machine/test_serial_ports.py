"""Ports that cannot be opened, with what this machine knows of them."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest
from daemon_scenes import configured
from host_trees import HostTree
from setup_scenes import pseudo_ports

from drslamd.config import Config
from drslamd.machine.finding import Finding, Severity
from drslamd.machine.serial_ports import serial_ports


@pytest.fixture
def host(tmp_path: Path) -> HostTree:
    return HostTree(tmp_path)


def with_ports(tmp_path: Path, uwb: str, wheels: str) -> Config:
    config = configured(tmp_path)
    changed = {
        "uwb": config.uwb.model_copy(update={"port": uwb}),
        "wheels": config.wheels.model_copy(update={"port": wheels}),
    }
    return config.model_copy(update=changed)


def found(tmp_path: Path, host: HostTree, uwb: str, wheels: str) -> list[Finding]:
    return list(serial_ports(with_ports(tmp_path, uwb, wheels), host))


def test_ports_that_can_be_opened_are_let_go_again(tmp_path: Path, host: HostTree) -> None:
    with pseudo_ports(2) as (uwb, wheels):
        for _ in range(2):
            assert found(tmp_path, host, uwb, wheels) == []


def test_instead_of_a_missing_device_those_that_are_there_are_named(
    tmp_path: Path, host: HostTree
) -> None:
    with pseudo_ports(1) as (wheels,):
        (only,) = found(tmp_path, host, "/dev/ttyUSB9", wheels)
        assert only.severity is Severity.WARNING
        assert only.cause == "uwb: missing: /dev/ttyUSB9: No such file or directory"
        assert only.remedy.startswith("no serial device is plugged in")
        host.put(host.dev / "ttyACM0", "")
        (only,) = found(tmp_path, host, "/dev/ttyUSB9", wheels)
        assert only.remedy.endswith(f"there are {host.dev / 'ttyACM0'}")
        host.put(host.dev / "ttyUSB8", "")
        near = str(host.dev / "ttyUSB9")
        (only,) = found(tmp_path, host, near, wheels)
        assert only.remedy == f"did you mean {host.dev / 'ttyUSB8'}?"


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("minicom", "stop the program that holds it: minicom (process 12)"),
        ("ModemManager", "ModemManager holds it: systemctl mask --now ModemManager"),
    ],
)
def test_the_program_that_holds_a_port_is_named(
    tmp_path: Path, host: HostTree, name: str, remedy: str
) -> None:
    with pseudo_ports(2) as (uwb, wheels):
        holder = os.open(uwb, os.O_RDWR | os.O_NOCTTY)
        fcntl.flock(holder, fcntl.LOCK_EX)
        try:
            host.put(host.proc / "12" / "comm", name)
            (host.proc / "12" / "fd").mkdir()
            (host.proc / "12" / "fd" / "3").symlink_to(uwb)
            (only,) = found(tmp_path, host, uwb, wheels)
        finally:
            os.close(holder)
    assert only.remedy == remedy
