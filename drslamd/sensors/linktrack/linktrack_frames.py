"""The frames of Nooploop LinkTrack modules as tables.

Sources: protocol sheet NLink V1.4; where it is silent (AOA_NODE_FRAME0, the time of an entry of
NODE_FRAME2) the vendor's unpack code. Names end in the unit of the value; rows stand in the order
of their bytes. How the tables are used stands in `linktrack`.
"""

from __future__ import annotations

from enum import Enum, IntFlag
from typing import Final, NamedTuple

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
    Field,
    Slots,
    Tail,
)

EMPTY_ID: Final = 255
"""An 8-bit id that says: this entry is not valid (user manual 8.1.1)."""


class Kind(Enum):
    """Header byte and function mark."""

    ANCHOR_FRAME0 = b"\x55\x00"
    TAG_FRAME0 = b"\x55\x01"
    NODE_FRAME0 = b"\x55\x02"
    NODE_FRAME1 = b"\x55\x03"
    NODE_FRAME2 = b"\x55\x04"
    NODE_FRAME3 = b"\x55\x05"
    NODE_FRAME4 = b"\x55\x06"
    AOA_NODE_FRAME0 = b"\x55\x07"
    NODE_FRAME5 = b"\x55\x08"
    NODE_FRAME6 = b"\x55\x09"
    SETTING_FRAME0 = b"\x54\x00"
    ERROR_FRAME0 = b"\x54\xfa"
    SYSTEM_COMMON_FRAME0 = b"\x52\x00"


class ModuleFault(IntFlag):
    """Bits of ``error_bits`` in ERROR_FRAME0."""

    DUPLICATE_ID = 1 << 0
    BAD_SETTING = 1 << 1
    BAD_ANCHOR_POSITION = 1 << 2
    RESTART = 1 << 3
    HARDWARE = 1 << 4
    UWB_TRANSMIT = 1 << 5
    POSITION_ABNORMAL = 1 << 6
    USER_DATA_TOO_LONG = 1 << 7


class Layout(NamedTuple):
    """One kind of frame.

    `body` is everything before the last byte. With `has_length` the total length stands as u16 at
    offset 2, else it is always the body and one byte. The last byte is `end`, or the low byte of
    the sum of all others where `end` is None.
    """

    body: Block
    has_length: bool = True
    end: int | None = None


# rows that several frames share


def _id(offset: int) -> tuple[Field, Field]:
    return Field("role", offset, U8), Field("id", offset + 1, U8)


def _long_id(offset: int) -> tuple[Field, Field]:
    return Field("role", offset, U8), Field("id", offset + 1, U32)


def _distance(offset: int) -> Field:
    return Field("distance_m", offset, I24, 1000)


def _position(offset: int) -> Field:
    return Field("position_m", offset, I24, 1000, 3)


def _velocity(offset: int) -> Field:
    return Field("velocity_mps", offset, I24, 10_000, 3)


def _voltage(offset: int) -> Field:
    return Field("voltage_v", offset, U16, 1000)


def _local_time(offset: int) -> Field:
    return Field("local_time_ms", offset, U32)


def _system_time(offset: int) -> Field:
    return Field("system_time_ms", offset, U32)


def _error_of_position(offset: int) -> Field:
    return Field("eop_m", offset, U8, 100, 3)


def _signal(offset: int) -> tuple[Field, Field]:
    """First path and total power: a byte of 163 is -81.5 dB."""
    return Field("fp_rssi_db", offset, U8, -2), Field("rx_rssi_db", offset + 1, U8, -2)


def _inertia(gyro: int, acceleration: int, euler: int, quaternion: int) -> tuple[Field, ...]:
    return (
        Field("gyro_radps", gyro, F32, repeat=3),
        Field("acceleration_mps2", acceleration, F32, repeat=3),
        Field("euler_deg", euler, I16, 100, 3),
        Field("quaternion_wxyz", quaternion, F32, repeat=4),
    )


def _nodes(count_at: int, entry: Block) -> Tail:
    return Tail("nodes", Field("count", count_at, U8), entry)


def _user_data(size_at: int) -> Tail:
    return Tail("data", Field("size", size_at, U16), None)


# what repeats inside a frame

_TAG_SLOT: Final = Block(
    27,
    (
        Field("id", 0, U8),
        Field("role", 1, U8),
        _position(2),
        Field("distance_m", 11, U16, 100, 8),  # to anchors A0 .. A7, in centimetres
    ),
)
_TAG_RANGES: Final = Block(
    5,
    (Field("id", 0, U8), Field("voltage_v", 3, U8, 20)),
    Tail("anchors", Field("count", 4, U8), Block(4, (Field("id", 0, U8), _distance(1)))),
)
_RANGE: Final = (*_id(0), _distance(2), *_signal(5))
_BEARING: Final = (*_id(0), _distance(2), Field("angle_deg", 5, I16, 100), *_signal(7))
_LONG_RANGE: Final = (*_long_id(0), _distance(5), *_signal(8))

_HEAD: Final = (*_id(4), _local_time(6), _system_time(10), _voltage(18))
"""NODE_FRAME3, NODE_FRAME4 and AOA_NODE_FRAME0 begin alike."""

# one row for each kind of frame

LAYOUTS: Final[dict[Kind, Layout]] = {
    Kind.ANCHOR_FRAME0: Layout(
        Block(
            895,
            (
                _local_time(879),
                _voltage(887),
                _system_time(889),
                Field("id", 893, U8),
                Field("role", 894, U8),
            ),
            slots=Slots("tags", 2, 30, _TAG_SLOT, EMPTY_ID),
        ),
        has_length=False,
        end=0xEE,
    ),
    Kind.TAG_FRAME0: Layout(
        Block(
            127,
            (
                Field("id", 2, U8),
                Field("role", 3, U8),
                _position(4),
                _velocity(13),
                Field("distance_m", 22, I24, 1000, 8),  # to anchors A0 .. A7
                *_inertia(46, 58, 82, 88),
                _local_time(108),
                _system_time(112),
                _error_of_position(117),
                _voltage(120),
            ),
        ),
        has_length=False,
    ),
    Kind.NODE_FRAME0: Layout(Block(11, _id(4), _nodes(10, Block(4, _id(0), _user_data(2))))),
    Kind.NODE_FRAME1: Layout(
        Block(
            27,
            (*_id(4), _system_time(6), _local_time(10), _voltage(24)),
            _nodes(26, Block(20, (*_id(0), _position(2)))),
        )
    ),
    Kind.NODE_FRAME2: Layout(
        Block(
            119,
            (
                *_id(4),
                _system_time(6),
                _error_of_position(10),
                _position(13),
                _velocity(22),
                *_inertia(40, 52, 76, 82),
                _local_time(102),
                _voltage(116),
            ),
            _nodes(118, Block(13, (*_RANGE, _system_time(7)))),
        )
    ),
    Kind.NODE_FRAME3: Layout(Block(21, _HEAD, _nodes(20, Block(7, _RANGE)))),
    Kind.NODE_FRAME4: Layout(Block(21, _HEAD, Tail("tags", Field("count", 20, U8), _TAG_RANGES))),
    Kind.AOA_NODE_FRAME0: Layout(Block(21, _HEAD, _nodes(20, Block(11, _BEARING)))),
    Kind.NODE_FRAME5: Layout(
        Block(
            24,
            (*_long_id(4), _local_time(9), _system_time(13), _voltage(21)),
            _nodes(23, Block(10, _LONG_RANGE)),
        )
    ),
    Kind.NODE_FRAME6: Layout(
        Block(14, _long_id(4), _nodes(13, Block(7, _long_id(0), _user_data(5))))
    ),
    Kind.SETTING_FRAME0: Layout(
        Block(
            127,
            (
                Field("mix", 2, U8),
                Field("role", 3, U8),
                Field("math_model", 4, U8),
                Field("baud", 5, U24),
                Field("system_ch", 8, U8),
                Field("id", 9, U8),
                Field("update_rate_hz", 10, U16),
                Field("system_id", 12, U8),
                Field("on_off", 14, U8),
                Field("filter", 16, U8),
                Field("mode", 17, U8),
                Field("protocol", 19, U8),
                Field("tx_gain_db", 20, U8, 2),
                Field("node_capacity", 24, U8),
                _local_time(27),
                Field("anchor_group", 36, U8),
                Field("anchors_m", 37, I24, 1000, 30),  # x, y, z of ten anchors
            ),
        ),
        has_length=False,
    ),
    Kind.ERROR_FRAME0: Layout(
        Block(
            31,
            (
                *_id(4),
                _local_time(6),
                Field("error_bits", 14, U8),
                Field("marks", 17, U8, repeat=3),
            ),
        )
    ),
    Kind.SYSTEM_COMMON_FRAME0: Layout(
        Block(
            31,
            (
                Field("mix", 2, U8),
                Field("product_version", 3, VERSION2),
                Field("hardware_version", 5, VERSION2),
                Field("firmware_version", 7, VERSION4),
                Field("baud", 19, U24),
                Field("role", 22, U8),
                Field("id", 23, U8),
            ),
        ),
        has_length=False,
    ),
}
