"""The error state of a CAN controller: a bus that is off carries nothing and says nothing."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator
from typing import Any

from drslamd.config import Config
from drslamd.config_wheels import CanWheelSection
from drslamd.host.kernel import Host
from drslamd.machine.finding import Finding, Severity

PATIENCE_S = 5.0
WIRING = "look at CAN-H and CAN-L, at both 120 ohm terminators and at the bit rate of all nodes"
REMEDIES = {
    "BUS-OFF": f"{WIRING}; then: ip link set NAME type can restart",
    "ERROR-PASSIVE": WIRING,
    "ERROR-WARNING": WIRING,
    "STOPPED": "bring it up: ip link set NAME up",
}
"""States of a controller, Linux, <linux/can/netlink.h>."""


def can_state(config: Config, host: Host) -> Iterator[Finding]:
    """Of a SocketCAN interface, as iproute2 shows it."""
    wheels = config.wheels
    if not isinstance(wheels, CanWheelSection) or wheels.can.interface != "socketcan":
        return
    name = str(wheels.can.channel)
    state = _details(name).get("state", "")
    if state in REMEDIES:
        severity = Severity.ERROR if state in ("BUS-OFF", "STOPPED") else Severity.WARNING
        remedy = REMEDIES[state].replace("NAME", name)
        yield Finding("can state", severity, f"{name} is in the state {state}", remedy)


def _details(name: str) -> dict[str, Any]:
    """Of one link; empty where iproute2 or the link is missing."""
    program = shutil.which("ip")
    if program is None:
        return {}
    try:
        done = subprocess.run(
            [program, "-json", "-details", "link", "show", "dev", name],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=True,
        )
        (link,) = json.loads(done.stdout)
        data: dict[str, Any] = link["linkinfo"]["info_data"]
    except (OSError, subprocess.SubprocessError, ValueError, KeyError, TypeError):
        return {}
    return data
