"""All serial ports of this host and who speaks there, heard side by side."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Sequence

from drslamd.config_wheels import RoboteqSection
from drslamd.io.ports.listening import LISTEN_S, Listened, answers_as_roboteq, listen
from drslamd.io.ports.serial_devices import SerialDevice, described
from drslamd.sensors.recognition import LINKTRACK_BAUDS
from drslamd.setup.choices import PortFound

MAX_PORTS = 32
"""A robot has a handful; each that is heard takes a descriptor and some memory."""


def devices_at(named: Sequence[str], others: Sequence[SerialDevice]) -> list[SerialDevice]:
    """Those that were named, by that name, and the others, each device once."""
    devices = [described(path) for path in dict.fromkeys(named)]
    there = {os.path.realpath(path) for path in named}
    devices += [device for device in others if os.path.realpath(device.path) not in there]
    return devices[:MAX_PORTS]


async def found_ports(
    devices: Sequence[SerialDevice],
    *,
    may_ask: bool,
    listen_s: float = LISTEN_S,
    heard_one: Callable[[PortFound], None] = lambda _: None,
) -> list[PortFound]:
    """Who speaks at each.

    Args:
        may_ask: write the question of a Roboteq to ports where nobody speaks and no LinkTrack can
            be.
        heard_one: is told of each as soon as it is known.
    """

    async def one(device: SerialDevice) -> PortFound:
        heard = await listen(device.path, LINKTRACK_BAUDS, listen_s)
        port = _found(device, heard)
        if may_ask and port.may_be_asked:
            baud = RoboteqSection.model_fields["baud"].default
            if await answers_as_roboteq(device.path, baud):
                port = port._replace(answers="roboteq", baud=baud)
        heard_one(port)
        return port

    return list(await asyncio.gather(*map(one, devices)))


def _found(device: SerialDevice, heard: Listened) -> PortFound:
    return PortFound(
        device.path, heard.who, heard.baud, device.usb_id, device.name, fault=heard.fault
    )
