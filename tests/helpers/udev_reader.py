"""As much of udev(7) as our rules use: enough to run them on devices that are not here."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import NamedTuple

_TERM = re.compile(r'([A-Z]+)(?:\{([^}]+)\})?(==|!=|\+=|=)"([^"]*)"')
_MATCHES = {"ACTION", "SUBSYSTEM", "KERNEL", "ATTRS", "ENV"}
_ASSIGNMENTS = {"SYMLINK", "GROUP", "MODE", "TAG", "ATTR", "ENV", "GOTO", "LABEL"}


class Term(NamedTuple):
    key: str
    argument: str
    operator: str
    value: str


@dataclass
class Device:
    """A device and what the rules made of it; `parents` are the attributes of each ancestor."""

    subsystem: str
    parents: Sequence[Mapping[str, str]]
    action: str = "add"
    properties: dict[str, str] = field(default_factory=dict)
    written: dict[str, str] = field(default_factory=dict)
    symlinks: list[str] = field(default_factory=list)
    tags: list[str] = field(default_factory=list)
    group: str = ""
    mode: str = ""


def read(text: str) -> list[list[Term]]:
    """The rules of a file.

    Raises:
        ValueError: a line is not a rule, or says what this reader does not know.
    """
    rules = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        terms = []
        for part in re.split(r",\s*(?=[A-Z])", line.strip()):
            match = _TERM.fullmatch(part)
            if match is None:
                raise ValueError(f"line {number}: {part}")
            term = Term(match[1], match[2] or "", match[3], match[4])
            known = _MATCHES if term.operator in ("==", "!=") else _ASSIGNMENTS
            if term.key not in known:
                raise ValueError(f"line {number}: {term.key} {term.operator}")
            terms.append(term)
        rules.append(terms)
    return rules


def apply(rules: list[list[Term]], device: Device) -> Device:
    """Run the rules on a device, in order, with their jumps."""
    skip_to = ""
    for terms in rules:
        labels = [term.value for term in terms if term.key == "LABEL"]
        if skip_to and skip_to not in labels:
            continue
        skip_to = ""
        if _fits(terms, device):
            for term in terms:
                if term.key == "GOTO":
                    skip_to = term.value
                elif term.operator in ("=", "+="):
                    _assign(term, device)
    if skip_to:
        raise ValueError(f"no label {skip_to}")
    return device


def _fits(terms: list[Term], device: Device) -> bool:
    matches = [term for term in terms if term.operator in ("==", "!=")]
    of_parents = [term for term in matches if term.key == "ATTRS"]
    one_parent = any(
        all(_same(parent.get(t.argument, ""), t) for t in of_parents) for parent in device.parents
    )
    own = {"ACTION": device.action, "SUBSYSTEM": device.subsystem}
    others = [term for term in matches if term.key != "ATTRS"]
    values = [own.get(t.key, device.properties.get(t.argument, "")) for t in others]
    return (not of_parents or one_parent) and all(map(_same, values, others))


def _same(value: str, term: Term) -> bool:
    equal = any(fnmatchcase(value, pattern) for pattern in term.value.split("|"))
    return equal == (term.operator == "==")


def _assign(term: Term, device: Device) -> None:
    value = re.sub(r"\$env\{(\w+)\}", lambda m: device.properties.get(m[1], ""), term.value)
    if term.key == "ENV":
        device.properties[term.argument] = value
    elif term.key == "ATTR":
        device.written[term.argument] = value
    elif term.key == "SYMLINK":
        device.symlinks.append(value)
    elif term.key == "TAG":
        device.tags.append(value)
    elif term.key == "GROUP":
        device.group = value
    elif term.key == "MODE":
        device.mode = value
