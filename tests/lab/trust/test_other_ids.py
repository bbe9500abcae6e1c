"""Whoever a team's robots are called, they come to the same answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.play import virtual_team
from lab.recordings.recording import Recording
from lab.score.outcome import Outcome
from lab.trust.cases import CASES

pytestmark = pytest.mark.slow


def renamed(recording: Recording, ids: tuple[int, ...]) -> Recording:
    """Robots 0, 1 and so on have these ids, in the same order."""
    ranges = recording.ranges.copy()
    ranges[:, 1:3] = np.array(ids)[ranges[:, 1:3].astype(int)]
    trails = {ids[k]: replace(trail, robot=ids[k]) for k, trail in recording.trails.items()}
    return replace(recording, trails=trails, ranges=ranges)


def played(recording: Recording, seed: int) -> Outcome:
    simulator = virtual_team.start(recording, seed)
    simulator.run(recording.duration)
    return virtual_team.outcome(simulator)


@pytest.mark.parametrize(
    ("case", "seed", "ids"), [("stuck-2", 300, (3, 9)), ("slip", 304, (1, 2, 200))]
)
def test_robots_with_other_ids_come_to_the_same_answers_to_the_last_bit(
    case: str, seed: int, ids: tuple[int, ...]
) -> None:
    """Also where wheels stop at once, or slip, and before everybody knows everybody."""
    recording = CASES[case].world.recording(seed)
    fault = CASES[case].mounting.fault(seed, len(ids))
    recording = fault(np.random.default_rng(seed), recording)
    numbered, named = (played(r, seed) for r in (recording, renamed(recording, ids)))
    for number, name in enumerate(ids):
        assert len(numbered.final[number].t) > 500
        assert np.array_equal(numbered.final[number].t, named.final[name].t)
        assert np.array_equal(numbered.final[number].poses, named.final[name].poses)
