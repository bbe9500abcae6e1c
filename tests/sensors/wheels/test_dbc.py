"""Any base with a DBC file: counters, wheel speeds or the twist of the body."""

from __future__ import annotations

import math
import struct
import sys
from typing import Any

import pytest
from frames import SECOND_US, i24
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.config import ConfigError
from drslamd.config_wheels import DbcSection
from drslamd.events import CanFrame
from drslamd.sensors.samples import (
    GyroRate,
    Twist,
    WheelCounts,
    WheelSample,
    WheelSpeeds,
    WheelTurns,
)
from drslamd.sensors.wheels.wheel_driver import WheelRefusal

pytest.importorskip("cantools")

from drslamd.sensors.wheels.dbc import DbcDriver
from drslamd.sensors.wheels.dbc_file import decoded

MS = 1000
T0 = 100 * SECOND_US

about: Any = pytest.approx  # it stands for a number, whatever its type says

DBC = """
VERSION ""
NS_ :
BS_:
BU_: Base
BO_ 256 Encoders: 8 Base
 SG_ CountL : 0|24@1- (0.5,0) [0|0] "" Vector__XXX
 SG_ CountR : 24|24@1- (0.5,0) [0|0] "" Vector__XXX
BO_ 257 Speeds: 8 Base
 SG_ SpeedL : 7|16@0- (0.01,0) [0|0] "km/h" Vector__XXX
 SG_ SpeedR : 23|16@0- (0.01,0) [0|0] "km/h" Vector__XXX
BO_ 258 LeftWheel: 4 Base
 SG_ Count : 0|32@1+ (1,0) [0|0] "" Vector__XXX
BO_ 259 RightWheel: 4 Base
 SG_ Count : 0|32@1+ (1,0) [0|0] "" Vector__XXX
BO_ 2147485952 Node: 4 Base
 SG_ Ticks : 0|32@1- (1,0) [0|0] "" Vector__XXX
BO_ 9 Estimates: 8 Base
 SG_ Turns : 0|32@1- (1,0) [0|0] "rev" Vector__XXX
 SG_ Rate : 32|32@1- (1,0) [0|0] "rev/s" Vector__XXX
BO_ 260 Muxed: 8 Base
 SG_ Page M : 0|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ MuxL m1 : 8|16@1- (1,0) [0|0] "" Vector__XXX
 SG_ MuxR m1 : 24|16@1- (1,0) [0|0] "" Vector__XXX
 SG_ Other m2 : 8|16@1- (1,0) [0|0] "" Vector__XXX
BO_ 262 WideLeft: 8 Base
 SG_ Count : 0|64@1+ (1,0) [0|0] "" Vector__XXX
BO_ 263 WideRight: 8 Base
 SG_ Count : 0|64@1+ (1,0) [0|0] "" Vector__XXX
BO_ 264 Imu: 8 Base
 SG_ Yaw : 0|16@1- (0.1,0) [0|0] "deg/s" Vector__XXX
 SG_ Odd : 16|16@1- (0.1,0) [0|0] "grad/s" Vector__XXX
SIG_VALTYPE_ 9 Turns : 1;
SIG_VALTYPE_ 9 Rate : 1;
"""


NO_ROOM = 'BO_ 1 A: 8 X\n SG_ B : 60|8@1+ (1,0) [0|0] "" X\n'


def section(**keys: Any) -> DbcSection:
    return DbcSection(
        **{"source": "dbc", "track_m": 0.5, "dbc_file": "x.dbc", "measures": "counts", **keys}
    )


def counts(**keys: Any) -> DbcDriver:
    both = {"left": "Encoders.CountL", "right": "Encoders.CountR", "counter_bits": 24}
    return DbcDriver(section(counts_per_metre=1000.0, **{**both, **keys}), DBC)


def frame(can_id: int, data: bytes, utime: int = T0, extended: bool = False) -> CanFrame:
    return CanFrame(utime, can_id, extended, data)


# what is measured


def test_counts_of_one_frame_are_taken_raw() -> None:
    data = i24(-5) + i24(77) + bytes(2)
    assert counts().on_frame(frame(0x100, data)) == [WheelCounts(T0, -5, 77, 24)]


def test_wheel_speeds_are_scaled_by_the_file_and_by_unit() -> None:
    driver = DbcDriver(
        section(measures="wheel_speeds", left="Speeds.SpeedL", right="Speeds.SpeedR", unit=0.5),
        DBC,
    )
    (sample,) = driver.on_frame(frame(0x101, struct.pack(">hh4x", 360, -720)))
    assert isinstance(sample, WheelSpeeds)
    assert (sample.left_mps, sample.right_mps) == pytest.approx((1.8, -3.6))


def test_a_twist_is_scaled_too() -> None:
    driver = DbcDriver(
        section(measures="twist", linear="Speeds.SpeedL", angular="Speeds.SpeedR", unit=2.0), DBC
    )
    (sample,) = driver.on_frame(frame(0x101, struct.pack(">hh4x", 50, -100)))
    assert isinstance(sample, Twist)
    assert (sample.linear_mps, sample.angular_radps) == pytest.approx((1.0, -2.0))


def test_sides_in_two_messages_are_brought_to_a_common_time() -> None:
    driver = counts(left="LeftWheel.Count", right="RightWheel.Count", counter_bits=32)
    samples: list[WheelSample] = []
    top = (1 << 32) - 10
    for can_id, after, value in (
        (0x103, 0, top),
        (0x102, 5, 1000),
        (0x103, 10, 10),
        (0x102, 15, 1010),
        (0x103, 20, 30),
    ):
        samples += driver.on_frame(frame(can_id, struct.pack("<I", value), T0 + after * MS))
    assert samples == [
        WheelCounts(T0 + 5 * MS, 1000, 0, 32),
        WheelCounts(T0 + 15 * MS, 1010, 20, 32),
    ]
    assert driver.expects == "CAN id 0x102 and CAN id 0x103"


def test_wide_counts_lose_no_bit() -> None:
    driver = counts(left="WideLeft.Count", right="WideRight.Count", counter_bits=64)
    far = (1 << 63) + 1
    driver.on_frame(frame(0x106, struct.pack("<Q", far)))
    samples = driver.on_frame(frame(0x107, struct.pack("<Q", far + 2)))
    assert samples == [WheelCounts(T0, far, far + 2, 64)]


@pytest.mark.parametrize(
    ("id_mask", "left", "right", "can_id_of"),
    [
        ({"id_mask": 0x1FFFFF00}, 5, 6, lambda node: 0x900 | node),
        ({"id_mask": 0x1FFFFFF0}, 1, 2, lambda node: 0x900 | node),
    ],
)
def test_one_message_of_two_nodes(
    id_mask: dict[str, int], left: int, right: int, can_id_of: Any
) -> None:
    driver = counts(
        left="Node.Ticks",
        right="Node.Ticks",
        counter_bits=32,
        left_node=left,
        right_node=right,
        **id_mask,
    )
    samples: list[WheelSample] = []
    for node, value in ((right, 7), (left, -7), (9, 99)):
        data = struct.pack("<i", value)
        samples += driver.on_frame(frame(can_id_of(node), data, T0, extended=True))
        assert driver.on_frame(frame(can_id_of(node), data, T0, extended=False)) == []
    samples += driver.on_frame(frame(can_id_of(right), struct.pack("<i", 8), T0, extended=True))
    assert samples == [WheelCounts(T0, -7, 8, 32)]
    assert driver.tally.ignored == 3 + 1


def test_the_node_is_what_stands_outside_the_mask_shifted_down() -> None:
    driver = DbcDriver(
        section(
            measures="wheel_speeds",
            left="Estimates.Rate",
            right="Estimates.Rate",
            id_mask=0x1F,
            left_node=1,
            right_node=63,
            unit=1.0,
        ),
        DBC,
    )
    samples = []
    for node, rate in ((63, 2.0), (1, -0.25), (63, 2.0)):
        samples += driver.on_frame(frame(node << 5 | 9, struct.pack("<ff", 1.5, rate)))
    assert samples == [WheelSpeeds(T0, -0.25, 2.0)]


# what cannot be used


def test_other_frames_are_ignored() -> None:
    driver = counts()
    assert driver.on_frame(frame(0x101, bytes(8))) == []
    assert driver.on_frame(frame(0x100, bytes(8), extended=True)) == []
    assert (driver.tally.ignored, driver.tally.received) == (2, 2)


@pytest.mark.parametrize(("length", "used"), [(5, False), (6, True), (8, True), (12, True)])
def test_a_short_frame_is_used_as_far_as_it_goes(length: int, used: bool) -> None:
    driver = counts()
    assert len(driver.on_frame(frame(0x100, bytes(length)))) == used
    assert driver.tally.refused[WheelRefusal.SHORT] == (not used)


def test_a_speed_that_is_not_finite_is_refused() -> None:
    driver = DbcDriver(
        section(measures="wheel_speeds", left="Estimates.Rate", right="Estimates.Turns", unit=1.0),
        DBC,
    )
    for value in (float("nan"), float("inf")):
        assert driver.on_frame(frame(9, struct.pack("<ff", value, 1.0))) == []
    assert driver.tally.refused == {WheelRefusal.NOT_FINITE: 2}


def test_another_page_of_a_multiplexed_message_is_ignored() -> None:
    driver = counts(left="Muxed.MuxL", right="Muxed.MuxR", counter_bits=16)
    assert driver.on_frame(frame(0x104, struct.pack("<Bhh3x", 1, -3, 4))) == [
        WheelCounts(T0, -3, 4, 16)
    ]
    assert driver.on_frame(frame(0x104, struct.pack("<Bhh3x", 2, -3, 4))) == []
    assert driver.tally.ignored == 1


def test_a_page_that_the_file_does_not_have_is_nobody_s_trouble() -> None:
    driver = counts(left="Muxed.MuxL", right="Muxed.MuxR", counter_bits=16)
    assert driver.on_frame(frame(0x104, bytes([7, 0, 0, 0, 0, 0, 0, 0]))) == []
    assert (driver.tally.ignored, driver.tally.received) == (1, 1)


@pytest.mark.parametrize("data", [b"", b"\x01"])
def test_a_multiplexed_message_that_cannot_be_read_is_refused(data: bytes) -> None:
    driver = counts(left="Muxed.MuxL", right="Muxed.MuxR", counter_bits=16)
    assert driver.on_frame(frame(0x104, data)) == []
    assert driver.tally.refused == {WheelRefusal.SHORT: 1}


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"left": "Nothing.Count"}, 'wheels.left = "Nothing.Count": no message Nothing in the DBC'),
        ({"right": "Encoders.X"}, "no signal X in the DBC file; there are CountL, CountR"),
        ({"counter_bits": 32}, "the signal has only 24 bits, counter_bits = 32"),
        ({"left": "Estimates.Turns"}, "one is an integer, the other is not"),
        ({"right": "Encoders.CountL"}, 'wheels.right = "Encoders.CountL": the same as wheels.left'),
        ({"left": "WideLeft.Count"}, "gives the two sides different factors"),
        ({"left_node": 1}, "give both left_node and right_node"),
        ({"left_node": 1, "right_node": 2}, "needs an id_mask that leaves room"),
    ],
)
def test_a_section_that_does_not_fit_the_file_is_one_sentence(
    keys: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        counts(**keys)
    (fault,) = caught.value.faults
    assert fault.startswith("wheels")
    assert sentence in fault


@pytest.mark.parametrize("text", ["not a DBC file", 'VERSION "', NO_ROOM])
def test_a_file_that_is_no_dbc_is_one_sentence(text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        DbcDriver(section(counts_per_metre=1.0, left="A.B", right="A.B"), text)
    (fault,) = caught.value.faults
    assert fault.startswith("wheels.dbc_file: not a DBC file")
    assert "\n" not in fault


def test_without_cantools_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cantools.database", None)
    with pytest.raises(ConfigError, match=r"pip install drslamd\[can\]"):
        counts()


# files as tools write them


HEAD = 'VERSION ""\nNS_ :\nBS_:\nBU_: A\n'
TWO = (
    'BO_ 528 Wheels: 8 A\n SG_ L : 0|32@1- (1,0) [0|0] "tick" A\n'
    ' SG_ R : 32|32@1- (1,0) [0|0] "tick" A\n'
)


def of_two(text: str, **keys: Any) -> DbcDriver:
    both = {"left": "Wheels.L", "right": "Wheels.R", "counts_per_metre": 1.0}
    return DbcDriver(section(**{**both, **keys}), text)


@pytest.mark.parametrize(
    "elsewhere",
    [
        'BO_ 530 S: 8 A\n SG_ F : 0|8@1+ (1,0) [0|255] "" A\n SG_ G : 0|4@1+ (1,0) [0|15] "" A\n',
        'BO_ 530 S: 8 A\n SG_ F : 70|8@1+ (1,0) [0|255] "" A\n',
        'BO_ 530 S: 8 A\n SG_ F : 0|0@1+ (1,0) [0|255] "" A\n',
        "BO_ 530 S: 8 A\n SG_ F : 0|8@1+ (1,0) [|] C A\n",
        'BO_ 530 S: 8 A\n SG_ F-\u00e4 : 0|8@1+ (1,0) [0|0] "" A\n',
        "BO_ 4000 TooWide: 8 A\n",
        'VAL_ 99 Gone 1 "a" ;\n',
        "SIG_VALTYPE_ 99 Gone : 1;\n",
        'BA_ "unknown" BO_ 528 1;\n',
        'CM_ BO_ 528 "see also\nBO_ 529 Wheels: 8 A\n";\n',
        "something else;\n",
    ],
)
def test_faults_where_nobody_asked_cost_nothing(elsewhere: str) -> None:
    data = struct.pack("<ii", -3, 4)
    for text in (HEAD + TWO + elsewhere, HEAD + elsewhere + TWO):
        assert of_two(text).on_frame(frame(528, data)) == [WheelCounts(T0, -3, 4, 32)]


def test_an_overlap_of_the_signals_asked_for_is_one_sentence() -> None:
    with pytest.raises(ConfigError, match=r"wheels\.dbc_file: .*overlapping"):
        of_two(HEAD + TWO.replace("32|32", "31|32"))


def test_two_messages_of_the_name_asked_for_are_one_sentence() -> None:
    with pytest.raises(ConfigError, match="has 2 messages of this name"):
        of_two(HEAD + TWO + TWO.replace("528", "529"))


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"]
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_file_is_read_in_the_encoding_of_its_tool(encoding: str, end: str) -> None:
    text = HEAD + TWO + 'BO_ 529 T: 8 A\n SG_ M : 0|8@1+ (1,0) [0|0] "\u00b0C" A\n'
    read = decoded(text.replace("\n", end).encode(encoding))
    assert read == text
    assert of_two(read).on_frame(frame(528, bytes(8)))


def test_bytes_that_no_encoding_has_spoil_only_their_own_text() -> None:
    assert decoded((HEAD + TWO).encode() + b'CM_ "\x81\xff" ;') == HEAD + TWO + 'CM_ "\x81\xff" ;\n'


# sides in every shape


def test_the_two_sides_on_two_pages_of_one_id_are_brought_to_a_common_time() -> None:
    text = (
        HEAD + 'BO_ 640 W: 8 A\n SG_ I M : 0|8@1+ (1,0) [0|3] "" A\n'
        ' SG_ L m0 : 8|32@1- (1,0) [0|0] "" A\n SG_ R m1 : 8|32@1- (1,0) [0|0] "" A\n'
    )
    driver = of_two(text, left="W.L", right="W.R")
    samples: list[WheelSample] = []
    for k in range(6):  # a page every 25 ms, and both sides one count each 25 ms
        data = struct.pack("<Bi3x", k % 2, k)
        samples += driver.on_frame(frame(640, data, T0 + 25 * k * MS))
    assert samples == [WheelCounts(T0 + 25 * k * MS, k, k, 32) for k in (2, 4)]


def test_counters_every_100_ms_and_50_ms_apart_are_a_motion() -> None:
    driver = counts(left="LeftWheel.Count", right="RightWheel.Count", counter_bits=32)
    samples: list[WheelSample] = []
    for k in range(40):  # 100 counts a side each 100 ms
        can_id = 0x102 + k % 2
        samples += driver.on_frame(frame(can_id, struct.pack("<I", 50 * k), T0 + 50 * k * MS))
    assert samples[-1] == WheelCounts(T0 + 1900 * MS, 1900, 1900, 32) or samples[-1] == WheelCounts(
        T0 + 1800 * MS, 1800, 1800, 32
    )
    assert len(samples) == 19


@pytest.mark.parametrize(
    ("line", "sent", "read"),
    [
        ("0|12@1+ (1,0)", (0xFFF).to_bytes(8, "little"), 0xFFF),
        ("0|12@1- (1,0)", (0xFFF).to_bytes(8, "little"), -1),
        ("3|17@1- (1,0)", ((1 << 16 | 5) << 3).to_bytes(8, "little"), 5 - (1 << 16)),
        ("7|24@0- (1,0)", bytes([0xFF, 0xFF, 0xFE, 0, 0, 0, 0, 0]), -2),
        ("3|20@0+ (1,0)", bytes([0x0A, 0xBC, 0xDE, 0, 0, 0, 0, 0]), 0xABCDE),
        ("0|16@1- (-1,0)", struct.pack("<h6x", 7), -7),
        ("0|16@1- (-0.001,0)", struct.pack("<h6x", 7), -7),
    ],
)
def test_counters_of_every_width_order_and_sign(line: str, sent: bytes, read: int) -> None:
    text = HEAD + "".join(
        f'BO_ {number} {name}: 8 A\n SG_ C : {line} [0|0] "" A\n'
        for number, name in ((1, "Left"), (2, "Right"))
    )
    driver = of_two(text, left="Left.C", right="Right.C")
    driver.on_frame(frame(1, sent))
    (sample,) = driver.on_frame(frame(2, sent))
    assert isinstance(sample, WheelCounts)
    width = int(line.split("|")[1].split("@")[0])
    assert sample.bits == width
    assert (sample.left, sample.right) == (read, read)


def test_counts_as_floating_point_do_not_wrap() -> None:
    driver = counts(left="Estimates.Turns", right="Estimates.Rate", counter_bits=None)
    assert driver.on_frame(frame(9, struct.pack("<ff", 1.5, -2.5))) == [WheelTurns(T0, 1.5, -2.5)]


@pytest.mark.parametrize(
    ("unit", "factor"), [("km/h", 1 / 3.6), ("mm/s", 0.001), ("m/s", 1.0), ("", 1.0)]
)
def test_the_unit_is_what_the_file_says(unit: str, factor: float) -> None:
    text = HEAD + TWO.replace('"tick"', f'"{unit}"')
    (sample,) = of_two(text, measures="wheel_speeds").on_frame(
        frame(528, struct.pack("<ii", 36, -18))
    )
    assert isinstance(sample, WheelSpeeds)
    assert (sample.left_mps, sample.right_mps) == pytest.approx((36 * factor, -18 * factor))


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("Kmph", 1 / 3.6), ("km/hr", 1 / 3.6), ("m/sec", 1.0), ("mph", 0.44704), ("ft/s", 0.3048),
     ("in/s", 0.0254), ("Unit_MeterPerSecond", 1.0), ("Unit_KiloMeterPerHour", 1 / 3.6)],
)  # fmt: skip
def test_units_of_speed_have_many_spellings(unit: str, factor: float) -> None:
    text = HEAD + TWO.replace('"tick"', f'"{unit}"')
    driver = of_two(text, measures="wheel_speeds")
    (sample,) = driver.on_frame(frame(528, struct.pack("<ii", 36, 36)))
    assert isinstance(sample, WheelSpeeds)
    assert sample.left_mps == pytest.approx(36 * factor)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("deg/sec", math.pi / 180), ("\u00ba/s", math.pi / 180), ("degrees/s", math.pi / 180),
     ("Unit_DegreePerSecond", math.pi / 180), ("rpm", math.pi / 30), ("mrad/s", 0.001)],
)  # fmt: skip
def test_units_of_turning_have_many_spellings(unit: str, factor: float) -> None:
    text = HEAD + TWO.replace('"tick"', '"m/s"', 1).replace('"tick"', f'"{unit}"')
    keys = {"measures": "twist", "linear": "Wheels.L", "angular": "Wheels.R"}
    (sample,) = of_two(text, **keys).on_frame(frame(528, struct.pack("<ii", 1, 7)))
    assert isinstance(sample, Twist)
    assert sample.angular_radps == pytest.approx(7 * factor)


@pytest.mark.parametrize("unit", ["rpm", "1/min", "rad/s", "deg/s"])
def test_how_a_wheel_turns_is_a_speed_once_its_radius_is_known(unit: str) -> None:
    text = HEAD + TWO.replace('"tick"', f'"{unit}"')
    with pytest.raises(ConfigError, match=r"give wheels\.unit, .*of rpm: 2 pi r / 60"):
        of_two(text, measures="wheel_speeds")
    driver = of_two(text, measures="wheel_speeds", unit=2 * math.pi * 0.1 / 60)
    (sample,) = driver.on_frame(frame(528, struct.pack("<ii", 60, 0)))
    assert isinstance(sample, WheelSpeeds)
    assert sample.left_mps == pytest.approx(0.2 * math.pi)


def test_a_factor_of_0_is_one_sentence() -> None:
    text = HEAD + TWO.replace('(1,0) [0|0] "tick"', '(0,0) [0|0] "m/s"', 1)
    with pytest.raises(ConfigError, match=r'wheels\.left = "Wheels\.L": its factor .* is 0'):
        of_two(text, measures="wheel_speeds")


@pytest.mark.parametrize(("factor", "fits"), [("1.00001", True), ("1.001", False)])
def test_factors_of_both_sides_may_be_rounded(factor: str, fits: bool) -> None:
    text = HEAD + TWO.replace("(1,0)", f"({factor},0)", 1)
    if fits:
        assert of_two(text).on_frame(frame(528, struct.pack("<ii", 3, 4)))
    else:
        with pytest.raises(ConfigError, match="different factors"):
            of_two(text)


@pytest.mark.parametrize(("extended", "comes", "said"), [(True, "29", "11"), (False, "11", "29")])
def test_an_id_of_the_other_width_is_named(extended: bool, comes: str, said: str) -> None:
    number = 0x123 if extended else 0x123 | 1 << 31
    driver = of_two(HEAD + TWO.replace("528", str(number)))
    assert driver.on_frame(frame(0x123, bytes(8), extended=extended)) == []
    sentence = driver.why_no_sample(T0)
    assert sentence is not None
    assert sentence.startswith(f"CAN id 0x123 of wheels.left comes in frames of {comes} bits, ")
    assert f"as one of {said}:" in sentence
    assert driver.why_no_sample(T0 + 2 * SECOND_US) is None


def test_a_unit_that_is_not_known_must_be_given() -> None:
    with pytest.raises(ConfigError, match=r'gives it in "tick"; give wheels\.unit'):
        of_two(HEAD + TWO, measures="wheel_speeds")


def test_a_turn_in_degrees_to_the_right_is_a_turn() -> None:
    text = HEAD + TWO.replace('"tick"', '"km/h"', 1).replace('"tick"', '"deg/s"')
    keys = {"measures": "twist", "linear": "Wheels.L", "angular": "Wheels.R"}
    driver = of_two(text, **keys, reverse_angular=True)
    (sample,) = driver.on_frame(frame(528, struct.pack("<ii", 36, 90)))
    assert isinstance(sample, Twist)
    assert (sample.linear_mps, sample.angular_radps) == pytest.approx((10.0, -1.5707963))


@pytest.mark.parametrize(
    ("line", "marked"),
    [("0|16@1+ (1,0) [0|64255]", True), ("0|16@1+ (1,0) [0|0]", False),
     ("0|16@1+ (1,0) [0|65535]", False)],
)  # fmt: skip
def test_a_value_that_the_file_excludes_by_its_range_is_none(line: str, marked: bool) -> None:
    text = HEAD + TWO.replace("0|32@1- (1,0) [0|0]", line, 1)
    driver = of_two(text, counter_bits=16)
    assert len(driver.on_frame(frame(528, struct.pack("<H2xi", 0xFFFF, 1)))) == (not marked)
    assert driver.tally.refused[WheelRefusal.NOT_AVAILABLE] == marked


def test_a_value_that_the_file_names_so_is_none() -> None:
    driver = of_two(HEAD + TWO + 'VAL_ 528 L -1 "SNA" 0 "Zero" ;\n')
    assert len(driver.on_frame(frame(528, struct.pack("<ii", 0, 0)))) == 1
    assert driver.on_frame(frame(528, struct.pack("<ii", -1, 0))) == []
    assert driver.tally.refused == {WheelRefusal.NOT_AVAILABLE: 1}


def test_a_side_that_is_silent_is_named() -> None:
    driver = counts(left="LeftWheel.Count", right="RightWheel.Count", counter_bits=32)
    assert driver.why_no_sample(T0) is None
    driver.on_frame(frame(0x102, bytes(4)))
    said = driver.why_no_sample(T0 + SECOND_US)
    assert said is not None
    assert "wheels.left comes but wheels.right (CAN id 0x103) does not" in said


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.sampled_from([0x100, 0x102, 0x103, 0x104, 9]), st.binary(max_size=12), st.booleans())
def test_no_frame_makes_the_driver_raise(can_id: int, data: bytes, extended: bool) -> None:
    for driver in (
        counts(),
        counts(left="LeftWheel.Count", right="RightWheel.Count", counter_bits=32),
        counts(left="Muxed.MuxL", right="Muxed.MuxR", counter_bits=16),
    ):
        driver.on_frame(frame(can_id, data, extended=extended))
        assert driver.tally.received == 1


# a gyro

COUNTED = {"left": "LeftWheel.Count", "right": "RightWheel.Count", "counts_per_metre": 1.0}


def turning(driver: DbcDriver, yaw: int) -> list[WheelSample]:
    return driver.on_frame(CanFrame(T0, 264, False, struct.pack("<h6x", yaw)))


def test_a_gyro_is_read_in_the_unit_of_the_file() -> None:
    driver = DbcDriver(section(**COUNTED, gyro="Imu.Yaw"), DBC)
    assert turning(driver, -123) == [GyroRate(T0, about(math.radians(-12.3)))]


def test_a_factor_that_is_given_counts_instead() -> None:
    driver = DbcDriver(section(**COUNTED, gyro="Imu.Odd", gyro_unit=0.01), DBC)
    frame = CanFrame(T0, 264, False, struct.pack("<2h4x", 0, 50))
    assert driver.on_frame(frame) == [GyroRate(T0, about(0.05))]


def test_without_its_key_a_gyro_is_not_read() -> None:
    driver = DbcDriver(section(**COUNTED), DBC)
    assert turning(driver, 5) == []
    assert driver.tally.accepted == 0


def test_a_gyro_in_the_frame_of_the_wheels_comes_with_them() -> None:
    keys = {"measures": "wheel_speeds", "left": "Speeds.SpeedL", "right": "Speeds.SpeedR"}
    driver = DbcDriver(section(**keys, gyro="Speeds.SpeedR", gyro_unit=0.1), DBC)
    frame = CanFrame(T0, 257, False, struct.pack(">hh4x", 360, 720))
    gyro, wheels = driver.on_frame(frame)
    assert gyro == GyroRate(T0, about(0.72))
    assert wheels == WheelSpeeds(T0, about(1.0), about(2.0))


def test_a_short_frame_of_a_gyro_is_counted_and_costs_nothing_else() -> None:
    driver = DbcDriver(section(**COUNTED, gyro="Imu.Yaw"), DBC)
    assert driver.on_frame(CanFrame(T0, 264, False, b"\1")) == []
    assert driver.tally.refused[WheelRefusal.SHORT] == 1


@pytest.mark.parametrize(
    ("gyro", "what"),
    [("Imu.Roll", "wheels.gyro"), ("Imus.Yaw", "wheels.gyro"), ("Imu.Odd", "wheels.gyro_unit")],
)
def test_a_gyro_that_is_not_in_the_file_is_named(gyro: str, what: str) -> None:
    with pytest.raises(ConfigError, match=what):
        DbcDriver(section(**COUNTED, gyro=gyro), DBC)


def test_a_gyro_is_named_by_message_and_signal() -> None:
    with pytest.raises(ValueError, match=r"Message\.Signal"):
        section(**COUNTED, gyro="Yaw")
