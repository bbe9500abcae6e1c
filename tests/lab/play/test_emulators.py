"""The emulated devices speak so that the daemon's decoders give the numbers back."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from lab.play.emulators import KobukiEmulator, LinkTrackEmulator, WheelEmulator, as_heard_at
from lab.play.playback import BASES, Hardware, robot_config
from lab.recordings.recording import Recording, Trail

from drslamd.config_wheels import KobukiSection
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from drslamd.sensors.samples import Motion
from drslamd.sensors.wheels.wheel_input import WheelInput

LATE_US = 3_600_000_000
"""The robot's clock is an hour ahead of the recording."""
RANGES = [(7, 5.123), (0, 0.456), (254, 119.999)]


def at(t: float) -> int:
    return LATE_US + round(t * 1e6)


@pytest.mark.parametrize("frame", [2, 3, 5])
def test_ranges_come_back_to_the_millimetre_with_the_time_of_the_measurement(frame: int) -> None:
    module, daemon = LinkTrackEmulator(3, frame), LinkTrackInput(3, max_range_m=120.0)
    samples = []
    for k in range(10):
        t = 1.0 + 0.02 * k
        samples += daemon.feed(module.frame(t, RANGES), at(t))
    # the first frame only tells the local time that the second continues
    assert len(samples) == 9 * len(RANGES)
    last = samples[-len(RANGES) :]
    assert [s.peer_uwb_id for s in last] == [i for i, _ in RANGES]
    assert [s.range_m for s in last] == pytest.approx([r for _, r in RANGES])
    assert [s.utime for s in last] == [pytest.approx(at(1.18), abs=2_000)] * len(RANGES)
    assert daemon.counters().get("frames.refused.CHECKSUM", 0) == 0


@pytest.mark.parametrize("frame", [2, 3, 5])
def test_the_common_radio_time_comes_back(frame: int) -> None:
    module, daemon = LinkTrackEmulator(3, frame, power_up_s=40.0), LinkTrackInput(3, 120.0)
    for k in range(200):
        daemon.feed(module.frame(0.02 * k, []), at(0.02 * k))
    offset = daemon.system_offset_us(at(4.0))
    if frame == 5:
        # NODE_FRAME5 carries no common time
        assert offset is None
    else:
        assert offset is not None
        assert offset == pytest.approx(LATE_US, abs=2_000)


def motions_of(base: WheelEmulator, left: list[float], right: list[float]) -> list[Motion]:
    """What the daemon makes of a base whose wheels go along two paths, one step every 20 ms."""
    recording = Recording("none", {3: Trail(3, *(np.zeros((1, 3)),) * 3)}, np.zeros((0, 4)))
    wheels = WheelInput(robot_config(Hardware(recording, 3, base, 2)).wheels)
    out = []
    for k, (one, other) in enumerate(zip(left, right, strict=True)):
        t = 0.02 * k
        out += wheels.feed(base.stream(t, one, other), at(t))
        out += wheels.feed(base.answer(wheels.poll(at(t))), at(t))
    return out


@pytest.mark.parametrize("base", BASES, ids=lambda base: base.__name__)
def test_wheels_come_back_as_distance_and_turn(base: Callable[[], WheelEmulator]) -> None:
    """1000 steps forward on a bend: long enough for the 16-bit counters of a Kobuki to wrap."""
    device = base()
    k = np.arange(1000)
    left, right = 0.008 * k, 0.0095 * k
    motions = motions_of(device, left.tolist(), right.tolist())
    assert [m.gap for m in motions].count(True) == 1
    distance, turn = (sum(getattr(m, name) for m in motions) for name in ("distance_m", "turn_rad"))
    assert distance == pytest.approx(0.00875 * 999, abs=0.02)
    assert turn == pytest.approx(0.0015 * 999 / device.track_m, abs=0.02)


@pytest.mark.parametrize("base", BASES, ids=lambda base: base.__name__)
def test_wheels_that_go_backwards_come_back_negative(base: Callable[[], WheelEmulator]) -> None:
    device = base()
    motions = motions_of(device, [-0.004 * k for k in range(200)], [0.004 * k for k in range(200)])
    assert sum(m.distance_m for m in motions) == pytest.approx(0, abs=1e-3)
    turn = sum(m.turn_rad for m in motions)
    assert turn == pytest.approx(2 * 0.004 * 199 / device.track_m, rel=0.01)
    back = motions_of(base(), [-0.004 * k for k in range(200)], [-0.004 * k for k in range(200)])
    assert sum(m.distance_m for m in back) == pytest.approx(-0.004 * 199, rel=0.01)


def test_at_the_right_speed_every_byte_arrives() -> None:
    data = bytes(range(256))
    assert as_heard_at(data, 921_600, 921_600) == data


@pytest.mark.parametrize("heard", [115_200, 460_800, 2_000_000])
def test_at_the_wrong_speed_something_else_arrives(heard: int) -> None:
    data = LinkTrackEmulator(3).frame(1.0, RANGES)
    wrong = as_heard_at(data, 921_600, heard)
    assert wrong
    assert data[:8] not in wrong
    # one byte of 10 bits sent is about heard/sent bytes heard, less where edges are missed
    assert len(wrong) <= math.ceil(len(data) * max(heard / 921_600, 1) * 1.2)


def test_the_angle_of_a_gyro_comes_back_from_a_kobuki() -> None:
    base = KobukiEmulator()
    base.gyro = lambda t: 3.0 + t
    wheels = WheelInput(KobukiSection(source="kobuki", port="x"))
    for k in range(10):
        wheels.feed(base.stream(0.02 * k, 0.0, 0.0), at(0.02 * k))
    found = wheels.gyro.track.at(at(0.18))
    assert found is not None
    assert found[1] == pytest.approx(0.18, abs=2e-4)
