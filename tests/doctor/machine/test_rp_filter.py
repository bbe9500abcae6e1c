"""Strict reverse-path filtering on a host with two networks."""

from __future__ import annotations

from pathlib import Path

import pytest
from host_trees import HostTree
from patients import configuration

from drslamd.doctor.machine.rp_filter import rp_filter
from drslamd.host import interfaces


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> HostTree:
    addresses = {"wlan0": "192.0.2.3", "eth0": "198.51.100.4"}
    monkeypatch.setattr(interfaces, "address_of", lambda name: addresses.get(name, ""))
    tree = HostTree(tmp_path)
    tree.link("wlan0")
    return tree


def set_filter(host: HostTree, everywhere: int, here: int) -> None:
    for name, value in (("all", everywhere), ("wlan0", here)):
        host.put(host.proc / "sys/net/ipv4/conf" / name / "rp_filter", str(value))


@pytest.mark.parametrize(
    ("everywhere", "here", "is_found"),
    [(0, 0, False), (1, 0, True), (0, 1, True), (2, 1, False), (1, 2, False)],
)
def test_the_larger_of_both_settings_counts(
    host: HostTree, everywhere: int, here: int, is_found: bool
) -> None:
    set_filter(host, everywhere, here)
    host.link("eth0")
    assert bool(list(rp_filter(configuration(), host))) is is_found


def test_with_one_network_nobody_is_routed_another_way(host: HostTree) -> None:
    set_filter(host, 1, 1)
    assert list(rp_filter(configuration(), host)) == []
