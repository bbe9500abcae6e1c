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


def drove_along_x(begun_s: float, epoch: int) -> tuple[Recording, Simulator]:
    """Robot 0 drives 0.5 m each second; this start of it began so late, by a clock 100 s ahead."""
    t = np.linspace(0, 60, 61)
    truth = np.stack([0.5 * t, np.zeros(61), np.zeros(61)], axis=1)
    recording = SimpleNamespace(trails={0: SimpleNamespace(t=t, truth=truth)})
    first = np.array([round((100 + begun_s) * GRID_HZ)])
    chains = {0: SimpleNamespace(keyframes=SimpleNamespace(n=first))}
    robot: Any = SimpleNamespace(own=Chain(0, epoch))
    robot.back = SimpleNamespace(graph=SimpleNamespace(chains=chains))
    member = SimpleNamespace(robot=robot, clock=Clock(100_000_000, 0.0))
    return cast(Recording, recording), cast(Simulator, SimpleNamespace(members={0: member}))


@pytest.mark.parametrize(("begun_s", "x"), [(0.0, 0.0), (2.0, 0.0), (2.1, 1.05), (40.0, 20.0)])
def test_the_frame_of_a_robot_that_began_again_is_where_it_began_again(
    begun_s: float, x: float
) -> None:
    """A first start begins where its recording does, whenever its first keyframe came."""
    found = watch._origin(*drove_along_x(begun_s, 7), Chain(0, 7))
    assert found is not None
    assert found[:2] == pytest.approx([x, 0.0])


def test_nobody_knows_here_where_the_frame_of_an_ended_start_was() -> None:
    assert watch._origin(*drove_along_x(40.0, 7), Chain(0, 6)) is None
