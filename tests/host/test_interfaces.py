"""The interfaces of a host, from trees like the kernel's."""

from __future__ import annotations

from pathlib import Path

import pytest

from drslamd.host import interfaces as module
from drslamd.host.interfaces import CAN_TYPE, fault_of, interface_of, interfaces

ETHERNET = 1


def tree(folder: Path, **links: tuple[int, int]) -> Path:
    """Interfaces by name, with flags and kind."""
    for name, (flags, kind) in links.items():
        (folder / name).mkdir()
        (folder / name / "flags").write_text(f"{flags:#x}\n")
        (folder / name / "type").write_text(f"{kind}\n")
    return folder


@pytest.fixture
def net(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    addresses = {"wlan0": "192.0.2.3", "eth1": "", "eth2": "192.0.2.4"}
    monkeypatch.setattr(module, "address_of", lambda name: addresses.get(name, ""))
    (tmp_path / "bonding_masters").write_text("")
    return tree(
        tmp_path,
        wlan0=(0x1003, ETHERNET),
        eth0=(0x1002, ETHERNET),
        eth1=(0x1003, ETHERNET),
        eth2=(0x3, ETHERNET),
        can0=(0x41, CAN_TYPE),
    )


def test_what_is_no_interface_is_left_out(net: Path) -> None:
    assert [i.name for i in interfaces(net)] == ["can0", "eth0", "eth1", "eth2", "wlan0"]
    assert interfaces(net / "nowhere") == []


def test_an_interface_is_found_by_name_and_by_address(net: Path) -> None:
    by_name, by_address = interface_of("wlan0", net), interface_of("192.0.2.3", net)
    assert by_name == by_address == ("wlan0", True, True, "192.0.2.3", ETHERNET)
    assert interface_of("wlan1", net) is None


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("wlan0", ""),
        ("192.0.2.3", ""),
        ("eth0", "the interface is down; bring it up: ip link set eth0 up"),
        ("eth1", "the interface has no IPv4 address; give it one"),
        ("eth2", "the interface carries no multicast; ip link set eth2 multicast on"),
        ("wlan7", "no interface has this name; there are eth0, eth1, eth2, wlan0"),
        ("192.0.2.9", "no interface has this address; there are eth0, eth1, eth2, wlan0"),
    ],
)
def test_what_keeps_an_interface_from_carrying_the_group(net: Path, name: str, fault: str) -> None:
    said = fault_of(name, net)
    assert said.startswith(fault)
    assert bool(said) == bool(fault)


def test_the_loopback_of_this_host_is_as_the_kernel_says() -> None:
    assert fault_of("lo") == ""
    assert fault_of("127.0.0.1") == ""
