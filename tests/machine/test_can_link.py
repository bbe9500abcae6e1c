"""A CAN interface that is missing, down or none at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from host_trees import CAN, DOWN, HostTree

from drslamd.config import Config, parse
from drslamd.machine import can_link as module
from drslamd.machine.can_link import can_link

TOML = """
robot.id = 1
team.insecure = true
uwb.port = "/dev/none"
[wheels]
source = "agilex"
track_m = 0.4
can.channel = "can0"
"""


class Bus:
    """A bus that opens."""

    def shutdown(self) -> None: ...


@pytest.fixture
def config(monkeypatch: pytest.MonkeyPatch) -> Config:
    monkeypatch.setattr(module, "opened", lambda section: Bus())
    return parse(TOML)


@pytest.fixture
def host(tmp_path: Path) -> HostTree:
    return HostTree(tmp_path)


def test_a_bus_that_is_up_is_no_finding(config: Config, host: HostTree) -> None:
    host.link("can0", kind=CAN)
    assert list(can_link(config, host)) == []


def test_a_link_that_is_down_opens_and_says_nothing(config: Config, host: HostTree) -> None:
    host.link("can0", DOWN, CAN)
    (only,) = can_link(config, host)
    assert only.cause == "wheels: nothing comes from can0"
    assert only.remedy.startswith("can0 is down; ip link set can0 up type can bitrate 500000")


def test_a_name_that_no_link_has(
    config: Config, host: HostTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault = "socketcan can0: [Errno 19] No such device"
    monkeypatch.setattr(module, "opened", lambda section: fault)
    (only,) = can_link(config, host)
    assert only.cause == f"wheels: missing: {fault}"
    assert "plug the CAN adapter in" in only.remedy
    host.link("can1", kind=CAN)
    (only,) = can_link(config, host)
    assert only.remedy.endswith("correct wheels.can: there are can1")


def test_an_interface_of_another_kind(config: Config, host: HostTree) -> None:
    host.link("can0")
    (only,) = can_link(config, host)
    assert only.remedy == "can0 is no CAN interface; correct wheels.can"


def test_serial_wheels_have_no_bus(host: HostTree, tmp_path: Path) -> None:
    from daemon_scenes import configured

    assert list(can_link(configured(tmp_path), host)) == []


def test_other_adapters_are_opened_and_nothing_else(
    config: Config, host: HostTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    can: Any = config.wheels
    for interface, word in (("slcan", "plug the adapter in"), ("pkan", "can.interface")):
        section = can.can.model_copy(update={"interface": interface})
        other = config.model_copy(update={"wheels": can.model_copy(update={"can": section})})
        assert list(can_link(other, host)) == []
        with monkeypatch.context() as patch:
            patch.setattr(module, "opened", lambda section: "it does not open")
            (only,) = can_link(other, host)
        assert word in only.remedy
