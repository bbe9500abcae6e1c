"""Bytes of ROS 2 messages: CDR, little endian, as the default middleware of ROS 2 writes it.

Four bytes say so; then every number stands at a multiple of its own size, counted from there.
Strings and sequences begin with how many bytes or elements they have; a string ends with a zero.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

from drslamd.export.ros2.definitions import TYPES

LITTLE_ENDIAN = b"\x00\x01\x00\x00"
NUMBERS = {"byte": "B", "int32": "i", "uint32": "I", "float64": "d"}


def serialised(name: str, message: Mapping[str, Any]) -> bytes:
    """One message: a value for every field; numbers, strings, lists and messages.

    Raises:
        KeyError: a field has no value. ValueError: an array of another length.
    """
    out = bytearray()
    _message(out, name, message)
    return LITTLE_ENDIAN + bytes(out)


def _message(out: bytearray, name: str, message: Mapping[str, Any]) -> None:
    for kind, field in TYPES[name]:
        inner, is_list, length = kind.partition("[")
        if not is_list:
            _value(out, kind, message[field])
            continue
        values = message[field]
        if length == "]":
            _number(out, "I", len(values))
        elif len(values) != int(length[:-1]):
            raise ValueError(f"{field} has {len(values)} elements, not {length[:-1]}")
        for value in values:
            _value(out, inner, value)


def _value(out: bytearray, kind: str, value: Any) -> None:
    if kind in NUMBERS:
        _number(out, NUMBERS[kind], value)
    elif kind == "string":
        text = value.encode() + b"\x00"
        _number(out, "I", len(text))
        out += text
    else:
        _message(out, kind, value)


def _number(out: bytearray, code: str, value: Any) -> None:
    size = struct.calcsize(f"<{code}")
    out += bytes(-len(out) % size) + struct.pack(f"<{code}", value)
