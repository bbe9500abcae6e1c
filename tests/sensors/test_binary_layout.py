"""Blocks of named values, and what follows them."""

from __future__ import annotations

import struct

import pytest

from drslamd.sensors.binary_layout import (
    F32,
    I16,
    I24,
    U8,
    U16,
    U24,
    U32,
    VERSION2,
    VERSION4,
    Block,
    BlockReader,
    Field,
    Slots,
    Tail,
    Type,
)


def value_of(data: bytes, field: Field, at: int = 0) -> object:
    """Read as the only row of a block that begins at `at` and ends with the field."""
    size = field.offset + field.type.size * field.repeat
    read = BlockReader(Block(size, (field,))).read(data, at, len(data))
    assert read is not None
    return read[0][field.name]


@pytest.mark.parametrize(
    ("kind", "raw", "value"),
    [
        (U8, b"\xff", 255),
        (U16, b"\x01\xff", 0xFF01),
        (U24, b"\x01\x02\xff", 0xFF0201),
        (U32, b"\x01\x02\x03\xff", 0xFF030201),
        (I16, b"\xff\xff", -1),
        (I16, b"\xff\x7f", 32_767),
        (I24, b"\x00\x00\x80", -(2**23)),
        (I24, b"\xff\xff\x7f", 2**23 - 1),
        (F32, struct.pack("<f", -1.5), -1.5),
        (VERSION2, bytes([17, 0]), "0.17"),
        (VERSION4, bytes([162, 2, 0, 4]), "4.0.2.162"),
    ],
)
def test_values_are_little_endian_with_their_sign(
    kind: Type, raw: bytes, value: float | str
) -> None:
    assert len(raw) == kind.size
    assert value_of(b"?" + raw + b"?", Field("value", 1, kind)) == value


def test_a_field_may_repeat_and_may_be_divided() -> None:
    data = bytes([9, 10, 20, 30])
    assert value_of(data, Field("value", 1, U8, 10)) == 1.0
    assert value_of(data, Field("value", 1, U8, 10, 3)) == (1.0, 2.0, 3.0)
    # offsets count from the block
    assert value_of(data, Field("value", 1, U8), 1) == 20


def test_rows_may_stand_in_any_order_and_leave_gaps() -> None:
    block = Block(6, (Field("last", 5, U8), Field("first", 1, U16), Field("middle", 3, U8)))
    read = BlockReader(block).read(bytes([9, 1, 2, 3, 9, 5]), 0, 6)
    assert read == ({"last": 5, "first": 0x0201, "middle": 3}, 6)


@pytest.mark.parametrize(
    ("size", "second", "why"), [(4, 1, "second overlaps"), (3, 2, "second passes the end")]
)
def test_a_table_that_cannot_be_is_refused(size: int, second: int, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        BlockReader(Block(size, (Field("first", 0, U16), Field("second", second, U16))))


def test_slots_that_are_empty_are_left_out() -> None:
    entry = Block(2, (Field("id", 0, U8), Field("value", 1, U8)))
    block = Block(7, (), slots=Slots("tags", 1, 3, entry, 255))
    read = BlockReader(block).read(bytes([0, 4, 40, 255, 50, 6, 60]), 0, 7)
    assert read == ({"tags": ({"id": 4, "value": 40}, {"id": 6, "value": 60})}, 7)


@pytest.mark.parametrize(("end", "fits"), [(12, False), (13, True)])
def test_no_block_is_read_beyond_its_end(end: int, fits: bool) -> None:
    text = Tail("text", Field("size", 1, U8), None)
    entry = Block(3, (Field("number", 0, U8),), text)
    block = Block(2, (), Tail("entries", Field("count", 0, U8), entry))
    data = bytes([2, 0]) + bytes([7, 1, 0]) + b"x" + bytes([8, 4, 0]) + b"text"
    expected = {"entries": ({"number": 7, "text": b"x"}, {"number": 8, "text": b"text"})}
    assert BlockReader(block).read(data + b"more", 0, end) == ((expected, 13) if fits else None)
