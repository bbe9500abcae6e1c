"""One datagram to the group, which does not leave this host."""

from __future__ import annotations

import socket

import pytest
from patients import configuration

from drslamd.config import Config, GossipSection
from drslamd.doctor.machine import multicast_echo as module
from drslamd.doctor.machine.multicast_echo import multicast_echo
from drslamd.host.kernel import Host


def on(interface: str, **more: object) -> Config:
    gossip = configuration().gossip.model_copy(update={"interface": interface, **more})
    return configuration().model_copy(update={"gossip": gossip})


def test_on_the_loopback_it_comes_back() -> None:
    assert list(multicast_echo(on("127.0.0.1", port=47_211), Host())) == []


def test_what_does_not_come_back_is_an_error_that_names_a_firewall(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def deaf(section: GossipSection) -> socket.socket:
        assert section.ttl == 0
        return socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    monkeypatch.setattr(module, "open_group", deaf)
    monkeypatch.setattr(module, "PATIENCE_S", 0.05)
    loopback = {"group": "127.0.0.1", "port": 9}
    (finding,) = multicast_echo(on("", **loopback), Host())
    assert finding.severity.value == "error"
    assert "does not come back" in finding.cause
    assert "firewall" in finding.remedy


def test_what_cannot_be_joined_is_said_by_another_check() -> None:
    assert list(multicast_echo(on("wlan9"), Host())) == []
    assert list(multicast_echo(on("wlan9", provider="liblcm"), Host())) == []
