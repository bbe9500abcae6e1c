"""What ``drslamd init`` decides: by flags, by what was found, by asking whoever sits there."""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar, Union

import tomli
from pydantic import ValidationError

from drslamd.cli.setting_up.asking import ask, one_of, show
from drslamd.config import ConfigError
from drslamd.config_faults import sentences
from drslamd.config_wheels import SOURCES
from drslamd.conventions import MAX_ROBOT_ID
from drslamd.host.interfaces import CAN_TYPE, interfaces
from drslamd.io.ports.found_ports import devices_at, found_ports
from drslamd.io.ports.serial_devices import serial_devices
from drslamd.io.state_store import read_key
from drslamd.setup import choices
from drslamd.setup.choices import Missing, PortFound, UwbChoice, WheelsChoice
from drslamd.setup.first_config import FirstConfig

Value = TypeVar("Value")

KEY_FILE = "/etc/drslamd/team.key"


class WrongFlag(Exception):
    """A flag says what cannot be; one sentence."""


class Chooser:
    """Of one run.

    Attributes:
        missing: what nobody could choose.
    """

    def __init__(self, options: argparse.Namespace, is_person: bool) -> None:
        """
        Raises:
            WrongFlag: a flag cannot be meant.
        """
        self._options = options
        options.port = [os.path.abspath(port) for port in options.port]
        options.uwb_port, options.wheels_port = map(_whole, (options.uwb_port, options.wheels_port))
        self._is_person = is_person
        self._keys = wheel_keys(options.wheel)
        if options.id is not None and not 0 <= options.id <= MAX_ROBOT_ID:
            raise WrongFlag(f"--id {options.id}: 0 to {MAX_ROBOT_ID}")
        if options.new_key and os.path.lexists(options.new_key):
            raise WrongFlag(f"--new-key {options.new_key}: it exists; name it with --key")
        there = [i for i in interfaces() if i.is_up]
        self._can = [i.name for i in there if i.kind == CAN_TYPE]
        self._interfaces = [
            i.name for i in there if i.carries_multicast and i.address and i.kind != CAN_TYPE
        ]
        self.ports: list[PortFound] = []
        self.missing: list[Missing] = []

    def look(self) -> None:
        """Hear all ports."""
        options = self._options
        named = [p for p in (*options.port, options.uwb_port, options.wheels_port) if p]
        devices = devices_at(named, [] if options.port else serial_devices())
        if devices:
            print(
                f"listening to {len(devices)} serial port(s), up to ten seconds ...",
                file=sys.stderr,
            )
        heard = lambda port: print(f"  {described(port)}", file=sys.stderr)  # noqa: E731
        asked = options.allow_write and options.base in ("", "roboteq")
        self.ports = asyncio.run(found_ports(devices, may_ask=asked, heard_one=heard))

    def chosen(self) -> FirstConfig | None:
        """Everything, or None where something is missing."""
        uwb = self._settle(choices.uwb_choice(self.ports, self._options.uwb_port), self._ask_uwb)
        robot = self._settle(
            choices.robot_id_choice(self._options.id, uwb or Missing("", "")), self._ask_id
        )
        wheels = self._wheels(uwb.port if uwb else "")
        interface = self._settle(
            choices.interface_choice(self._interfaces, self._options.interface),
            lambda: self._ask_one("which network reaches the team", self._interfaces),
        )
        key = self._settle(self._key(), self._ask_key)
        if self.missing or uwb is None or robot is None or wheels is None:
            return None
        return FirstConfig(robot, uwb, wheels, interface or "", key or "")

    def found(self) -> dict[str, Any]:
        """For a program."""
        return {
            "ports": [
                {
                    "path": port.path,
                    "device": port.who.device.name.lower(),
                    "baud": port.baud or None,
                    "uwb_id": port.who.uwb_id,
                    "base": port.base or None,
                    "usb_id": port.usb_id,
                    "name": port.name,
                    "fault": port.fault,
                }
                for port in self.ports
            ],
            "interfaces": self._interfaces,
            "can": self._can,
        }

    def _settle(
        self, choice: Union[Value, Missing], by_asking: Callable[[], Value]
    ) -> Union[Value, None]:
        if not isinstance(choice, Missing):
            return choice
        if self._is_person:
            print(f"{choice.why}.", file=sys.stderr)
            return by_asking()
        self.missing.append(choice)
        return None

    def _wheels(self, uwb_port: str) -> WheelsChoice | None:
        def choice(base: str, port: str) -> Union[WheelsChoice, Missing]:
            return choices.wheels_choice(self.ports, base, port, self._keys, uwb_port)

        options = self._options
        base, port = options.base, options.wheels_port
        found = choice(base, port)
        if isinstance(found, Missing) and not base and self._can:
            found = found._replace(why=f"{found.why}; a base may be on {', '.join(self._can)}")
        if isinstance(found, Missing) and self._is_person:
            print(f"{found.why}.", file=sys.stderr)
            base = base or self._ask_one("which base is it (wheels.source)", [*SOURCES])
            found = choice(base, port)
            if isinstance(found, Missing):
                others = [p.path for p in self.ports if p.path != uwb_port]
                found = choice(base, self._ask_one("at which port is the base", others))
        if isinstance(found, Missing):
            self.missing.append(found)
            return None
        return self._completed(found)

    def _completed(self, wheels: WheelsChoice) -> WheelsChoice | None:
        """With the keys that this base cannot do without."""
        keys = dict(wheels.keys)
        for key in wheels.lacking:
            if self._is_person:
                keys[key] = ask(f"wheels.{key}", partial(_fitting, wheels.source, keys, key))
            else:
                flag = f"--wheel {key}=VALUE"
                article = "an" if wheels.source[0] in "aeiou" else "a"
                self.missing.append(Missing(f"{article} {wheels.source} base needs {key}", flag))
        return WheelsChoice(wheels.source, keys)

    def _key(self) -> Union[str, Missing]:
        """An empty one is a team without."""
        options = self._options
        if options.insecure:
            return ""
        if options.new_key:
            return str(os.path.abspath(options.new_key))
        if options.key:
            path: str = os.path.abspath(options.key)
            try:
                read_key(path)
            except ConfigError as error:
                raise WrongFlag(error.faults[0]) from None
            return path
        why = "a team has a key, the same on every robot"
        return Missing(why, "--key FILE, --new-key FILE or --insecure")

    def _ask_key(self) -> str:
        path = ask("its file; it is made if there is none", _plain, KEY_FILE)
        is_there = os.path.lexists(path)
        self._options.key, self._options.new_key = (path, "") if is_there else ("", path)
        key = self._key()
        assert isinstance(key, str)
        return key

    def _ask_uwb(self) -> UwbChoice:
        port = self._ask_one("at which port is the LinkTrack", [p.path for p in self.ports])
        choice = choices.uwb_choice(self.ports, port)
        assert isinstance(choice, UwbChoice)
        return choice

    def _ask_id(self) -> int:
        return ask(f"robot.id, 0 to {MAX_ROBOT_ID}, unique in the team", _robot_id)

    def _ask_one(self, question: str, of: list[str]) -> str:
        show(of)
        return ask(question, one_of(of))


def described(port: PortFound) -> str:
    """One line for a person."""
    who = port.fault or (f"{port.base} answers" if port.answers else port.who.device.value)
    if port.who.device.name == "SILENT" and port.base and not port.answers:
        who = f"says nothing; by its USB id a {port.base} base"
    speed = f" at {port.baud} bit/s" if port.baud else ""
    uwb = f", id {port.who.uwb_id}" if port.who.uwb_id is not None else ""
    name = f" ({port.name})" if port.name else ""
    return f"{port.path}{name}: {who}{speed}{uwb}"


def wheel_keys(flags: list[str]) -> dict[str, Any]:
    """Of ``--wheel KEY=VALUE``.

    Raises:
        WrongFlag: it is none.
    """
    keys = {}
    for flag in flags:
        key, equals, value = flag.partition("=")
        if not equals or not key or not value:
            raise WrongFlag(f"--wheel {flag}: KEY=VALUE, such as track_m=0.5")
        keys[key.removeprefix("wheels.")] = toml_value(value)
    return keys


def toml_value(text: str) -> Any:
    """As in the file; what is no number, no truth and not in quotes is text."""
    if not text:
        raise ValueError("a value")
    try:
        return tomli.loads(f"x = {text}")["x"]
    except ValueError:
        return text


def _fitting(source: str, keys: Mapping[str, Any], key: str, line: str) -> Any:
    """The value of a key as a person typed it.

    Raises:
        ValueError: the configuration does not take it.
    """
    value = toml_value(line)
    try:
        SOURCES[source].model_validate({**keys, "source": source, key: value})
    except ValidationError as error:
        wrong = [
            fault for fault in sentences(error, SOURCES[source]) if fault.startswith(f"{key} =")
        ]
        if wrong:
            raise ValueError(wrong[0]) from None
    return value


def _whole(port: str) -> str:
    """From wherever the daemon will be started."""
    return os.path.abspath(port) if port else ""


def _plain(line: str) -> str:
    if not line:
        raise ValueError("a file")
    return line


def _robot_id(line: str) -> int:
    if not line.isdecimal() or not 0 <= int(line) <= MAX_ROBOT_ID:
        raise ValueError(f"a whole number, 0 to {MAX_ROBOT_ID}")
    return int(line)
