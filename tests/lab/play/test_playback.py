"""A recording becomes the bytes of its devices."""

from __future__ import annotations

import pytest
from lab.play.playback import equip
from lab.recordings import world

from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput

LATE_US = 3_600_000_000
"""The robot's clock is an hour ahead of the recording."""


def at(t: float) -> int:
    return LATE_US + round(t * 1e6)


def test_a_recording_becomes_everything_that_its_devices_print_in_order() -> None:
    recording = world.simulate(world.Scene(robots=2, seconds=4.0), 3)
    hardware = equip(recording, varied=True)[1]
    chunks = hardware.chunks()
    times = [c.t for c in chunks]
    assert times == sorted(times)
    daemon = LinkTrackInput(1, 120.0)
    samples = [
        sample for c in chunks if c.port == "uwb" for sample in daemon.feed(c.printed(), at(c.t))
    ]
    mine = recording.ranges[recording.ranges[:, 1] == 1]
    assert len(samples) == len(mine) - 1
    assert [s.range_m for s in samples] == pytest.approx(mine[1:, 3], abs=0.001)
    assert sum(c.port == "wheels" for c in chunks) == len(recording.trails[1].t)
