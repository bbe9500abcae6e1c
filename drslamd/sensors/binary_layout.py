"""Binary frames described by tables, and the one reader for all of them.

Everything is little-endian and packed. A table names what it wants; bytes that no row names are
reserved and may hold anything. Offsets count from the first byte of the block they stand in.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, Final, NamedTuple


class Type(NamedTuple):
    """How many bytes a value takes and how they are read."""

    size: int
    read: Callable[[bytes], Any]


def _unsigned(raw: bytes) -> int:
    return int.from_bytes(raw, "little")


def _signed(raw: bytes) -> int:
    return int.from_bytes(raw, "little", signed=True)


def _float(raw: bytes) -> float:
    (value,) = struct.unpack("<f", raw)
    return float(value)


def _version(raw: bytes) -> str:
    return ".".join(str(part) for part in reversed(raw))


U8: Final = Type(1, _unsigned)
U16: Final = Type(2, _unsigned)
U24: Final = Type(3, _unsigned)
U32: Final = Type(4, _unsigned)
I16: Final = Type(2, _signed)
I24: Final = Type(3, _signed)
F32: Final = Type(4, _float)
VERSION2: Final = Type(2, _version)
VERSION4: Final = Type(4, _version)


class Field(NamedTuple):
    """One value, or a tuple of `repeat` values; a raw number is divided by `divisor`."""

    name: str
    offset: int
    type: Type
    divisor: int = 1
    repeat: int = 1


class Slots(NamedTuple):
    """A fixed number of entries inside a block; those whose ``id`` is `empty_id` are left out."""

    name: str
    offset: int
    number: int
    entry: Block
    empty_id: int


class Tail(NamedTuple):
    """What follows a block: `number` entries, or as many plain bytes where `entry` is None."""

    name: str
    number: Field
    entry: Block | None


class Block(NamedTuple):
    """`size` bytes of named values, then what `tail` says."""

    size: int
    fields: tuple[Field, ...]
    tail: Tail | None = None
    slots: Slots | None = None


def read_field(data: bytes, at: int, field: Field) -> Any:
    """The value of `field` in the block that starts at `at`."""
    _, offset, (size, read), divisor, repeat = field
    start = at + offset
    if repeat == 1:
        value = read(data[start : start + size])
        return value if divisor == 1 else value / divisor
    single = field._replace(offset=0, repeat=1)
    return tuple(read_field(data, start + k * size, single) for k in range(repeat))


def read_block(data: bytes, at: int, end: int, block: Block) -> tuple[dict[str, Any], int] | None:
    """Values of the block at `at` by name, with its tail, and where it ends.

    Entries are tuples of such dictionaries, plain bytes are bytes. None when anything would pass
    `end`.
    """
    after = at + block.size
    if after > end:
        return None
    values = {field.name: read_field(data, at, field) for field in block.fields}
    if block.slots is not None:
        values[block.slots.name] = _read_slots(data, at, block.slots)
    if block.tail is None:
        return values, after
    number = read_field(data, at, block.tail.number)
    tail = _read_tail(data, after, end, number, block.tail.entry)
    if tail is None:
        return None
    values[block.tail.name], after = tail
    return values, after


def _read_tail(
    data: bytes, at: int, end: int, number: int, entry: Block | None
) -> tuple[bytes | tuple[dict[str, Any], ...], int] | None:
    if entry is None:
        return (data[at : at + number], at + number) if at + number <= end else None
    entries = []
    for _ in range(number):
        one = read_block(data, at, end, entry)
        if one is None:
            return None
        values, at = one
        entries.append(values)
    return tuple(entries), at


def _read_slots(data: bytes, at: int, slots: Slots) -> tuple[dict[str, Any], ...]:
    entries = []
    for k in range(slots.number):
        start = at + slots.offset + k * slots.entry.size
        values = {field.name: read_field(data, start, field) for field in slots.entry.fields}
        if values["id"] != slots.empty_id:
            entries.append(values)
    return tuple(entries)
