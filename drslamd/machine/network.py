"""The network of the team: can the group be joined, and does the interface carry anything?"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator

from drslamd.config import Config
from drslamd.host.interfaces import fault_of, interfaces
from drslamd.host.kernel import Host
from drslamd.io.multicast import join_fault, open_group, send_fault
from drslamd.machine.finding import Finding, Severity

CHECK = "network"
REMEDIES = {
    errno.EACCES: "ports below 1024 are root's: give all robots another gossip.port",
    errno.EADDRINUSE: "another program has the port for itself: stop it, or give all robots "
    "another gossip.port",
}


def network(config: Config, host: Host) -> Iterator[Finding]:
    """What the daemon would wait for; the providers of liblcm are their own affair."""
    section = config.gossip
    if section.provider != "native":
        return
    try:
        open_group(section).close()
    except OSError as error:
        yield _warning(join_fault(section, error), REMEDIES.get(error.errno or 0, ""))
        return
    named = next((i for i in interfaces(host.net) if i.name == section.interface), None)
    if named is None:
        return
    if fault_of(named.name, host.net):
        unreachable = OSError(errno.ENETUNREACH, os.strerror(errno.ENETUNREACH))
        yield _warning(send_fault(section, unreachable, host.net))
    elif host.text(host.net / named.name / "carrier") == "0":
        yield _warning(
            f"gossip.interface = {named.name!r}: not connected to anything; plug its cable in, or "
            "join the wireless network"
        )


def _warning(sentence: str, by_reason: str = "") -> Finding:
    cause, _, remedy = sentence.partition("; ")
    remedy = remedy or by_reason or "correct gossip.interface"
    return Finding(CHECK, Severity.WARNING, cause, remedy)
