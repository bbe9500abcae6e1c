"""The network interfaces of this host, as the kernel shows them."""

from __future__ import annotations

import fcntl
import ipaddress
import socket
import struct
from pathlib import Path
from typing import NamedTuple

SYSFS = Path("/sys/class/net")
SIOCGIFADDR = 0x8915
"""Linux, <linux/sockios.h>."""
UP, MULTICAST = 0x1, 0x1000
"""Linux, <net/if.h>."""
CAN_TYPE = 280
"""ARPHRD_CAN in <linux/if_arp.h>."""
MAX_NAME = 15
NO_ADDRESS = "the interface has no IPv4 address; give it one (DHCP, or systemd-networkd)"


class Interface(NamedTuple):
    """
    Attributes:
        address: its first IPv4 address, empty when there is none.
        kind: ARPHRD_ number of its hardware.
    """

    name: str
    is_up: bool
    carries_multicast: bool
    address: str
    kind: int


def interfaces(sysfs: Path = SYSFS) -> list[Interface]:
    """All of them, by name; empty where the kernel shows none."""
    try:
        names = sorted(path.name for path in sysfs.iterdir())
    except OSError:
        return []
    return [found for name in names if (found := _interface(sysfs, name)) is not None]


def interface_of(name_or_address: str, sysfs: Path = SYSFS) -> Interface | None:
    """The one that has this name or this IPv4 address."""
    all_of_them = interfaces(sysfs)
    return next((i for i in all_of_them if name_or_address in (i.name, i.address)), None)


def fault_of(name_or_address: str, sysfs: Path = SYSFS) -> str:
    """Why nothing can be sent there, in words; empty when nothing speaks against it."""
    there = ", ".join(i.name for i in interfaces(sysfs) if i.kind != CAN_TYPE) or "none"
    found = interface_of(name_or_address, sysfs)
    if found is None:
        what = "has this address" if _is_address(name_or_address) else "has this name"
        return f"no interface {what}; there are {there}"
    if not found.is_up:
        return f"the interface is down; bring it up: ip link set {found.name} up"
    if not found.address:
        return NO_ADDRESS
    if not found.carries_multicast and found.name != "lo":
        return f"the interface carries no multicast; ip link set {found.name} multicast on"
    return ""


def _is_address(text: str) -> bool:
    try:
        ipaddress.IPv4Address(text)
    except ValueError:
        return False
    return True


def _interface(sysfs: Path, name: str) -> Interface | None:
    try:
        flags = int((sysfs / name / "flags").read_text(), 16)
        kind = int((sysfs / name / "type").read_text())
    except (OSError, ValueError):
        return None  # gone meanwhile, or no interface (bonding_masters)
    return Interface(name, bool(flags & UP), bool(flags & MULTICAST), address_of(name), kind)


def address_of(name: str) -> str:
    """The first IPv4 address of an interface; empty when there is none."""
    request = struct.pack("256s", name.encode()[:MAX_NAME])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        try:
            answer = fcntl.ioctl(any_socket.fileno(), SIOCGIFADDR, request)
        except OSError:
            return ""
    return socket.inet_ntoa(answer[20:24])
