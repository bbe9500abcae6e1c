"""The CAN bus of the wheels: is its interface there, is it up, does python-can open it?"""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.conditions.ports import port_cause
from drslamd.config import Config
from drslamd.config_wheels import CanWheelSection
from drslamd.events import PortCondition
from drslamd.host.interfaces import CAN_TYPE, interfaces
from drslamd.host.kernel import Host
from drslamd.io.can_bus import opened
from drslamd.machine.finding import Finding, Severity


def can_link(config: Config, host: Host) -> Iterator[Finding]:
    """What the daemon would wait for."""
    if not isinstance(config.wheels, CanWheelSection):
        return
    section = config.wheels.can
    bus = opened(section)
    if isinstance(bus, str):
        cause = port_cause("wheels", PortCondition.MISSING, bus)
    else:
        bus.shutdown()
        cause = ""
    remedy = _remedy(str(section.channel), host) if section.interface == "socketcan" else ""
    if cause or remedy:
        what = cause or f"wheels: nothing comes from {section.channel}"
        yield Finding("can", Severity.WARNING, what, remedy or _of_adapters(section.interface))


def _remedy(channel: str, host: Host) -> str:
    """What is wrong with a SocketCAN interface; empty when nothing is."""
    there = {i.name: i for i in interfaces(host.net)}
    found, links = there.get(channel), [n for n, i in there.items() if i.kind == CAN_TYPE]
    if found is None:
        if links:
            return (
                f"there is no interface {channel}; correct wheels.can: there are {', '.join(links)}"
            )
        return (
            f"there is no interface {channel}; plug the CAN adapter in, and is its driver loaded "
            "(modprobe can, ip -br link)?"
        )
    if found.kind != CAN_TYPE:
        return f"{channel} is no CAN interface; correct wheels.can"
    if not found.is_up:
        return (
            f"{channel} is down; ip link set {channel} up type can bitrate 500000, or for every "
            "start etc/network/80-can0.network"
        )
    return ""


def _of_adapters(interface: str) -> str:
    import can

    if interface in can.VALID_INTERFACES:
        return (
            "plug the adapter in, or correct wheels.can; what else its interface wants to know, by "
            "python-can's names, stands in wheels.can.options"
        )
    return 'correct wheels.can.interface; it is "socketcan" on robots'
