"""Binary frames described by tables, and the one reader for all of them.

Everything is little-endian and packed. A table names what it wants; bytes that no row names are
reserved and may hold anything. Offsets count from the first byte of the block they stand in.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection
from typing import Any, Final, NamedTuple


class Type(NamedTuple):
    """How a value is read: its code in the language of `struct`, and what is made of that."""

    code: str
    made: Callable[[bytes], Any] | None = None

    @property
    def size(self) -> int:
        return struct.calcsize("<" + self.code)


def _unsigned(raw: bytes) -> int:
    return int.from_bytes(raw, "little")


def _signed(raw: bytes) -> int:
    return int.from_bytes(raw, "little", signed=True)


def _version(raw: bytes) -> str:
    return ".".join(str(part) for part in reversed(raw))


U8: Final = Type("B")
U16: Final = Type("H")
U24: Final = Type("3s", _unsigned)
U32: Final = Type("I")
I16: Final = Type("h")
I24: Final = Type("3s", _signed)
F32: Final = Type("f")
VERSION2: Final = Type("2s", _version)
VERSION4: Final = Type("4s", _version)


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


def narrowed(block: Block, names: Collection[str]) -> Block:
    """The same block of which only these values are read, in its entries too.

    The values by which entries are counted and left out are always read.
    """
    tail, slots = block.tail, block.slots
    if tail is not None and tail.entry is not None:
        tail = tail._replace(entry=narrowed(tail.entry, names))
    if slots is not None:
        slots = slots._replace(entry=narrowed(slots.entry, {*names, "id"}))
    fields = tuple(field for field in block.fields if field.name in names)
    return Block(block.size, fields, tail, slots)


class _Value(NamedTuple):
    """A value that needs more than to be unpacked: where it stands among those that were."""

    name: str
    first: int
    last: int
    made: Callable[[Any], Any]

    def of(self, raw: tuple[Any, ...]) -> Any:
        values = tuple(map(self.made, raw[self.first : self.last]))
        return values[0] if len(values) == 1 else values


def _making(field: Field) -> Callable[[Any], Any]:
    """What is made of one unpacked value of a field."""
    made, divisor = field.type.made, field.divisor
    if made is None:
        return lambda raw: raw if divisor == 1 else raw / divisor
    return made if divisor == 1 else lambda raw: made(raw) / divisor


class BlockReader:
    """Reads one kind of block, its table compiled into a `struct.Struct`.

    Raises:
        ValueError: values of the table overlap, or pass the end of the block.
    """

    def __init__(self, block: Block) -> None:
        self._size, self._tail, self._slots = block.size, block.tail, block.slots
        number = (block.tail.number,) if block.tail is not None else ()
        fields = sorted((*block.fields, *number), key=lambda field: field.offset)
        codes, at = "<", 0
        names: list[str] = []
        self._single: list[tuple[str, int, Callable[[Any], Any]]] = []
        self._repeated: list[_Value] = []
        for field in fields:
            if field.offset < at:
                raise ValueError(f"{field.name} overlaps what stands before it")
            codes += f"{field.offset - at}x" + field.type.code * field.repeat
            at = field.offset + field.type.size * field.repeat
            first, last = len(names), len(names) + field.repeat
            if field.repeat > 1:
                self._repeated.append(_Value(field.name, first, last, _making(field)))
            elif field.type.made is not None or field.divisor != 1:
                self._single.append((field.name, first, _making(field)))
            names += [field.name] * field.repeat
        if at > block.size:
            raise ValueError(f"{fields[-1].name} passes the end of its block")
        self._names = tuple(names)
        self._struct = struct.Struct(f"{codes}{block.size - at}x")
        entry = block.tail.entry if block.tail is not None else None
        self._entry = None if entry is None else BlockReader(entry)
        self._slot = None if block.slots is None else BlockReader(block.slots.entry)

    def read(self, data: bytes, at: int, end: int) -> tuple[dict[str, Any], int] | None:
        """Values of the block at `at` by name, with its tail, and where it ends.

        Entries are tuples of such dictionaries, plain bytes are bytes. None when anything would
        pass `end`.
        """
        after = at + self._size
        if after > end:
            return None
        values = self._values(self._struct.unpack_from(data, at))
        if self._slots is not None and self._slot is not None:
            start = at + self._slots.offset
            entries = self._slot._in_a_row(data[start:], self._slots.number)
            empty = self._slots.empty_id
            values[self._slots.name] = tuple(e for e in entries if e["id"] != empty)
        if self._tail is None:
            return values, after
        tail = self._read_tail(data, after, end, values.pop(self._tail.number.name))
        if tail is None:
            return None
        values[self._tail.name], after = tail
        return values, after

    def _values(self, raw: tuple[Any, ...]) -> dict[str, Any]:
        values = dict(zip(self._names, raw, strict=True))
        for name, at, made in self._single:
            values[name] = made(raw[at])
        for value in self._repeated:
            values[value.name] = value.of(raw)
        return values

    def _in_a_row(self, data: bytes, number: int) -> tuple[dict[str, Any], ...]:
        """So many blocks without a tail, one after the other."""
        raw = self._struct.iter_unpack(data[: number * self._size])
        return tuple(map(self._values, raw))

    def _read_tail(
        self, data: bytes, at: int, end: int, number: int
    ) -> tuple[bytes | tuple[dict[str, Any], ...], int] | None:
        entry = self._entry
        if entry is None or entry._tail is None:
            after = at + number * (1 if entry is None else entry._size)
            if after > end:
                return None
            found = data[at:after]
            return (found if entry is None else entry._in_a_row(found, number)), after
        entries = []
        for _ in range(number):
            one = entry.read(data, at, end)
            if one is None:
                return None
            values, at = one
            entries.append(values)
        return tuple(entries), at
