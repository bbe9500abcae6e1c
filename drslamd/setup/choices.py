"""Which of the things that were found is which: chosen where only one can be meant.

A choice is never a guess. Where nothing fits, or more than one thing, the answer is what is
missing: a sentence, and the flag that settles it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Union

from drslamd.config_wheels import SOURCES, SerialWheelSection
from drslamd.conventions import MAX_ROBOT_ID
from drslamd.sensors.recognition import Device, Recognised

USB_BASES = {"20d2:5740": "roboteq"}
"""Bases that say nothing unasked, by the USB id that only their maker uses."""
TALKING_BASES = {Device.KOBUKI: "kobuki", Device.ASCII: "ascii", Device.WHEELTEC: "wheeltec"}
LINKTRACK_BRIDGES = {"10c4:ea60", "1a86:55d4", "1a86:55d3"}
"""USB chips of LinkTrack modules, and of many other things: never written to by chance."""


class PortFound(NamedTuple):
    """A serial port and who speaks there.

    Attributes:
        baud: at which it was recognised, 0 when it was not.
        answers: the base that it turned out to be when it was asked, empty when it was not.
    """

    path: str
    who: Recognised
    baud: int = 0
    usb_id: str = ""
    name: str = ""
    fault: str = ""
    answers: str = ""

    @property
    def base(self) -> str:
        """`wheels.source` of what is there, empty when it is no base that is known."""
        if self.fault:
            return ""
        talking = TALKING_BASES.get(self.who.device, "")
        is_linktrack = self.who.device is Device.LINKTRACK
        return talking or self.answers or ("" if is_linktrack else USB_BASES.get(self.usb_id, ""))

    @property
    def may_be_asked(self) -> bool:
        """Can it be no LinkTrack? Whatever speaks unasked may be one at an odd speed."""
        is_quiet = self.who.device is Device.SILENT and not self.fault
        return is_quiet and self.usb_id not in LINKTRACK_BRIDGES


class Missing(NamedTuple):
    """What cannot be chosen: why, and the flag that says it."""

    why: str
    flag: str

    def __str__(self) -> str:
        return f"{self.why}; say it with {self.flag}"


class UwbChoice(NamedTuple):
    """Of the section ``[uwb]``; `baud` 0 and `uwb_id` None where they are not known."""

    port: str
    baud: int = 0
    uwb_id: int | None = None


class WheelsChoice(NamedTuple):
    """Of the section ``[wheels]``: source, and keys with their values."""

    source: str
    keys: Mapping[str, Any]

    @property
    def lacking(self) -> list[str]:
        """Keys without which this base cannot be used."""
        fields = SOURCES[self.source].model_fields
        return [
            name
            for name, field in fields.items()
            if field.is_required() and name != "source" and name not in self.keys
        ]


def uwb_choice(ports: Sequence[PortFound], named: str = "") -> Union[UwbChoice, Missing]:
    """The LinkTrack module: at the port that was named, or the only one that speaks."""
    if named:
        found = next((p for p in ports if p.path == named), None)
        if found is None or found.who.device is not Device.LINKTRACK:
            return UwbChoice(named)
        return UwbChoice(named, found.baud, found.who.uwb_id)
    modules = [p for p in ports if p.who.device is Device.LINKTRACK]
    if len(modules) == 1:
        return UwbChoice(modules[0].path, modules[0].baud, modules[0].who.uwb_id)
    if modules:
        return Missing(f"LinkTrack modules at {_listed(modules)}", "--uwb-port")
    busy = [p for p in ports if p.fault]
    because = "".join(f"; {p.path}: {p.fault}" for p in busy)
    return Missing(f"no LinkTrack speaks at {_listed(ports)}{because}", "--uwb-port")


def wheels_choice(
    ports: Sequence[PortFound], base: str, named: str, keys: Mapping[str, Any], uwb_port: str
) -> Union[WheelsChoice, Missing]:
    """The base.

    Args:
        base: its `wheels.source`, empty when it has to be found.
        named: its port, likewise.
        keys: further ones of its section.
        uwb_port: where the base is not.
    """
    others = [p for p in ports if p.path != uwb_port]
    if not base:
        there = [p for p in others if p.base and named in ("", p.path)]
        if len(there) != 1:
            found = (
                f"bases at {_listed(there)}" if there else f"no base speaks at {_listed(others)}"
            )
            return Missing(found, f"--base ({', '.join(SOURCES)}) and --wheels-port")
        base, named = there[0].base, there[0].path
    if not issubclass(SOURCES[base], SerialWheelSection):
        return WheelsChoice(base, keys)
    port = named or str(keys.get("port", ""))
    if not port:
        fitting = [p for p in others if p.base == base] or [p for p in others if p.may_be_asked]
        if len(fitting) != 1:
            where = f"it may be at {_listed(fitting)}" if fitting else "no port is left for it"
            return Missing(f"the port of the {base} base is not known: {where}", "--wheels-port")
        port = fitting[0].path
    found_there = next((p for p in ports if p.path == port), None)
    speed = {"baud": found_there.baud} if found_there and found_there.base == base else {}
    usual = SOURCES[base].model_fields["baud"].default
    if speed.get("baud") in (0, usual):
        speed = {}
    return WheelsChoice(base, {"port": port, **speed, **keys})


def robot_id_choice(named: int | None, uwb: UwbChoice | Missing) -> Union[int, Missing]:
    """The id that was named, or that of the module."""
    if named is not None:
        return named
    uwb_id = uwb.uwb_id if isinstance(uwb, UwbChoice) else None
    if uwb_id is not None and uwb_id <= MAX_ROBOT_ID:
        return uwb_id
    return Missing("which robot of the team this is nobody can see", "--id")


def interface_choice(names: Sequence[str], named: str) -> Union[str, Missing]:
    """The interface that was named, or the only one that can carry multicast."""
    if named or not names:
        return named
    if len(names) == 1:
        return names[0]
    return Missing(f"the team may be reached by {', '.join(names)}", "--interface")


def _listed(ports: Sequence[PortFound]) -> str:
    return ", ".join(p.path for p in ports) or "any serial port, because there is none"
