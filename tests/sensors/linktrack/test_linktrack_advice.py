"""One sentence with a remedy for what is wrong with the module."""

from __future__ import annotations

import random
import time

import pytest
from frames import (
    SECOND_US,
    anchor_frame0,
    aoa_node_frame0,
    cut,
    error_frame0,
    node_frame0,
    node_frame1,
    node_frame3,
    node_frame4,
    node_frame5,
    ranging_stream,
    tag_frame0,
    with_length,
)
from lab.play.emulators import as_heard_at
from machine_speed import allowed_s
from places import Recorded

from drslamd.sensors.linktrack.linktrack_frames import ModuleFault
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput

MS = 1000
T0 = 100 * SECOND_US
NMEA = b"$GPGGA,000522.953,2231.08747980,N,11354.04484670,E,1,04,0.030\r\n"


def an_input(uwb_id: int = 5) -> LinkTrackInput:
    return LinkTrackInput(uwb_id, max_range_m=120.0)


def healthy(until: int = T0) -> LinkTrackInput:
    uwb = an_input()
    for k, frame in enumerate(ranging_stream(10)):
        uwb.feed(frame, until + (k - 9) * 20 * MS)
    return uwb


def advice_after(frames: list[bytes], uwb_id: int = 5) -> str:
    uwb = an_input(uwb_id)
    for k, frame in enumerate(frames):
        uwb.feed(frame, T0 + k * 100 * MS)
    return uwb.advice(T0 + len(frames) * 100 * MS) or ""


def test_a_healthy_module_needs_no_advice() -> None:
    assert healthy().advice(T0) is None


def test_before_the_first_byte_the_port_is_suspected() -> None:
    advice = an_input().advice(T0)
    assert advice is not None
    assert "uwb.port" in advice


@pytest.mark.parametrize(("age", "silent"), [(2 * SECOND_US, False), (3 * SECOND_US, True)])
def test_silence_is_reported_with_its_length(age: int, silent: bool) -> None:
    advice = healthy().advice(T0 + age)
    expected = "no bytes from the UWB module for 3 s: check its power and the cable"
    assert advice == (expected if silent else None)


@pytest.mark.row("D7")
@pytest.mark.parametrize(("after_s", "asked"), [(4.9, False), (5.0, True)])
def test_bytes_without_frames_lead_to_the_baud_rate_within_5_seconds(
    after_s: float, asked: bool
) -> None:
    uwb, noise = an_input(), random.Random(1)
    for k in range(51):
        uwb.feed(noise.randbytes(200), T0 + k * 100 * MS)
    advice = uwb.advice(T0 + round(after_s * SECOND_US))
    assert (advice is not None) == asked
    assert not asked or "uwb.baud" in str(advice)


@pytest.mark.row("D7")
@pytest.mark.parametrize(
    "baud", [9_600, 57_600, 115_200, 230_400, 460_800, 1_000_000, 2_000_000, 3_000_000]
)
def test_at_any_wrong_rate_port_and_rate_are_named_and_nothing_is_believed(
    baud: int, record_property: Recorded
) -> None:
    uwb = LinkTrackInput(5, 120.0, f"/dev/ttyUSB0 at {baud} baud")
    began, samples = time.process_time(), 0
    heard = [as_heard_at(frame, 921_600, baud) for frame in ranging_stream(50)]
    took = -(time.process_time() - began)
    for k in range(300):
        samples += len(uwb.feed(heard[k % 50], T0 + k * 20 * MS))
    took += time.process_time() - began
    said = str(uwb.advice(T0 + 5_980 * MS))
    assert "on /dev/ttyUSB0 at " + str(baud) in said
    assert "is uwb.baud right" in said
    assert samples == 0
    assert took < allowed_s(0.05 * 6)
    record_property("measured", f"{baud} baud: {100 * took / 6:.1f} % of a core")


def test_after_a_pause_the_five_seconds_start_anew() -> None:
    uwb = healthy()
    uwb.feed(b"noise", T0 + 60 * SECOND_US)
    assert uwb.advice(T0 + 61 * SECOND_US) is None


@pytest.mark.parametrize(("frames", "said"), [(2, False), (3, True)])
def test_a_wrong_id_is_named_after_three_frames(frames: int, said: bool) -> None:
    advice = advice_after(ranging_stream(frames, own_id=3, period_ms=100))
    assert advice.startswith("the UWB module has id 3 but uwb.id is 5") == said


def test_long_ids_are_written_as_the_module_shows_them() -> None:
    frames = [node_frame5(0xBE23BE6B, local_ms=k * 100) for k in range(4)]
    assert "id 0xBE23BE6B but uwb.id is 0xBEF2BE32" in advice_after(frames, 0xBEF2BE32)


@pytest.mark.parametrize(
    ("frame", "shown"),
    [
        (anchor_frame0([]), "ANCHOR_FRAME0"),
        (tag_frame0(), "TAG_FRAME0"),
        (node_frame1([]), "NODE_FRAME1"),
        (node_frame4([]), "NODE_FRAME4"),
        (NMEA, "NMEA sentences"),
    ],
)
def test_lp_mode_is_recognised_by_what_it_prints(frame: bytes, shown: str) -> None:
    advice = advice_after([frame] * 3)
    assert advice.startswith(f"the UWB module is in LP mode (it prints {shown})")
    assert "DR_MODE0" in advice
    uwb = an_input()
    for part in cut(frame, 1, 5):
        uwb.feed(part, T0)
    assert uwb.wrong_mode == shown


def strange(head: bytes, frames: int, size: int, chunk: int) -> str | None:
    """After seven seconds of so many frames of another kind, read in such pieces."""
    uwb = an_input()
    line = (head + bytes(size - 2)) * frames
    pieces = [line[k : k + chunk] for k in range(0, len(line), chunk)]
    for k, piece in enumerate(pieces):
        uwb.feed(piece, T0 + k * 7 * SECOND_US // len(pieces))
    return uwb.advice(T0 + 7 * SECOND_US)


@pytest.mark.parametrize("chunk", [1, 17, 64])
@pytest.mark.parametrize(
    ("head", "whose"),
    [
        (b"\x55\xa0", "firmware of 2018"),
        (b"\x57\x00", "TOFSense"),
        (b"\x6a\x00", "IOT module"),
    ],
)
def test_frames_of_other_products_and_old_firmware_are_named(
    head: bytes, whose: str, chunk: int
) -> None:
    said = strange(head, 20, 64, chunk)
    assert said is not None
    assert whose in said
    assert head.hex(" ").upper() in said


@pytest.mark.parametrize(
    ("frames", "size", "named"),
    [(5, 64, True), (4, 64, False), (5, 1_000, True), (5, 1_001, False)],
)
def test_a_head_now_and_then_is_chance(frames: int, size: int, named: bool) -> None:
    assert ("firmware of 2018" in str(strange(b"\x55\xa0", frames, size, 10))) == named


def test_a_good_frame_wipes_out_what_was_strange_before_it() -> None:
    uwb = healthy()
    for k in range(40):
        uwb.feed(
            b"\x57\x00" + bytes(30) + node_frame3(5, local_ms=1180 + 200 * k), T0 + 200 * k * MS
        )
    assert "TOFSense" not in str(uwb.advice(T0 + 8 * SECOND_US))


def test_a_good_frame_ends_the_suspicion_of_lp_mode() -> None:
    uwb = healthy()
    uwb.feed(tag_frame0(), T0 + MS)
    assert uwb.wrong_mode == "TAG_FRAME0"
    uwb.feed(node_frame3(5, local_ms=1200, system_ms=1217), T0 + 20 * MS)
    assert uwb.wrong_mode is None


@pytest.mark.parametrize(
    ("frame", "sentence"),
    [
        (with_length(b"\x55\x0b", bytes(20)), "kind 55 0B (NODE_FRAME7 of newer firmware), which"),
        (with_length(b"\x55\x0c", bytes(20)), "prints frames of kind 55 0C, which"),
        (aoa_node_frame0([]), "prints frames of kind AOA_NODE_FRAME0"),
        (with_length(b"\x55\x02", bytes([0, 5, 0, 0, 0, 0, 1, 0, 9, 9, 0])), "damaged 55 02"),
        (node_frame3(5, millivolts=2900), "a supply of 2.9 V"),
        (node_frame3(5, local_ms=7), "jumps again and again"),
    ],
)
def test_each_reason_has_its_own_sentence(frame: bytes, sentence: str) -> None:
    assert sentence in advice_after([frame] * 4)


def test_odd_frames_between_good_ones_are_no_finding() -> None:
    uwb = an_input()
    for k, frame in enumerate(ranging_stream(50)):
        uwb.feed(frame + tag_frame0(), T0 + k * 20 * MS)
        assert k < 2 or uwb.advice(T0 + k * 20 * MS) is None


def test_old_refusals_are_no_finding() -> None:
    uwb = an_input()
    for k in range(5):  # slower than any module prints: chance frames in noise
        uwb.feed(tag_frame0(), T0 + k * 6 * SECOND_US)
    assert "LP mode" not in str(uwb.advice(T0 + 24 * SECOND_US))


@pytest.mark.parametrize(
    ("bits", "word"),
    [
        (ModuleFault.DUPLICATE_ID, "in use by another module"),
        (ModuleFault.RESTART, "restarted by itself"),
        (ModuleFault.HARDWARE, "hardware fault"),
        (ModuleFault.UWB_TRANSMIT, "cannot transmit"),
        (ModuleFault.USER_DATA_TOO_LONG, "writes to the serial port"),
        (ModuleFault.RESTART | ModuleFault.DUPLICATE_ID, "in use by another module"),
    ],
)
def test_a_fault_of_the_module_is_told_for_a_minute(bits: ModuleFault, word: str) -> None:
    uwb = healthy()
    uwb.feed(error_frame0(int(bits)), T0)
    assert word in str(uwb.advice(T0 + MS))
    for k in range(4000):
        uwb.feed(node_frame3(5, local_ms=1180 + k * 20), T0 + k * 20 * MS)
    assert uwb.advice(T0 + 60 * SECOND_US + 1) is None


def test_only_user_data_leads_to_the_output_setting() -> None:
    advice = advice_after([node_frame0(5, [(1, b"x")])] * 60)
    assert "output NODE_FRAME3 or NODE_FRAME5" in advice


def test_every_sentence_is_one_sentence_with_a_remedy() -> None:
    for frame in (tag_frame0(), node_frame3(3), node_frame3(5, millivolts=0)):
        advice = advice_after([frame] * 4)
        assert ": " in advice
        assert "\n" not in advice
        assert not advice.endswith(".")
