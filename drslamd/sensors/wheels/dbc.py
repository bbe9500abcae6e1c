"""Wheel odometry of any base that comes with a DBC file, which says where its signals are.

The configuration names two signals: the counters or the speeds of both sides, or the two speeds of
the body. When both are in one frame they make one sample; when they are in two, they are brought to
a common time as in `side_pairing`. Counts are taken raw, since a scaled counter does not wrap at a
power of two; speeds are taken scaled, must be finite, and are multiplied by ``unit``.

Ids that hold a node number are masked by ``id_mask`` before the look-up; the node number is what
stands outside the mask, shifted down (ODrive: mask 0x1F, node = axis; VESC: mask 0x1FFFFF00, node =
controller id). `cantools` reads the file and the frames; it is imported only when a base needs it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from drslamd.config import ConfigError, DbcSection
from drslamd.events import CanFrame
from drslamd.sensors.samples import Twist, WheelCounts, WheelSample, WheelSpeeds
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.side_pairing import Pair, Side, SidePairing, linear, wrapping
from drslamd.sensors.wheels.wheel_driver import CanDriver, Outcome, WheelRefusal, tallied

if TYPE_CHECKING:
    from cantools.database import Database, Message

_ID_BITS: Final = (1 << 29) - 1
_NAMES_SHOWN: Final = 10


class _Source(NamedTuple):
    """Where one of the two values comes from."""

    side: Side
    message: Message
    signal: str
    node: int | None


class DbcDriver(CanDriver):
    """`WheelCounts`, `WheelSpeeds` or `Twist`, as ``measures`` says.

    Args:
        section: which signals to read, and what they mean.
        dbc_text: content of the DBC file.

    Raises:
        ConfigError: the file cannot be read, or it does not hold what `section` names.
    """

    def __init__(self, section: DbcSection, dbc_text: str) -> None:
        self._section = section
        self._node_shift = _node_shift(section)
        database = _database(dbc_text)
        keys = ("linear", "angular") if section.measures == "twist" else ("left", "right")
        nodes = (section.left_node, section.right_node)
        self._sources = [
            _source(database, section, key, side, node)
            for key, side, node in zip(keys, Side, nodes, strict=True)
        ]
        counts = section.measures == "counts"
        self._pairing = SidePairing(wrapping(section.counter_bits) if counts else linear)
        self.expects = " and ".join(f"CAN id 0x{s.message.frame_id:X}" for s in self._sources)
        self.tally: Tally[WheelRefusal] = Tally()

    def on_frame(self, frame: CanFrame) -> list[WheelSample]:
        return tallied(self.tally, self._decode(frame))

    def unpaired(self) -> int:
        return self._pairing.unpaired

    def _decode(self, frame: CanFrame) -> Outcome:
        sources = [source for source in self._sources if self._is_meant(frame, source)]
        values: list[float] = []
        for source in sources:
            value = self._value(source, frame.data)
            if value is None or isinstance(value, WheelRefusal):
                return value
            values.append(value)
        if not sources:
            return None
        if len(sources) == 2:
            return [self._sample(Pair(frame.utime, *values))]
        pair = self._pairing.add(sources[0].side, frame.utime, values[0])
        return [] if pair is None else [self._sample(pair)]

    def _is_meant(self, frame: CanFrame, source: _Source) -> bool:
        mask, message = self._section.id_mask, source.message
        node = (frame.can_id & ~mask) >> self._node_shift
        return (
            frame.extended == message.is_extended_frame
            and frame.can_id & mask == message.frame_id & mask
            and source.node in (None, node)
        )

    def _value(self, source: _Source, data: bytes) -> float | WheelRefusal | None:
        signals = _decoded(source.message, data, scaled=self._section.measures != "counts")
        if isinstance(signals, WheelRefusal):
            return signals
        if source.signal not in signals:
            return None if source.message.is_multiplexed() else WheelRefusal.SHORT
        value = signals[source.signal]
        if self._section.measures == "counts":
            return int(value)  # a float would lose the last bits of a wide counter
        return speed if math.isfinite(speed := _as_float(value)) else WheelRefusal.NOT_FINITE

    def _sample(self, pair: Pair) -> WheelSample:
        utime, first, second = pair
        if self._section.measures == "counts":
            return WheelCounts(utime, int(first), int(second), self._section.counter_bits)
        sample = Twist if self._section.measures == "twist" else WheelSpeeds
        return sample(utime, first * self._section.unit, second * self._section.unit)


def _decoded(message: Message, data: bytes, scaled: bool) -> dict[str, Any] | WheelRefusal:
    from cantools.database import DecodeError

    try:
        # Of a short frame the signals that are there are good, if no other tells which they are.
        signals = message.decode(
            data,
            decode_choices=False,
            scaling=scaled,
            allow_truncated=not message.is_multiplexed(),
        )
    except DecodeError:
        return WheelRefusal.MALFORMED
    except OverflowError:  # a factor or an offset in the file that no float can hold
        return WheelRefusal.NOT_FINITE
    assert isinstance(signals, dict)  # only containers decode to anything else
    return signals


def _as_float(value: float) -> float:
    """A whole number that no float can hold is infinite."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _node_shift(section: DbcSection) -> int:
    """Position of the lowest bit outside the mask."""
    nodes = (section.left_node, section.right_node)
    if nodes == (None, None):
        return 0
    if None in nodes:
        raise ConfigError(["wheels: give both left_node and right_node, or neither of them"])
    outside = _ID_BITS & ~section.id_mask
    if not outside:
        raise ConfigError(["wheels.left_node: needs an id_mask that leaves room for node numbers"])
    return (outside & -outside).bit_length() - 1


def _database(dbc_text: str) -> Database:
    try:
        from cantools.database import Database, load_string
        from cantools.database.errors import Error
    except ImportError:
        fault = 'wheels.source = "dbc": needs the package cantools (pip install drslamd[can])'
        raise ConfigError([fault]) from None
    try:
        database = load_string(dbc_text, database_format="dbc")
    except Error as error:
        reason = " ".join(str(error).split())
        raise ConfigError([f"wheels.dbc_file: not a DBC file that can be read: {reason}"]) from None
    assert isinstance(database, Database)  # the other kind comes from CDD files
    return database


def _source(
    database: Database, section: DbcSection, key: str, side: Side, node: int | None
) -> _Source:
    path: str = getattr(section, key)
    message_name, signal_name = path.split(".")
    messages = {message.name: message for message in database.messages}
    message = messages.get(message_name)
    if message is None:
        raise ConfigError([_absent(key, path, "message", message_name, list(messages))])
    signals = {signal.name: signal for signal in message.signals}
    signal = signals.get(signal_name)
    if signal is None:
        raise ConfigError([_absent(key, path, "signal", signal_name, list(signals))])
    if section.measures == "counts" and signal.is_float:
        raise ConfigError([f'wheels.{key} = "{path}": counts must be an integer signal'])
    if section.measures == "counts" and signal.length < section.counter_bits:
        bits = f"{signal.length} bits, counter_bits = {section.counter_bits}"
        raise ConfigError([f'wheels.{key} = "{path}": the signal has only {bits}'])
    return _Source(side, message, signal_name, node)


def _absent(key: str, path: str, what: str, name: str, there: list[str]) -> str:
    shown = ", ".join(there[:_NAMES_SHOWN]) + (", ..." if len(there) > _NAMES_SHOWN else "")
    return f'wheels.{key} = "{path}": no {what} {name} in the DBC file; there are {shown}'
