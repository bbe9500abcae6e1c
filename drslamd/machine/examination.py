"""Everything that a daemon needs of its machine: what it refuses, then what it would wait for."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from drslamd.config import Config
from drslamd.host.kernel import Host
from drslamd.machine.can_link import can_link
from drslamd.machine.finding import Finding, Severity
from drslamd.machine.network import network
from drslamd.machine.refusals import SECOND_DAEMON, refusals
from drslamd.machine.serial_ports import serial_ports
from drslamd.machine.storage import state_folder, status_folder


def insecure(config: Config, host: Host) -> Iterator[Finding]:
    """A team without a key."""
    if config.team.insecure:
        yield Finding(
            "team key",
            Severity.WARNING,
            "team.insecure = true: whoever is on the network can forge messages",
            "make a key with: drslamd keygen FILE, and set team.key_file instead",
        )


WAITS: tuple[Callable[[Config, Host], Iterator[Finding]], ...] = (
    serial_ports,
    can_link,
    network,
    state_folder,
    status_folder,
    insecure,
)
"""What the daemon waits for or goes without, in the order in which one follows from another."""
HELD_BY_A_DAEMON = (serial_ports, can_link)
"""What a daemon that runs already has for itself."""


def examination(config: Config, host: Host | None = None) -> list[Finding]:
    """All findings: errors, then warnings, causes first."""
    place = host or Host()
    found = refusals(config)
    lives = any(finding.check == SECOND_DAEMON for finding in found)
    has_can = not any(finding.check == "python-can" for finding in found)
    for look in WAITS:
        if (lives and look in HELD_BY_A_DAEMON) or (look is can_link and not has_can):
            continue
        found += look(config, place)
    return found
