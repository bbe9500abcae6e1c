"""Does what this host sends to the group come back to it, on the interface with its address?"""

from __future__ import annotations

import os
import select
import time
from collections.abc import Iterator

from drslamd.config import Config
from drslamd.host.kernel import Host
from drslamd.io.multicast import open_group
from drslamd.machine.finding import Finding, Severity

PATIENCE_S = 0.5
TRIAL = b"drslamd doctor "
"""No LCM message: whoever hears it counts it as none and forgets it."""
READ_BYTES = 256


def multicast_echo(config: Config, host: Host) -> Iterator[Finding]:
    """One datagram that does not leave this host."""
    if config.gossip.provider != "native":
        return
    section, trial = config.gossip.model_copy(update={"ttl": 0}), TRIAL + os.urandom(8)
    try:
        with open_group(section) as udp:
            udp.sendto(trial, (section.group, section.port))
            end = time.monotonic() + PATIENCE_S
            while (left := end - time.monotonic()) > 0:
                if select.select([udp], [], [], left)[0] and udp.recv(READ_BYTES) == trial:
                    return
    except OSError:
        return  # said by the check of the network
    where = section.interface or "the default interface"
    yield Finding(
        "multicast echo",
        Severity.ERROR,
        f"what is sent to {section.group} on {where} does not come back",
        "a firewall drops it: allow UDP to the group (nft list ruleset; ufw allow in proto udp to "
        f"{section.group})",
    )
