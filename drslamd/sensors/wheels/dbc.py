"""Wheel odometry of any base that comes with a DBC file, which says where its signals are.

The configuration names two signals: the counters or the speeds of both sides, or the two speeds of
the body. When both are in one frame they make one sample; when they are in two, or on two pages of
one multiplexed message, they are brought to a common time as in `side_pairing`. Counts are taken
raw, since a scaled counter does not wrap at a power of two, with the sign of their factor; counts
that are floating point do not wrap. Speeds are taken scaled and multiplied by ``unit``, or by what
the unit in the file says. A third signal may be the yaw rate of a gyro.

Ids that hold a node number are masked by ``id_mask`` before the look-up; the node number is what
stands outside the mask, shifted down (ODrive: mask 0x1F, node = axis; VESC: mask 0x1FFFFF00, node =
controller id).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from drslamd.config import ConfigError
from drslamd.config_wheels import DbcSection
from drslamd.conventions import SECOND_US
from drslamd.events import CanFrame
from drslamd.sensors.samples import (
    GyroRate,
    Twist,
    WheelCounts,
    WheelSample,
    WheelSpeeds,
    WheelTurns,
)
from drslamd.sensors.tally import Tally
from drslamd.sensors.wheels.dbc_file import messages_of
from drslamd.sensors.wheels.dbc_signal import SignalReader, Value
from drslamd.sensors.wheels.side_pairing import Pair, Side, SidePairing, linear, wrapping
from drslamd.sensors.wheels.wheel_driver import CanDriver, Outcome, WheelRefusal, tallied

if TYPE_CHECKING:
    from cantools.database import Message
    from cantools.database.can.signal import Signal

_ID_BITS: Final = (1 << 29) - 1
HEARD_US: Final = 2 * SECOND_US
"""A side that said something during this time speaks."""

_SPEEDS: Final = {
    "m/s": 1.0, "mps": 1.0, "cm/s": 0.01, "mm/s": 0.001, "km/h": 1 / 3.6, "kph": 1 / 3.6,
    "kmh": 1 / 3.6, "mph": 0.44704, "": 1.0, "-": 1.0,
}  # fmt: skip
_TURN_RATES: Final = {
    "rad/s": 1.0, "mrad/s": 0.001, "deg/s": math.pi / 180, "\u00b0/s": math.pi / 180,
    "dps": math.pi / 180, "rpm": math.pi / 30, "": 1.0, "-": 1.0,
}  # fmt: skip
"""Units as DBC files write them; a file that names none is taken at its number."""


class _Source(NamedTuple):
    """Where one of the two values comes from, and its factor to counts, m/s or rad/s."""

    side: Side
    key: str
    message: Message
    reader: SignalReader
    node: int | None
    unit: float


class DbcDriver(CanDriver):
    """`WheelCounts`, `WheelTurns`, `WheelSpeeds` or `Twist`, as ``measures`` and the file say.

    Args:
        section: which signals to read, and what they mean.
        dbc_text: content of the DBC file.

    Raises:
        ConfigError: the file cannot be read, or it does not hold what `section` names.
    """

    def __init__(self, section: DbcSection, dbc_text: str) -> None:
        self._section = section
        self._node_shift = _node_shift(section)
        keys = ("linear", "angular") if section.measures == "twist" else ("left", "right")
        paths = {key: getattr(section, key) for key in keys}
        wanted = {**paths, "gyro": section.gyro} if section.gyro else paths
        messages = messages_of(dbc_text, wanted)
        signals = [_signal(messages[key], path) for key, path in paths.items()]
        nodes = (section.left_node, section.right_node)
        if len(set(zip(paths.values(), nodes, strict=True))) < len(keys):
            raise ConfigError(
                [f'wheels.{keys[1]} = "{paths[keys[1]]}": the same as wheels.{keys[0]}']
            )
        self._sources = [
            _Source(
                side,
                key,
                messages[key],
                SignalReader(messages[key], signal.name),
                node,
                _unit(section, key, signal),
            )
            for side, key, signal, node in zip(Side, keys, signals, nodes, strict=True)
        ]
        self._gyro = _gyro(section, messages["gyro"]) if section.gyro else None
        self._counts = section.measures == "counts"
        self._bits = _counter_bits(section, keys, signals) if self._counts else None
        self._pairing = SidePairing(linear if self._bits is None else wrapping(self._bits))
        self.expects = " and ".join(f"CAN id 0x{s.message.frame_id:X}" for s in self._sources)
        self.tally: Tally[WheelRefusal] = Tally()

    def on_frame(self, frame: CanFrame) -> list[WheelSample]:
        return tallied(self.tally, self._decode(frame))

    def unpaired(self) -> int:
        return self._pairing.unpaired

    def why_no_sample(self, utime: int) -> str | None:
        last = self._pairing.last_utime
        speaks = [s for s in self._sources if utime - last.get(s.side, -HEARD_US) < HEARD_US]
        if len(speaks) != 1:
            return None
        (heard,), (silent,) = speaks, [s for s in self._sources if s not in speaks]
        node = "" if silent.node is None else f" of node {silent.node}"
        return (
            f"wheels.{heard.key} comes but wheels.{silent.key} "
            f"(CAN id 0x{silent.message.frame_id:X}{node}) does not: check the power and the cable "
            "of that side, and the name of its signal"
        )

    def _decode(self, frame: CanFrame) -> Outcome:
        wheels, turn = self._wheels(frame), self._turn(frame)
        if wheels is None or isinstance(wheels, WheelRefusal):
            return turn if wheels is None else wheels
        return [*turn, *wheels] if isinstance(turn, list) else wheels

    def _turn(self, frame: CanFrame) -> Outcome:
        gyro = self._gyro
        if gyro is None or not self._is_meant(frame, gyro):
            return None
        value = gyro.reader.scaled(frame.data)
        if value is None or isinstance(value, WheelRefusal):
            return value
        return [GyroRate(frame.utime, value * gyro.unit)]

    def _wheels(self, frame: CanFrame) -> Outcome:
        values: dict[Side, float] = {}
        for source in self._sources:
            value = self._value(source, frame)
            if isinstance(value, WheelRefusal):
                return value
            if value is not None:
                values[source.side] = value
        if not values:
            return None
        if len(values) == len(self._sources):
            return [self._sample(Pair(frame.utime, *values.values()))]
        ((side, value),) = values.items()
        pair = self._pairing.add(side, frame.utime, value)
        return [] if pair is None else [self._sample(pair)]

    def _is_meant(self, frame: CanFrame, source: _Source) -> bool:
        mask, message = self._section.id_mask, source.message
        node = (frame.can_id & ~mask) >> self._node_shift
        return (
            frame.extended == message.is_extended_frame
            and frame.can_id & mask == message.frame_id & mask
            and source.node in (None, node)
        )

    def _value(self, source: _Source, frame: CanFrame) -> Value | WheelRefusal | None:
        if not self._is_meant(frame, source):
            return None
        if self._counts:
            return source.reader.raw(frame.data)  # a float would lose the last bits of a wide one
        return source.reader.scaled(frame.data)

    def _sample(self, pair: Pair) -> WheelSample:
        utime, first, second = pair
        if self._counts:
            if self._bits is None:
                return WheelTurns(utime, first, second)
            return WheelCounts(utime, int(first), int(second), self._bits)
        sample = Twist if self._section.measures == "twist" else WheelSpeeds
        first_unit, second_unit = (source.unit for source in self._sources)
        return sample(utime, first * first_unit, second * second_unit)


def _signal(message: Message, path: str) -> Signal:
    name = path.split(".")[1]
    return next(signal for signal in message.signals if signal.name == name)


def _counter_bits(section: DbcSection, keys: tuple[str, str], signals: list[Signal]) -> int | None:
    """How wide the counters are; None for floating point, which does not wrap."""
    first, second = signals
    if first.is_float != second.is_float:
        raise ConfigError([f"wheels.{keys[0]}, {keys[1]}: one is an integer, the other is not"])
    if second.scale not in (first.scale, -first.scale):
        fault = (
            "the DBC file gives the two sides different factors, but they need one and the same "
            "wheels.counts_per_metre; correct the file"
        )
        raise ConfigError([f"wheels.{keys[0]}, {keys[1]}: {fault}"])
    if first.is_float:
        return None
    narrowest = min(first.length, second.length)
    if section.counter_bits is None:
        return narrowest
    if narrowest < section.counter_bits:
        key = keys[0] if first.length < section.counter_bits else keys[1]
        bits = f"{narrowest} bits, counter_bits = {section.counter_bits}"
        raise ConfigError([f'wheels.{key} = "{getattr(section, key)}": the signal has only {bits}'])
    return section.counter_bits


def _gyro(section: DbcSection, message: Message) -> _Source:
    signal = _signal(message, section.gyro)
    unit = section.gyro_unit or _unit_of(section, "gyro", signal, "gyro_unit")
    reader = SignalReader(message, signal.name)
    return _Source(Side.FIRST, "gyro", message, reader, None, unit)


def _unit(section: DbcSection, key: str, signal: Signal) -> float:
    """Factor from the number that the file means to m/s or rad/s, with its sign."""
    if section.measures == "counts":
        return 1.0
    is_turn = key == "angular"
    sign = -1 if is_turn and section.reverse_angular else 1
    given = section.angular_unit if is_turn and section.angular_unit else section.unit
    if given is not None:
        return sign * given
    return sign * _unit_of(section, key, signal, "angular_unit" if is_turn else "unit")


def _unit_of(section: DbcSection, key: str, signal: Signal, instead: str) -> float:
    """Factor to m/s or rad/s by the name of the unit in the file; `instead` is the key to give."""
    known, si = (_SPEEDS, "m/s") if instead == "unit" else (_TURN_RATES, "rad/s")
    name = (signal.unit or "").strip().lower()
    if name not in known:
        what = f"{instead}, the factor to {si}"
        fault = f'the DBC file gives it in "{signal.unit}"; give wheels.{what}'
        raise ConfigError([f'wheels.{key} = "{getattr(section, key)}": {fault}'])
    return known[name]


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
