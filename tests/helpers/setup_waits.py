"""Faults of a set-up with which the daemon starts, and waits for or goes without something."""

from __future__ import annotations

import os

import pytest
from setup_faults import AGILEX, Fault, Make, changed, wheels
from setup_scenes import Setup

SOCKET = "@SOCKET@"
"""Stands for a path in the folder of the set-up."""


def _folders() -> list[Fault]:
    def state_is_a_file(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.state.rmdir()
        setup.state.write_text("")
        setup.change(('state_dir = "STATE"', f'state_dir = "STATE"\nstatus_socket = "{SOCKET}"'))
        setup.config.write_text(setup.config.read_text().replace(SOCKET, f"{setup.folder}/s"))

    def state_closed(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.change(('state_dir = "STATE"', f'state_dir = "STATE"\nstatus_socket = "{SOCKET}"'))
        setup.config.write_text(setup.config.read_text().replace(SOCKET, f"{setup.folder}/s"))
        setup.state.chmod(0o500)

    def state(content: str) -> Make:
        return lambda setup, _: (setup.state / "robot-3.json").write_text(content)

    def socket(path: str) -> Make:
        def make(setup: Setup, _: pytest.MonkeyPatch) -> None:
            setup.change(('state_dir = "STATE"', f'state_dir = "STATE"\nstatus_socket = "{path}"'))

        return make

    cannot_keep = "robot-3.json: "
    long = "/tmp/" + "x" * 110
    return [
        _waits("state a file", state_is_a_file, f"{cannot_keep}", "is a file and no folder"),
        _waits(
            "state closed", state_closed, f"{cannot_keep}Permission denied", "make it writable"
        )._replace(as_nobody=True),
        _waits("state damaged", state("{"), "cannot read", "learned again"),
        _waits("state of another", state('{"schema": 9}'), "another version", "learned again"),
        _waits("socket too long", socket(long), "cannot listen at", "shorten"),
        _waits("socket below a file", socket("/dev/null/s"), "cannot listen at", "status_socket"),
    ]


def _ports() -> list[Fault]:
    def dangling(setup: Setup, _: pytest.MonkeyPatch) -> None:
        name = setup.folder / "usb-LINKTRACK-if00"
        name.symlink_to("/dev/ttyUSB99")
        setup.change(('"UWB"', f'"{name}"'))

    def plain_file(setup: Setup, _: pytest.MonkeyPatch) -> None:
        (setup.folder / "tty").write_text("")
        setup.change(('"UWB"', f'"{setup.folder / "tty"}"'))

    def held(setup: Setup, patch: pytest.MonkeyPatch) -> None:
        setup.hold(setup.uwb)

    def closed(setup: Setup, _: pytest.MonkeyPatch) -> None:
        os.chmod(setup.uwb, 0)

    missing, unfit = "missing: ", "not a serial port"
    return [
        _waits(
            "module unplugged", changed('"UWB"', '"/dev/ttyUSB99"'), f"uwb: {missing}", "uwb.port"
        ),
        _waits(
            "base unplugged",
            changed('"WHEELS"', '"/dev/ttyACM99"'),
            f"wheels: {missing}",
            "wheels.port",
        ),
        _waits("name without device", dangling, f"uwb: {missing}", "uwb.port"),
        _waits("no terminal", changed('"UWB"', '"/dev/null"'), unfit, "correct uwb.port"),
        _waits("a folder", changed('"WHEELS"', '"/dev"'), unfit, "correct wheels.port"),
        _waits("a plain file", plain_file, unfit, "correct uwb.port"),
        _waits("port held", held, "uwb: in use by another program", "stop the program"),
        _waits("port closed", closed, "uwb: no permission", "60-drslamd.rules")._replace(
            as_nobody=True
        ),
        _waits(
            "one port twice",
            changed('"WHEELS"', '"UWB"'),
            "wheels: in use",
            "uwb.port and wheels.port name one device",
        ),
    ]


def _buses_and_networks() -> list[Fault]:
    can = AGILEX + "can = "

    def taken(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.take_udp_port()

    interface = 'interface = "127.0.0.1"'
    return [
        _waits(
            "no CAN",
            wheels(AGILEX + 'can.channel = "can9"\n'),
            "wheels: missing: socketcan can9",
            "no interface can9",
        ),
        _waits(
            "no CAN at all", wheels(AGILEX + 'can.channel = "lo"\n'), "socketcan lo", "lo is no CAN"
        ),
        _waits(
            "adapter unknown", wheels(can + '{ interface = "pkan" }\n'), "pkan", "can.interface"
        ),
        _waits(
            "adapter unplugged",
            wheels(can + '{ interface = "slcan", channel = "/dev/no" }\n'),
            "wheels: missing: slcan /dev/no",
            "plug the adapter in",
        ),
        _waits(
            "no interface",
            changed(interface, 'interface = "wlan9"'),
            "on wlan9: no interface has this",
            "there are ",
        ),
        _waits(
            "no address",
            changed(interface, 'interface = "192.0.2.99"'),
            "no interface has this address",
            "there are ",
        ),
        _waits("port taken", taken, "Address already in use", "another gossip.port"),
        _waits(
            "port of root", changed("port = 47123", "port = 700"), "Permission denied", "gossip."
        )._replace(as_nobody=True),
    ]


def _waits(name: str, make: Make, cause: str, remedy: str) -> Fault:
    return Fault(name, make, cause, remedy, code=0)


def faults_that_are_waited_for() -> list[Fault]:
    """Those with which `run` starts, and says what it waits for or goes without."""
    return [*_folders(), *_ports(), *_buses_and_networks()]
