"""What is said of a port that cannot be used, and what to do about it."""

from __future__ import annotations

from drslamd.events import Port, PortCondition

REMEDIES = {
    PortCondition.MISSING: "plug it in, or correct {key}",
    PortCondition.DENIED: "add the user that runs drslamd to the group of the device (dialout)",
    PortCondition.BUSY: "stop the program that holds it (ModemManager, another drslamd)",
    PortCondition.UNFIT: "correct {key}",
    PortCondition.LOST: "check its power and the cable",
}
"""Of all conditions but OPEN."""


def port_key(port: Port, is_serial: bool = True) -> str:
    """The key of the configuration that names it."""
    return f"{port}.port" if is_serial else f"{port}.can"


def port_cause(port: Port, condition: PortCondition, detail: str) -> str:
    """Which port, and what the kernel says of it."""
    return f"{port}: {condition.value}: {detail}"


def port_remedy(port: Port, condition: PortCondition, is_serial: bool = True) -> str:
    """In general; whoever sees the machine knows more."""
    return REMEDIES[condition].format(key=port_key(port, is_serial))
