"""Who speaks on a serial line, by what is said."""

from __future__ import annotations

import random

import pytest
from frames import wheeltec_frame
from lab.play.emulators import AsciiEmulator, KobukiEmulator, LinkTrackEmulator, as_heard_at

from drslamd.sensors.recognition import LINKTRACK_BAUDS, Device, Recognised, recognised


def linktrack(uwb_id: int, frame: int, count: int) -> bytes:
    module = LinkTrackEmulator(uwb_id, frame)
    return b"".join(module.frame(0.02 * k, [(1, 2.0), (9, 7.5)]) for k in range(count))


def kobuki(count: int) -> bytes:
    base = KobukiEmulator()
    return b"".join(base.stream(0.02 * k, 0.01 * k, 0.01 * k) for k in range(count))


def lines(count: int) -> bytes:
    base = AsciiEmulator()
    return b"".join(base.stream(0.02 * k, 0.01 * k, 0.01 * k) for k in range(count))


@pytest.mark.parametrize("frame", [2, 3, 5])
def test_a_linktrack_is_recognised_by_each_of_its_frames_with_its_id(frame: int) -> None:
    assert recognised(linktrack(200, frame, 4)) == Recognised(Device.LINKTRACK, 4, 200)


def test_a_module_that_prints_for_anchors_only_is_a_linktrack_without_an_id() -> None:
    tag = bytearray(128)  # TAG_FRAME0, of the LP modes
    tag[:2] = b"\x55\x01"
    tag[-1] = sum(tag[:-1]) & 0xFF
    assert recognised(bytes(tag) * 3) == Recognised(Device.LINKTRACK, 3, None)


def test_a_kobuki_and_lines_of_our_own_are_recognised_from_the_middle_on() -> None:
    assert recognised(kobuki(4)[5:]) == Recognised(Device.KOBUKI, 3)
    assert recognised(lines(4)[5:]) == Recognised(Device.ASCII, 3)


def wheeltec(count: int) -> bytes:
    return b"".join(wheeltec_frame(200 + k, 7) for k in range(count))


def test_a_wheeltec_base_is_recognised_though_its_usb_chip_may_be_that_of_a_linktrack() -> None:
    assert recognised(wheeltec(4)[5:]) == Recognised(Device.WHEELTEC, 3)


@pytest.mark.parametrize("say", [kobuki, lines, wheeltec, lambda n: linktrack(3, 2, n)])
def test_one_intact_frame_is_none_and_two_are_enough(say: object) -> None:
    assert callable(say)
    assert recognised(say(1)) == Recognised(Device.UNKNOWN)
    assert recognised(say(2)).is_certain


def test_nothing_is_silence_and_noise_is_unknown() -> None:
    assert recognised(b"") == Recognised(Device.SILENT)
    draw = random.Random(1)
    for _ in range(50):
        assert recognised(draw.randbytes(4096)) == Recognised(Device.UNKNOWN)


@pytest.mark.parametrize("baud", [b for b in LINKTRACK_BAUDS if b != 921_600])
def test_at_the_wrong_speed_nobody_is_recognised(baud: int) -> None:
    heard = as_heard_at(linktrack(3, 2, 30), 921_600, baud)
    assert recognised(heard) == Recognised(Device.UNKNOWN)
