"""What is chosen of what was found, and what nobody guesses."""

from __future__ import annotations

from typing import Any

import pytest

from drslamd.sensors.recognition import Device, Recognised
from drslamd.setup.choices import (
    Missing,
    PortFound,
    UwbChoice,
    WheelsChoice,
    interface_choice,
    robot_id_choice,
    uwb_choice,
    wheels_choice,
)

MODULE = PortFound("/dev/m", Recognised(Device.LINKTRACK, 9, 7), 460_800)
OTHER_MODULE = MODULE._replace(path="/dev/m2")
WHEELTEC = PortFound("/dev/w", Recognised(Device.WHEELTEC, 9), 115_200, "1a86:55d4")
"""Its USB chip is one that LinkTrack modules have, too."""
KOBUKI = PortFound("/dev/k", Recognised(Device.KOBUKI, 9), 115_200)
LINES = PortFound("/dev/a", Recognised(Device.ASCII, 9), 57_600)
QUIET = PortFound("/dev/q", Recognised(Device.SILENT))
ROBOTEQ = QUIET._replace(path="/dev/r", usb_id="20d2:5740")
NOISE = PortFound("/dev/n", Recognised(Device.UNKNOWN))
BUSY = QUIET._replace(path="/dev/b", fault="in use by another program")


def flag(choice: object) -> str:
    assert isinstance(choice, Missing)
    return choice.flag


def test_the_only_module_is_the_module_with_its_speed_and_id() -> None:
    assert uwb_choice([KOBUKI, MODULE]) == UwbChoice("/dev/m", 460_800, 7)


def test_two_modules_or_none_are_not_chosen_from() -> None:
    two = uwb_choice([MODULE, OTHER_MODULE])
    assert str(two) == "LinkTrack modules at /dev/m, /dev/m2; say it with --uwb-port"
    none = str(uwb_choice([KOBUKI, BUSY]))
    assert "/dev/b: in use by another program" in none
    assert flag(uwb_choice([])) == "--uwb-port"


def test_a_port_that_was_named_is_the_module_whoever_speaks_there() -> None:
    assert uwb_choice([MODULE, OTHER_MODULE], "/dev/m2") == UwbChoice("/dev/m2", 460_800, 7)
    assert uwb_choice([KOBUKI], "/dev/k") == UwbChoice("/dev/k")
    assert uwb_choice([], "/dev/later") == UwbChoice("/dev/later")


@pytest.mark.parametrize(
    ("port", "source", "keys"),
    [
        (KOBUKI, "kobuki", {"port": "/dev/k"}),
        (LINES, "ascii", {"port": "/dev/a", "baud": 57_600}),
        (ROBOTEQ, "roboteq", {"port": "/dev/r"}),
        (WHEELTEC, "wheeltec", {"port": "/dev/w"}),
        (QUIET._replace(answers="roboteq", baud=115_200), "roboteq", {"port": "/dev/q"}),
    ],
)
def test_the_only_base_is_the_base(port: PortFound, source: str, keys: dict[str, Any]) -> None:
    assert wheels_choice([MODULE, NOISE, port], "", "", {}, "/dev/m") == WheelsChoice(source, keys)


def test_two_bases_or_none_are_not_chosen_from() -> None:
    assert "/dev/k, /dev/a" in str(wheels_choice([KOBUKI, LINES], "", "", {}, ""))
    assert "no base speaks at /dev/q" in str(wheels_choice([MODULE, QUIET], "", "", {}, "/dev/m"))
    assert wheels_choice([KOBUKI, LINES], "", "/dev/a", {}, "") == WheelsChoice(
        "ascii", {"port": "/dev/a", "baud": 57_600}
    )


def test_a_base_that_was_named_is_at_the_only_port_where_nobody_speaks() -> None:
    found = wheels_choice([MODULE, NOISE, QUIET], "roboteq", "", {"track_m": 0.5}, "/dev/m")
    assert found == WheelsChoice("roboteq", {"port": "/dev/q", "track_m": 0.5})
    two = [QUIET, QUIET._replace(path="/dev/q2")]
    assert flag(wheels_choice(two, "roboteq", "", {}, "")) == "--wheels-port"
    assert flag(wheels_choice([MODULE], "roboteq", "", {}, "/dev/m")) == "--wheels-port"


def test_a_base_on_can_needs_no_port() -> None:
    found = wheels_choice([MODULE], "agilex", "", {"track_m": 0.6}, "/dev/m")
    assert found == WheelsChoice("agilex", {"track_m": 0.6})
    assert wheels_choice([], "odrive", "", {}, "") == WheelsChoice("odrive", {})


def test_a_choice_names_the_keys_that_it_lacks() -> None:
    assert WheelsChoice("kobuki", {"port": "/dev/k"}).lacking == []
    assert WheelsChoice("roboteq", {"port": "/dev/r", "track_m": 0.5}).lacking == [
        "counts_per_metre"
    ]


def test_only_a_silent_port_that_can_be_no_linktrack_may_be_asked() -> None:
    assert QUIET.may_be_asked
    assert not any(p.may_be_asked for p in (MODULE, KOBUKI, NOISE, BUSY))
    assert not QUIET._replace(usb_id="1a86:55d4").may_be_asked


def test_the_robot_has_the_id_of_its_module_unless_another_was_named() -> None:
    assert robot_id_choice(None, UwbChoice("/dev/m", 0, 7)) == 7
    assert robot_id_choice(0, UwbChoice("/dev/m", 0, 7)) == 0
    assert robot_id_choice(None, UwbChoice("/dev/m", 0, 254)) == 254
    assert flag(robot_id_choice(None, UwbChoice("/dev/m", 0, 255))) == "--id"
    assert flag(robot_id_choice(None, Missing("", ""))) == "--id"


def test_the_only_network_is_the_network() -> None:
    assert interface_choice(["wlan0"], "") == "wlan0"
    assert interface_choice([], "") == ""
    assert interface_choice(["wlan0", "eth0"], "eth0") == "eth0"
    assert flag(interface_choice(["wlan0", "eth0"], "")) == "--interface"
