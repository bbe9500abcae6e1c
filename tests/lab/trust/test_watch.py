"""What a team claims is held against the truth."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from lab.play.simulator import Clock, Simulator
from lab.recordings.recording import Recording
from lab.trust import watch

from drslamd.conventions import GRID_HZ, Chain


def drove_along_x(first_s: float, driven_m: float, epoch: int = 7) -> tuple[Recording, Simulator]:
    """Robot 0 drives 0.5 m each second; the first keyframe of this start of it came so late, by a
    clock 100 s ahead, after so much of a way."""
    t = np.linspace(0, 60, 61)
    truth = np.stack([0.5 * t, np.zeros(61), np.zeros(61)], axis=1)
    recording = SimpleNamespace(trails={0: SimpleNamespace(t=t, truth=truth)})
    first = np.array([round((100 + first_s) * GRID_HZ)])
    keyframes = SimpleNamespace(n=first, poses=np.array([[driven_m, 0.0, 0.0]]))
    chains = {0: SimpleNamespace(keyframes=keyframes)}
    robot: Any = SimpleNamespace(own=Chain(0, epoch))
    robot.back = SimpleNamespace(graph=SimpleNamespace(chains=chains))
    member = SimpleNamespace(robot=robot, clock=Clock(100_000_000, 0.0))
    return cast(Recording, recording), cast(Simulator, SimpleNamespace(members={0: member}))


@pytest.mark.parametrize(
    ("first_s", "driven_m", "x"), [(0.0, 0.0, 0.0), (0.4, 0.2, 0.0), (2.0, 0.5, 0.5), (40, 0, 20)]
)
def test_a_frame_is_where_its_odometry_began(first_s: float, driven_m: float, x: float) -> None:
    found = watch._origin(*drove_along_x(first_s, driven_m), Chain(0, 7))
    assert found is not None
    assert found == pytest.approx([x, 0.0, 0.0])


def test_nobody_knows_here_where_the_frame_of_an_ended_start_was() -> None:
    assert watch._origin(*drove_along_x(40.0, 0.0, 7), Chain(0, 6)) is None
