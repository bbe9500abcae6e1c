"""The group on an interface that is there, and carries nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from daemon_scenes import configured
from host_trees import DOWN, HostTree

from drslamd.host import interfaces
from drslamd.machine import network as module
from drslamd.machine.network import network


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> HostTree:
    """Joining works on every interface, and wlan0 has an address."""
    addresses = {"wlan0": "192.0.2.3"}
    monkeypatch.setattr(interfaces, "address_of", lambda name: addresses.get(name, ""))

    class Socket:
        def close(self) -> None: ...

    monkeypatch.setattr(module, "open_group", lambda section: Socket())
    return HostTree(tmp_path)


def on(tmp_path: Path, host: HostTree, interface: str, more: str = "") -> list[tuple[str, str]]:
    text = f'[gossip]\ninterface = "{interface}"\n{more}'
    return [(f.cause, f.remedy) for f in network(configured(tmp_path, text), host)]


def test_an_interface_in_good_order_is_no_finding(tmp_path: Path, host: HostTree) -> None:
    host.link("wlan0")
    assert on(tmp_path, host, "wlan0") == []
    assert on(tmp_path, host, "") == []


def test_an_interface_that_is_down(tmp_path: Path, host: HostTree) -> None:
    host.link("wlan0", DOWN)
    (only,) = on(tmp_path, host, "wlan0")
    assert only[0] == "cannot send on wlan0: the interface is down"


def test_an_interface_without_an_address(tmp_path: Path, host: HostTree) -> None:
    host.link("eth5")
    (only,) = on(tmp_path, host, "eth5")
    assert only[0].endswith("no IPv4 address")
    assert "give it one" in only[1]


def test_an_interface_that_is_connected_to_nothing(tmp_path: Path, host: HostTree) -> None:
    host.link("wlan0", carrier="0")
    (only,) = on(tmp_path, host, "wlan0")
    assert only[0] == "gossip.interface = 'wlan0': not connected to anything"
    assert "join the wireless network" in only[1]


def test_what_liblcm_does_is_its_own_affair(tmp_path: Path, host: HostTree) -> None:
    assert on(tmp_path, host, "wlan9", 'provider = "liblcm"\n') == []
