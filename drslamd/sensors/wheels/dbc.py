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
from drslamd.sensors.wheels.counter_range import CounterRange, named_ends
from drslamd.sensors.wheels.dbc_file import messages_of
from drslamd.sensors.wheels.dbc_signal import SignalReader, Value
from drslamd.sensors.wheels.side_pairing import (
    Interpolate,
    Pair,
    Side,
    SidePairing,
    linear,
    wrapping,
)
from drslamd.sensors.wheels.wheel_driver import CanDriver, Outcome, WheelRefusal, tallied

if TYPE_CHECKING:
    from cantools.database import Message
    from cantools.database.can.signal import Signal

_ID_BITS: Final = (1 << 29) - 1
_SAME_FACTOR: Final = 1e-4
"""Relative difference of what was rounded."""
SLOWEST_S: Final = 0.1
"""Between two samples, of a base whose counters are to be told apart after half a turn."""
HEARD_US: Final = 2 * SECOND_US
"""A side that said something during this time speaks."""

_SPEEDS: Final = {
    1.0: "m/s mps m/sec meter/s metre/s meters/s unit_meterpersecond -",
    0.01: "cm/s cm/sec",
    0.001: "mm/s mm/sec",
    1 / 3.6: "km/h kph kmh kmph km/hr unit_kilometerperhour",
    0.44704: "mph mi/h unit_milesperhour",
    0.3048: "ft/s ft/sec fps",
    0.0254: "in/s in/sec",
}
_TURN_RATES: Final = {
    1.0: "rad/s rad/sec rps 1/s unit_radianpersecond -",
    0.001: "mrad/s",
    math.pi / 180: "deg/s deg/sec degree/s degrees/s dps \u00b0/s \u00ba/s \u00b0/sec "
    "unit_degreepersecond unit_degrepersecon",
    math.pi / 30: "rpm",
}
"""Units as DBC files write them, by their factor; one that names none is taken at its number."""
_PER_MINUTE: Final = "1/min u/min r/min rev/min min-1"


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
        self._other_width: tuple[Side, int] = Side.FIRST, -HEARD_US
        """Whose id came last in a frame that is not of its kind, and when."""
        self._counts = section.measures == "counts"
        self._range = _counter_range(section, keys, signals) if self._counts else None
        self._pairing = SidePairing(self._between())
        self.expects = " and ".join(f"CAN id 0x{s.message.frame_id:X}" for s in self._sources)
        self.tally: Tally[WheelRefusal] = Tally()

    def on_frame(self, frame: CanFrame) -> list[WheelSample]:
        return tallied(self.tally, self._decode(frame))

    def unpaired(self) -> int:
        return self._pairing.unpaired

    def why_no_sample(self, utime: int) -> str | None:
        last = self._pairing.last_utime
        speaks = [s for s in self._sources if utime - last.get(s.side, -HEARD_US) < HEARD_US]
        side, heard_utime = self._other_width
        if utime - heard_utime < HEARD_US:
            return _of_other_width(next(s for s in self._sources if s.side is side))
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
        is_named = frame.can_id & mask == message.frame_id & mask and source.node in (None, node)
        if is_named and frame.extended != message.is_extended_frame:
            if self._other_width[1] != frame.utime:
                self._other_width = source.side, frame.utime
            return False
        return is_named

    def _value(self, source: _Source, frame: CanFrame) -> Value | WheelRefusal | None:
        if not self._is_meant(frame, source):
            return None
        if not self._counts:
            return source.reader.scaled(frame.data)
        value = source.reader.raw(frame.data)  # a float would lose the last bits of a wide one
        if self._range is not None and isinstance(value, int):
            return value if self._range.takes(source.side, value) else WheelRefusal.NOT_AVAILABLE
        return value

    def _between(self) -> Interpolate:
        span = self._range
        return linear if span is None else wrapping(lambda: span.values)

    def _sample(self, pair: Pair) -> WheelSample:
        utime, first, second = pair
        if self._counts:
            if self._range is None:
                return WheelTurns(utime, first, second)
            span = self._range
            return WheelCounts(utime, int(first), int(second), span.bits, span.unused)
        sample = Twist if self._section.measures == "twist" else WheelSpeeds
        first_unit, second_unit = (source.unit for source in self._sources)
        return sample(utime, first * first_unit, second * second_unit)


def _of_other_width(source: _Source) -> str:
    is_long = source.message.is_extended_frame
    comes, said = ("11", "29") if is_long else ("29", "11")
    return (
        f"CAN id 0x{source.message.frame_id:X} of wheels.{source.key} comes in frames of {comes} "
        f"bits, the DBC file has it as one of {said}: correct the number of its message there (one "
        "of 29 bits is written as the id plus 2147483648)"
    )


def _signal(message: Message, path: str) -> Signal:
    name = path.split(".")[1]
    return next(signal for signal in message.signals if signal.name == name)


def _counter_range(
    section: DbcSection, keys: tuple[str, str], signals: list[Signal]
) -> CounterRange | None:
    """Where the counters go around; None for floating point, which does not."""
    first, second = signals
    if first.is_float != second.is_float:
        raise ConfigError([f"wheels.{keys[0]}, {keys[1]}: one is an integer, the other is not"])
    if not _is_same_factor(first, second):
        fault = (
            "the DBC file gives the two sides different factors, but they need one and the same "
            "wheels.counts_per_metre; correct the file"
        )
        raise ConfigError([f"wheels.{keys[0]}, {keys[1]}: {fault}"])
    if first.is_float:
        return None
    narrowest = min(first.length, second.length)
    if section.counter_bits is None:
        sample_m = section.max_speed_mps * SLOWEST_S
        least = 2 * sample_m * (section.counts_per_metre or 1.0)
        return CounterRange(narrowest, named_ends(signals, narrowest, least))
    if narrowest < section.counter_bits:
        key = keys[0] if first.length < section.counter_bits else keys[1]
        bits = f"{narrowest} bits, counter_bits = {section.counter_bits}"
        raise ConfigError([f'wheels.{key} = "{getattr(section, key)}": the signal has only {bits}'])
    return CounterRange(section.counter_bits, None)


def _is_same_factor(first: Signal, second: Signal) -> bool:
    """Up to its sign, and to how it was rounded."""
    if first.scale in (second.scale, -second.scale):
        return True
    try:
        return math.isclose(abs(first.scale), abs(second.scale), rel_tol=_SAME_FACTOR)
    except OverflowError:  # a whole number that no float can hold
        return False


def _gyro(section: DbcSection, message: Message) -> _Source:
    signal = _signal(message, section.gyro)
    _require_factor("gyro", section.gyro, signal)
    unit = section.gyro_unit or _unit_of(section, "gyro", signal, "gyro_unit")
    reader = SignalReader(message, signal.name)
    return _Source(Side.FIRST, "gyro", message, reader, None, unit)


def _unit(section: DbcSection, key: str, signal: Signal) -> float:
    """Factor from the number that the file means to m/s or rad/s, with its sign."""
    if section.measures == "counts":
        return 1.0
    is_turn = key == "angular"
    sign = -1 if is_turn and section.reverse_angular else 1
    _require_factor(key, getattr(section, key), signal)
    given = section.angular_unit if is_turn and section.angular_unit else section.unit
    if given is not None:
        return sign * given
    return sign * _unit_of(section, key, signal, "angular_unit" if is_turn else "unit")


def _require_factor(key: str, path: str, signal: Signal) -> None:
    if not signal.scale:
        fault = "its factor in the DBC file is 0, so it says nothing; correct the file"
        raise ConfigError([f'wheels.{key} = "{path}": {fault}'])


def _unit_of(section: DbcSection, key: str, signal: Signal, instead: str) -> float:
    """Factor to m/s or rad/s by the name of the unit in the file; `instead` is the key to give."""
    known, si = (_SPEEDS, "m/s") if instead == "unit" else (_TURN_RATES, "rad/s")
    name = (signal.unit or "").strip().lower() or "-"
    for factor, names in known.items():
        if name in names.split():
            return factor
    what = f"{instead}, the factor to {si}"
    if si == "m/s" and any(name in names.split() for names in (*_TURN_RATES.values(), _PER_MINUTE)):
        what += " (of rpm: 2 pi r / 60, of rad/s: r, of deg/s: pi r / 180, r in m: of the wheel)"
    fault = f'the DBC file gives it in "{signal.unit}"; give wheels.{what}'
    raise ConfigError([f'wheels.{key} = "{getattr(section, key)}": {fault}'])


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
