"""A recording played in virtual time: the answers come back on the recording's own clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.play import virtual_team
from lab.recordings import world
from lab.score.outcome import Outcome
from teams import EASY

SECONDS = 35.0


@pytest.fixture(scope="module")
def found() -> Outcome:
    recording = world.simulate(replace(EASY, robots=2, seconds=SECONDS), 3)
    return virtual_team.run(recording, seed=5)


def test_clocks_of_a_team_are_hours_apart_and_a_little_wrong() -> None:
    clocks = [virtual_team.skewed_clock(np.random.default_rng(seed)) for seed in range(20)]
    assert all(1 <= clock.offset_us / 3600e6 <= 10 for clock in clocks)
    assert np.ptp([clock.offset_us for clock in clocks]) > 3600e6
    assert 30 < max(abs(clock.ppm) for clock in clocks) <= 50


def test_final_paths_are_sampled_on_the_clock_of_the_recording(found: Outcome) -> None:
    assert set(found.final) == {0, 1}
    for path in found.final.values():
        assert -0.1 < path.t[0] < 2.0
        assert SECONDS - 2.0 < path.t[-1] < SECONDS + 0.1
        assert np.diff(path.t) == pytest.approx(0.1, abs=1e-4)


def test_closures_and_published_poses_are_too(found: Outcome) -> None:
    assert found.is_one_team
    times = [closure.t for closure in found.closures]
    assert times == sorted(times)
    assert 0 < times[0] < times[-1] < SECONDS
    for path in found.live.values():
        assert 0 < path.t[0] < path.t[-1] < SECONDS + virtual_team.SETTLE_S


def test_progress_is_told_every_second_to_the_end() -> None:
    told: list[float] = []
    recording = world.simulate(replace(EASY, robots=1, seconds=3.0), 3)
    virtual_team.play(recording, progress=told.append)
    assert told == list(range(1, int(3.0 + virtual_team.SETTLE_S)))
