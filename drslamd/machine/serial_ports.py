"""The serial ports: opened as the daemon opens them, and let go at once."""

from __future__ import annotations

import difflib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

import serial

from drslamd.conditions.ports import port_cause, port_key, port_remedy
from drslamd.config import Config
from drslamd.config_wheels import SerialWheelSection
from drslamd.events import Port, PortCondition
from drslamd.host.kernel import Host
from drslamd.host.owners import barrier, group_name, permissions, user_name
from drslamd.io.serial_port import PortFault, opened
from drslamd.machine.finding import Finding, Severity

GROUP_MAY = stat.S_IRGRP | stat.S_IWGRP
MAX_SHOWN = 6
"""Names of devices in one sentence."""


def serial_ports(config: Config, host: Host) -> Iterator[Finding]:
    """What the daemon would wait for."""
    wanted: list[tuple[Port, str, int]] = [("uwb", config.uwb.port, config.uwb.baud)]
    if isinstance(config.wheels, SerialWheelSection):
        wanted.append(("wheels", config.wheels.port, config.wheels.baud))
    lines: list[serial.Serial] = []
    seen: dict[str, Port] = {}
    try:
        for port, path, baud in wanted:
            first = seen.setdefault(os.path.realpath(path), port)
            line = opened(path, baud)
            if not isinstance(line, PortFault):
                lines.append(line)
            elif first != port and line.condition is PortCondition.BUSY:
                both = f"{port_key(first)} and {port_key(port)} name one device"
                yield _warning(port, line, f"{both}: correct one of them")
            else:
                yield _warning(port, line, _remedy(port, path, line.condition, host))
    finally:
        for held in lines:
            held.close()


def _warning(port: Port, fault: PortFault, remedy: str) -> Finding:
    return Finding(f"{port} port", Severity.WARNING, port_cause(port, *fault), remedy)


def _remedy(port: Port, path: str, condition: PortCondition, host: Host) -> str:
    if condition is PortCondition.MISSING:
        return _instead(port, path, host)
    if condition is PortCondition.DENIED:
        return _let_in(Path(path))
    if condition is PortCondition.BUSY:
        holders = host.holders(os.path.realpath(path))
        if any(name.startswith("ModemManager") for name in holders):
            return "ModemManager holds it: systemctl mask --now ModemManager"
        if holders:
            return f"stop the program that holds it: {', '.join(holders)}"
    return port_remedy(port, condition)


def _instead(port: Port, path: str, host: Host) -> str:
    """A device that is there, or that none is."""
    there = host.serial_devices()
    if not there:
        return (
            f"no serial device is plugged in: look at cable and power, or correct {port_key(port)}"
        )
    close = difflib.get_close_matches(path, there, n=1, cutoff=0.8)
    if close:
        return f"did you mean {close[0]}?"
    more = ", ..." if len(there) > MAX_SHOWN else ""
    return (
        f"plug it in, or correct {port_key(port)}: there are {', '.join(there[:MAX_SHOWN])}{more}"
    )


def _let_in(path: Path) -> str:
    wall = barrier(path)
    owner = permissions(wall)
    if wall != path or not owner:
        return f"this is user {user_name()}, which may not enter {wall}"
    status = path.stat()
    has_group = status.st_gid != 0 and status.st_mode & GROUP_MAY == GROUP_MAY
    mend = (
        f"usermod -aG {group_name(status.st_gid)} {user_name()}, then log in again"
        if has_group
        else "install etc/udev/60-drslamd.rules, and plug it in again"
    )
    return f"this is user {user_name()}, and it has {owner}: {mend}"
