"""Does the interface speak a version of IGMP that access points and switches understand?"""

from __future__ import annotations

import re
from collections.abc import Iterator

from drslamd.config import Config
from drslamd.host.interfaces import interface_of
from drslamd.host.kernel import Host
from drslamd.machine.finding import Finding, Severity

_LINK = re.compile(r"^\d+\s+(\S+)\s*:\s*\d+\s+(V\d)", re.MULTILINE)
"""A line of /proc/net/igmp that begins the groups of an interface."""


def igmp(config: Config, host: Host) -> Iterator[Finding]:
    """Of the interface that is named; the kernel falls back to what it heard a querier speak."""
    found = interface_of(config.gossip.interface, host.net)
    versions = dict(_LINK.findall(host.text(host.proc / "net" / "igmp")))
    if found is None or versions.get(found.name) != "V1":
        return
    yield Finding(
        "igmp",
        Severity.WARNING,
        f"{found.name} speaks IGMP version 1, which many switches do not pass on",
        f"sysctl net.ipv4.conf.{found.name}.force_igmp_version=2, or mend the querier",
    )
