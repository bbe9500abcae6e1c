"""One signal of a CAN frame: which bits it has, and what they mean.

Only the bits asked for have to be there and in order: what else a frame holds, how long it is and
which pages a multiplexed message has besides is nobody's trouble.
"""

from __future__ import annotations

import math
import re
import struct
from typing import TYPE_CHECKING, Final, Union

from drslamd.sensors.wheels.wheel_driver import WheelRefusal

if TYPE_CHECKING:
    from cantools.database import Message
    from cantools.database.can.signal import Signal

Value = Union[int, float]
Read = Union[Value, WheelRefusal, None]
"""A value, why there is none, or None when the frame is another page of its message."""

_FLOATS: Final = {16: ("<H", "<e"), 32: ("<I", "<f"), 64: ("<Q", "<d")}
_NO_VALUE: Final = re.compile(r"\b(sna|n/?a|not.?avail\w*|invalid|error|unknown)\b", re.IGNORECASE)
_LEAST_BITS_OF_A_MARK: Final = 8
"""All ones in fewer bits are more often a value than the mark of none."""


class SignalReader:
    """Reads one signal of a message.

    Args:
        message: as the DBC file describes it.
        name: of the signal.
    """

    def __init__(self, message: Message, name: str) -> None:
        signals = {signal.name: signal for signal in message.signals}
        self._signal = signals[name]
        self._pages: list[tuple[Signal, frozenset[int]]] = []
        signal = self._signal
        while signal.multiplexer_signal is not None and len(self._pages) < len(signals):
            pages = frozenset(signal.multiplexer_ids or ())
            signal = signals[signal.multiplexer_signal]
            self._pages.append((signal, pages))

    def raw(self, data: bytes) -> Read:
        """The number as it was sent, with the sign that the factor of the file gives it."""
        value = self._sent(data)
        if value is None or isinstance(value, WheelRefusal):
            return value
        return -value if self._signal.scale < 0 else value

    def scaled(self, data: bytes) -> Read:
        """The number in the unit that the file names, always finite."""
        value = self._sent(data)
        if value is None or isinstance(value, WheelRefusal):
            return value
        try:
            scaled = float(value * self._signal.scale + self._signal.offset)
        except OverflowError:  # a factor or an offset in the file that no float can hold
            return WheelRefusal.NOT_FINITE
        return scaled if math.isfinite(scaled) else WheelRefusal.NOT_FINITE

    def _sent(self, data: bytes) -> Read:
        for multiplexer, pages in reversed(self._pages):
            page = _bits(multiplexer, data)
            if page is None:
                return WheelRefusal.SHORT
            if page not in pages:
                return None
        bits = _bits(self._signal, data)
        if bits is None:
            return WheelRefusal.SHORT
        if self._signal.is_float:
            return _as_float(bits, self._signal.length)
        value = _signed(bits, self._signal.length) if self._signal.is_signed else bits
        return WheelRefusal.NOT_AVAILABLE if self._is_a_mark(value) else value

    def _is_a_mark(self, value: int) -> bool:
        """Does the file say that this number stands for "no value"?"""
        signal = self._signal
        if signal.choices and _NO_VALUE.search(str(signal.choices.get(value, ""))):
            return True
        if signal.is_signed or signal.length < _LEAST_BITS_OF_A_MARK or signal.maximum is None:
            return False
        return value == (1 << signal.length) - 1 and _is_above(value, signal)


def _is_above(value: int, signal: Signal) -> bool:
    low, high = float(signal.minimum or 0), float(signal.maximum or 0)
    try:
        return bool(low < high and not low <= value * signal.scale + signal.offset <= high)
    except OverflowError:
        return False


def _bits(signal: Signal, data: bytes) -> int | None:
    """Its bits as an unsigned number, None where the frame ends before them."""
    if signal.byte_order == "little_endian":
        if signal.start + signal.length > 8 * len(data):
            return None
        return int.from_bytes(data, "little") >> signal.start & ((1 << signal.length) - 1)
    first = 8 * (signal.start // 8) + 7 - signal.start % 8  # from the left
    behind = 8 * len(data) - first - signal.length
    if behind < 0:
        return None
    return int.from_bytes(data, "big") >> behind & ((1 << signal.length) - 1)


def _signed(bits: int, length: int) -> int:
    return bits - (1 << length) if bits >> (length - 1) else bits


def _as_float(bits: int, length: int) -> float | WheelRefusal:
    whole, real = _FLOATS[length]
    value: float = struct.unpack(real, struct.pack(whole, bits))[0]
    return value if math.isfinite(value) else WheelRefusal.NOT_FINITE
