"""What ``drslamd init`` asks a person, and how it shows what it found."""

from __future__ import annotations

import io
from argparse import Namespace
from pathlib import Path
from typing import Any

import pytest

from drslamd.cli.setting_up import init_choices
from drslamd.cli.setting_up.init_choices import (
    Chooser,
    WrongFlag,
    described,
    toml_value,
    wheel_keys,
)
from drslamd.host.interfaces import CAN_TYPE, Interface
from drslamd.sensors.recognition import Device, Recognised
from drslamd.setup.choices import PortFound, UwbChoice, WheelsChoice

QUIET = PortFound("/dev/q", Recognised(Device.SILENT))
MODULES = [PortFound(f"/dev/m{k}", Recognised(Device.LINKTRACK, 9, k), 921_600) for k in (4, 300)]


def options(**flags: Any) -> Namespace:
    nothing: dict[str, Any] = {
        "id": None,
        "uwb_port": "",
        "wheels_port": "",
        "port": [],
        "base": "",
        "wheel": [],
    }
    keys = {"key": "", "new_key": "", "insecure": False, "interface": "lo", "allow_write": False}
    return Namespace(**{**nothing, **keys, **flags})


def test_a_person_is_asked_what_nobody_can_see(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    key = tmp_path / "team.key"
    lines = ["2", "255", "12", "roboteq", "-1", "0.5", "many", "10000", str(key)]
    monkeypatch.setattr("sys.stdin", io.StringIO("\n".join(lines) + "\n"))
    flags = options()
    chooser = Chooser(flags, is_person=True)
    chooser.ports = [*MODULES, QUIET]
    chosen = chooser.chosen()
    assert chosen is not None
    assert chooser.missing == []
    assert chosen.uwb == UwbChoice("/dev/m300", 921_600, 300)
    assert chosen.robot == 12
    keys = {"port": "/dev/q", "track_m": 0.5, "counts_per_metre": 10_000}
    assert chosen.wheels == WheelsChoice("roboteq", keys)
    assert chosen.key_file == flags.new_key == str(key)
    said = capsys.readouterr().err
    assert "  2  /dev/m300" in said
    assert "  track_m = -1: a number, above 0.01 and at most 10" in said
    assert "  counts_per_metre = 'many': a number" in said


def test_ports_are_written_as_they_are_found_from_everywhere() -> None:
    flags = options(port=["a", "/dev/b"], uwb_port="a", base="kobuki", wheels_port="/dev/b", id=3)
    here = Path.cwd()
    chooser = Chooser(flags, is_person=False)
    chooser.ports = [MODULES[0]._replace(path=str(here / "a")), QUIET._replace(path="/dev/b")]
    flags.insecure = True
    chosen = chooser.chosen()
    assert chosen is not None
    assert (chosen.uwb.port, chosen.wheels.keys["port"]) == (str(here / "a"), "/dev/b")


@pytest.mark.parametrize(
    ("base", "name"), [("ascii", "an ascii base"), ("roboteq", "a roboteq base")]
)
def test_what_a_base_needs_is_said_in_english(base: str, name: str) -> None:
    chooser = Chooser(options(base=base, wheels_port="/dev/q"), is_person=False)
    chooser.ports = [*MODULES, QUIET]
    assert chooser.chosen() is None
    assert f"{name} needs counts_per_metre" in [m.why for m in chooser.missing]


def test_without_a_person_everything_that_is_missing_is_said_at_once() -> None:
    chooser = Chooser(options(), is_person=False)
    chooser.ports = [*MODULES, QUIET]
    assert chooser.chosen() is None
    assert [m.flag.split()[0] for m in chooser.missing] == ["--uwb-port", "--id", "--base", "--key"]


def test_a_bus_on_which_a_base_may_be_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    can = Interface("can0", True, False, "", CAN_TYPE)
    down = can._replace(name="can1", is_up=False)
    monkeypatch.setattr(init_choices, "interfaces", lambda: [can, down])
    chooser = Chooser(options(), is_person=False)
    chooser.ports = [*MODULES[:1]]
    chooser.chosen()
    assert chooser.found()["can"] == ["can0"]
    assert "a base may be on can0; say it with --base" in str(chooser.missing[0])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.5", 0.5),
        ("3", 3),
        ("true", True),
        ("base.dbc", "base.dbc"),
        ('"7"', "7"),
        ("A.B", "A.B"),
    ],
)
def test_a_value_is_what_it_would_be_in_the_file(text: str, value: object) -> None:
    assert toml_value(text) == value
    assert wheel_keys([f"wheels.key={text}"]) == {"key": value}


@pytest.mark.parametrize("flag", ["track_m", "=3", "track_m="])
def test_a_key_without_a_value_is_none(flag: str) -> None:
    with pytest.raises(WrongFlag, match="KEY=VALUE"):
        wheel_keys([flag])


@pytest.mark.parametrize(
    ("port", "line"),
    [
        (MODULES[0], "/dev/m4: LinkTrack at 921600 bit/s, id 4"),
        (QUIET, "/dev/q: nothing"),
        (QUIET._replace(fault="in use"), "/dev/q: in use"),
        (QUIET._replace(answers="roboteq", baud=9), "/dev/q: roboteq answers at 9 bit/s"),
        (
            QUIET._replace(usb_id="20d2:5740", name="Roboteq"),
            "/dev/q (Roboteq): says nothing; by its USB id a roboteq base",
        ),
    ],
)
def test_a_port_is_one_line(port: PortFound, line: str) -> None:
    assert described(port) == line
