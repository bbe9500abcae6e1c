"""What leaves the sensors can be computed with, whatever a device says: finite, and possible.

Ranges leave by `LinkTrackInput.feed`, motions by `WheelInput.feed` and `on_frame`. What is turned
away is counted and named.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest
from frames import (
    SECOND_US,
    Peer,
    ascii_line,
    kobuki_core,
    kobuki_packet,
    node_frame3,
    node_frame5,
    wheeltec_frame,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.config import ConfigError, parse
from drslamd.config_wheels import SOURCES, WheelSection
from drslamd.events import CanFrame
from drslamd.sensors.linktrack import linktrack_input
from drslamd.sensors.linktrack.codec import Frame, decode
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput, RangeRefusal
from drslamd.sensors.samples import Motion
from drslamd.sensors.wheels.wheel_base import MAX_TURN_RADPS, STAMP_JITTER_US
from drslamd.sensors.wheels.wheel_input import WheelInput

MS = 1000
T0 = 100 * SECOND_US
OWN = 5

MAX_FLOAT32 = float.fromhex("0x1.fffffep+127")
ABSURD = [MAX_FLOAT32, -MAX_FLOAT32, math.inf, -math.inf, math.nan, 1e9, 5e6, 1e-45]
NUMBERS = st.sampled_from([0.0, 0.125, 0.25, -0.125, 1.0, 3.0]) | st.sampled_from(ABSURD)

DBC = """VERSION ""
NS_ :
BS_:
BU_: Base
BO_ 256 Both: 8 Base
 SG_ First : 0|32@1- (FACTOR,OFFSET) [0|0] "" X
 SG_ Second : 32|32@1- (OTHER,0) [0|0] "" X
"""
FLOATS = "SIG_VALTYPE_ 256 First : 1;\nSIG_VALTYPE_ 256 Second : 1;\n"
NO_FLOAT = "1" + "0" * 400
"""A whole number above the largest float."""


def section(toml: str) -> WheelSection:
    rest = '[robot]\nid = 0\n[team]\ninsecure = true\n[uwb]\nport = "x"\n[wheels]\n'
    return parse(rest + toml).wheels


# wheels


class Base(NamedTuple):
    """A base, and how it says two numbers at a time."""

    toml: str
    say: Callable[[WheelInput, float, float, int], list[Motion]]
    dbc_text: str = ""

    def make(self) -> WheelInput:
        if self.dbc_text:
            pytest.importorskip("cantools")
        return WheelInput(section(self.toml), self.dbc_text)


def counts(left: float, right: float) -> tuple[int, int]:
    """Readings of two counters; what is no number is the smallest there is."""
    first, second = (int(v) % (1 << 31) if math.isfinite(v) else -(1 << 31) for v in (left, right))
    return first, second


def say_kobuki(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    return wheels.feed(kobuki_packet(kobuki_core(ms, *counts(left, right))), T0 + ms * MS)


def say_roboteq(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    return wheels.feed(b"C=%d:%d\r" % counts(left, right), T0 + ms * MS)


def say_ascii(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    return wheels.feed(ascii_line(ms, *counts(left, right)), T0 + ms * MS)


def say_wheeltec(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    ahead, turn = (v if math.isfinite(v) else -1e9 for v in (left, right))
    said = (max(-(1 << 15), min(int(1000 * v), (1 << 15) - 1)) for v in (ahead, turn))
    return wheels.feed(wheeltec_frame(*said), T0 + ms * MS)


def say_odrive(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    out = []
    for axis, turns in ((1, right), (0, left), (1, right)):
        data = struct.pack("<ff", turns, 0.0)
        out += wheels.on_frame(CanFrame(T0 + ms * MS, axis << 5 | 9, False, data))
    return out


def say_agilex(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    data = struct.pack(">ii", *counts(left, right))
    return wheels.on_frame(CanFrame(T0 + ms * MS, 0x311, False, data))


def say_agilex_speed(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    data = struct.pack(">hh", *(c % (1 << 15) for c in counts(left, right)))
    return wheels.on_frame(CanFrame(T0 + ms * MS, 0x221, False, data))


def say_floats(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    return wheels.on_frame(CanFrame(T0 + ms * MS, 0x100, False, struct.pack("<ff", left, right)))


def say_integers(wheels: WheelInput, left: float, right: float, ms: int) -> list[Motion]:
    data = struct.pack("<ii", *counts(left, right))
    return wheels.on_frame(CanFrame(T0 + ms * MS, 0x100, False, data))


def dbc_text(factor: str = "1", offset: str = "0", is_float: bool = True) -> str:
    other = "1" if is_float else factor  # both counters have one
    text = DBC.replace("FACTOR", factor).replace("OFFSET", offset).replace("OTHER", other)
    return text + (FLOATS if is_float else "")


SPEEDS = 'left = "Both.First"\nright = "Both.Second"\nmeasures = "wheel_speeds"\n'
TWIST = 'linear = "Both.First"\nangular = "Both.Second"\nmeasures = "twist"\n'
COUNTS = 'left = "Both.First"\nright = "Both.Second"\nmeasures = "counts"\ncounts_per_metre = 9\n'
FROM_DBC = 'source = "dbc"\ndbc_file = "x"\ntrack_m = 10\n'
SCALED = "track_m = 0.5\ncounts_per_metre = 9\n"

BASES = {
    "kobuki": Base('source = "kobuki"\nport = "x"', say_kobuki),
    "roboteq": Base(f'source = "roboteq"\nport = "x"\n{SCALED}', say_roboteq),
    "ascii": Base(f'source = "ascii"\nport = "x"\n{SCALED}', say_ascii),
    "wheeltec": Base('source = "wheeltec"\nport = "x"\ntrack_m = 0.3', say_wheeltec),
    "odrive": Base(
        'source = "odrive"\nleft_axis = 0\nright_axis = 1\ntrack_m = 0.5\nwheel_radius_m = 0.1',
        say_odrive,
    ),
    "agilex": Base('source = "agilex"\ntrack_m = 0.5', say_agilex),
    "agilex, speeds": Base('source = "agilex"\ntrack_m = 0.5', say_agilex_speed),
    "dbc, speeds": Base(FROM_DBC + SPEEDS, say_floats, dbc_text()),
    "dbc, speeds with unit": Base(FROM_DBC + SPEEDS + "unit = 1e9", say_floats, dbc_text("1e300")),
    "dbc, twist": Base(FROM_DBC + TWIST + "unit = 1e9", say_floats, dbc_text("1e290")),
    "dbc, counts": Base(FROM_DBC + COUNTS, say_integers, dbc_text(NO_FLOAT, is_float=False)),
    "dbc, factor": Base(FROM_DBC + SPEEDS, say_integers, dbc_text(NO_FLOAT, is_float=False)),
}


def test_every_source_of_the_configuration_is_here() -> None:
    assert {type(section(base.toml)) for base in BASES.values()} == set(SOURCES.values())


@pytest.mark.row("M9")
@pytest.mark.parametrize("name", BASES)
@settings(derandomize=True, max_examples=60, deadline=None)
@given(said=st.lists(st.tuples(st.integers(1, 800), NUMBERS, NUMBERS), min_size=3, max_size=20))
def test_a_motion_is_finite_and_no_longer_than_the_base_can_drive(
    name: str, said: list[tuple[int, float, float]]
) -> None:
    wheels, ms, last = BASES[name].make(), 1000, 0
    speed = section(BASES[name].toml).max_speed_mps
    for pause, left, right in said:
        ms += pause
        for motion in BASES[name].say(wheels, left, right, ms):
            elapsed_s = (motion.utime - last + STAMP_JITTER_US) / SECOND_US
            assert last < motion.utime <= T0 + ms * MS
            assert abs(motion.distance_m) <= speed * elapsed_s
            assert abs(motion.turn_rad) <= MAX_TURN_RADPS * elapsed_s
            last = motion.utime
    messages, samples = wheels.driver.tally, wheels.base.tally
    assert messages.received >= len(said)
    assert samples.received <= messages.accepted


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["odrive", "dbc, speeds", "dbc, twist"])
def test_a_number_that_is_not_finite_is_counted_by_the_message_that_said_it(
    name: str, value: float
) -> None:
    for left, right in ((value, 0.0), (0.0, value)):
        wheels = BASES[name].make()
        assert BASES[name].say(wheels, left, right, 1000) == []
        assert wheels.counters()["messages.refused.NOT_FINITE"] >= 1


@pytest.mark.parametrize(
    ("first", "unit", "counter"),
    [
        (1.0, "1e9", "samples.refused.TOO_FAST"),
        (1e299, "1e9", "samples.refused.TOO_FAST"),
        (1e300, "1e9", "samples.refused.NOT_FINITE"),
        (-1e300, "1e9", "samples.refused.NOT_FINITE"),
        (1e300, "1.0", "samples.refused.TOO_FAST"),
    ],
)
@pytest.mark.parametrize("measure", [SPEEDS, TWIST])
def test_a_product_that_overflows_is_counted(
    measure: str, first: float, unit: str, counter: str
) -> None:
    pytest.importorskip("cantools")
    wheels = WheelInput(section(f"{FROM_DBC}{measure}unit = {unit}"), dbc_text(f"{first:g}"))
    assert say_floats(wheels, 1.0, 0.0, 1000) == []
    assert wheels.counters()[counter] == 1


@pytest.mark.parametrize(
    ("factor", "offset", "is_float"),
    [
        (NO_FLOAT, "0", False),
        (NO_FLOAT, "0", True),
        ("1", NO_FLOAT, False),
        ("1", NO_FLOAT, True),
        ("1e400", "0", True),
        ("1e400", "0", False),
    ],
)
def test_a_dbc_file_with_factors_that_no_float_holds_is_no_end(
    factor: str, offset: str, is_float: bool
) -> None:
    pytest.importorskip("cantools")
    wheels = WheelInput(section(FROM_DBC + SPEEDS), dbc_text(factor, offset, is_float))
    say = say_floats if is_float else say_integers
    for k in range(60):
        assert say(wheels, 1.0, 1.0, 100 * k) == []
    assert wheels.counters()["messages.refused.NOT_FINITE"] == 60
    assert "not finite numbers" in str(wheels.advice(T0 + 5_900 * MS))


def test_numbers_that_were_not_finite_once_are_no_lasting_advice() -> None:
    wheels = BASES["odrive"].make()
    for k in range(120):
        say_odrive(wheels, math.nan if k == 10 else 0.0, 0.0, 100 * k)
    assert wheels.counters()["messages.refused.NOT_FINITE"] == 1
    assert wheels.advice(T0 + 11_900 * MS) is None
    for k in range(120, 180):
        wheels.on_frame(CanFrame(T0 + 100 * k * MS, 0x7FF, False, b""))
    assert "is this the bus of the base?" in str(wheels.advice(T0 + 17_900 * MS))


def test_a_position_beyond_the_floats_of_an_odrive_leads_to_its_switch() -> None:
    wheels = BASES["odrive"].make()
    for k in range(60):
        assert say_odrive(wheels, 1e9, 1e9, 100 * k) == []
    assert wheels.counters()["samples.refused.TOO_FAR"] > 50
    assert "switch the base off and on" in str(wheels.advice(T0 + 5_900 * MS))


@pytest.mark.parametrize(
    ("scale", "allowed"),
    [("1e-9", True), ("1e9", True), ("9e-10", False), ("1.1e9", False), ("inf", False)],
)
def test_a_scale_has_bounds_on_both_sides(scale: str, allowed: bool) -> None:
    for key in ("unit", "counts_per_metre"):
        toml = f"{FROM_DBC}{SPEEDS}{key} = {scale}"
        if allowed:
            section(toml)
        else:
            with pytest.raises(ConfigError, match=f"wheels.{key} = "):
                section(toml)


# ranges


def a_module(uwb_id: int = OWN, max_range_m: float = 120.0) -> LinkTrackInput:
    return LinkTrackInput(uwb_id, max_range_m)


@pytest.mark.row("M9")
@settings(derandomize=True, max_examples=100, deadline=None)
@given(
    st.sampled_from([node_frame3, node_frame5]),
    st.lists(
        st.tuples(st.integers(0, 1 << 24), st.integers(0, 255), st.integers(0, 255)), max_size=6
    ),
    st.floats(0.1, 1000.0),
)
def test_a_range_is_finite_and_within_the_limits_of_the_module(
    build: Callable[..., bytes], entries: list[tuple[int, int, int]], max_range_m: float
) -> None:
    uwb, utime, samples = a_module(max_range_m=max_range_m), T0, []
    peers = [Peer(10 + k, *entry) for k, entry in enumerate(entries)]
    for k in range(3):
        utime = T0 + 20 * k * MS
        samples += uwb.feed(build(OWN, peers, local_ms=1000 + 20 * k), utime)
    for sample in samples:
        assert -0.5 <= sample.range_m <= max_range_m
        assert abs(sample.power_gap_db) <= 127.5
        assert sample.utime <= utime
    assert uwb.ranges.received == 2 * len(entries)
    assert uwb.ranges.accepted == len(samples)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["distance_m", "fp_rssi_db", "rx_rssi_db"])
@pytest.mark.row("M9")
def test_a_range_that_is_not_finite_would_be_counted(
    name: str, value: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No frame of today's modules can say so; a table of floats could."""

    def poisoned(data: bytes) -> Any:
        frame = decode(data)
        assert isinstance(frame, Frame)
        first, *rest = frame.values["nodes"]
        return Frame(frame.kind, {**frame.values, "nodes": ({**first, name: value}, *rest)})

    uwb = a_module()
    monkeypatch.setattr(linktrack_input, "decode_intact", poisoned)
    peers = [Peer(9, 1500), Peer(10, 1600)]
    samples = [
        sample
        for k in range(2)
        for sample in uwb.feed(node_frame3(OWN, peers, local_ms=1000 + 20 * k), T0 + 20 * k * MS)
    ]
    assert [(sample.peer_uwb_id, sample.range_m) for sample in samples] == [(10, 1.6)]
    assert uwb.ranges.refused == {RangeRefusal.NOT_FINITE: 1}
    assert uwb.counters()["ranges.refused.NOT_FINITE"] == 1
