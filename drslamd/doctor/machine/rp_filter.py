"""Strict reverse-path filtering drops multicast from whoever is routed another way."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.config import Config
from drslamd.host.interfaces import interface_of, interfaces
from drslamd.host.kernel import Host
from drslamd.machine.finding import Finding, Severity

STRICT = 1
"""RFC 3704 strict mode: Linux, Documentation/networking/ip-sysctl."""


def rp_filter(config: Config, host: Host) -> Iterator[Finding]:
    """The kernel takes the larger of the setting for all interfaces and that for one."""
    found = interface_of(config.gossip.interface, host.net)
    others = [i for i in interfaces(host.net) if i.is_up and i.address and i.name != "lo"]
    if found is None or len(others) < 2:
        return
    settings = host.proc / "sys" / "net" / "ipv4" / "conf"
    values = [host.text(settings / name / "rp_filter") for name in ("all", found.name)]
    if max((int(v) for v in values if v.isdecimal()), default=0) == STRICT:
        yield Finding(
            "rp_filter",
            Severity.WARNING,
            f"rp_filter is strict on {found.name}, and this host has other interfaces: messages "
            "of robots that are routed another way are dropped without a word",
            f"sysctl net.ipv4.conf.all.rp_filter=2 net.ipv4.conf.{found.name}.rp_filter=2",
        )
