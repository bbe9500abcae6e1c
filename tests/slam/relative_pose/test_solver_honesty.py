"""Is what module 1 says of its own errors true? Simulated teams with noise like recorded noise."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
import pytest
from lab.recordings import world
from lab.score import metrics
from slam_scenes import NOISE, Array, angle_between, seen_from_last

from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose.estimate import Hypothesis, PairNoise, Verdict
from drslamd.slam.relative_pose.solver import solve
from drslamd.slam.relative_pose.window import Window, binned

SENSORS = PairNoise(RangeNoise(0.10, 0.30), NOISE, NOISE)
"""What a robot assumes by default; `world` draws a bias of 0.1 m, slow errors of 0.06 m, bursts."""
BEYOND = 14.2
"""The 99.73 % quantile of chi-squared with 3 degrees: three sigmas."""


def windows(seeds: range, span: float, seconds: float = 75.0) -> Iterator[tuple[Window, Array]]:
    """Windows of `span` seconds that end every 9 s, and the true relative pose at each end."""
    for seed in seeds:
        recording = world.simulate(world.Scene(robots=2, seconds=seconds), seed)
        table = recording.ranges[recording.ranges[:, 1] == 0]
        trails = [recording.trails[robot] for robot in (0, 1)]
        for end in np.arange(span + 1, seconds, 9.0):
            rows = table[(table[:, 0] > end - span) & (table[:, 0] <= end)]
            t, ranges, _ = binned(rows[:, 0] - end, rows[:, 3], 0.5)
            when = np.append(end + t, end)
            a, b = (
                seen_from_last(metrics.at_times(trail.t, trail.odometry, when))[:-1]
                for trail in trails
            )
            true = [metrics.at_times(trail.t, trail.truth, np.array([end]))[0] for trail in trails]
            yield Window(t, ranges, a, b, np.zeros(2), np.zeros(2)), metrics.relative(*true)


def nees(hypothesis: Hypothesis, true: Array) -> float:
    error = hypothesis.a_T_b - true
    error[2] = angle_between(hypothesis.a_T_b[2], true[2])
    return float(error @ np.linalg.solve(hypothesis.covariance, error))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("span", "seeds", "one_answer"),
    [(20.0, range(100, 126), 0.65), (30.0, range(200, 227), 0.90)],
)
def test_errors_are_as_large_as_the_covariance_says(
    span: float, seeds: range, one_answer: float
) -> None:
    """At least 100 unique answers for each length: about 1 by degree, hardly one beyond 3 sigma.

    The band is wide below because the noise that is assumed is twice that of the simulation.
    """
    verdicts: Counter[Verdict] = Counter()
    unique, ambiguous = [], []
    for window, true in windows(seeds, span):
        estimate = solve(window, SENSORS, 0.1)
        verdicts[estimate.verdict] += 1
        scores = [nees(hypothesis, true) for hypothesis in estimate.hypotheses]
        if estimate.verdict is Verdict.UNIQUE:
            unique.append(scores[0])
        elif scores:
            ambiguous.append(min(scores))
    normalised = np.array(unique)
    assert len(normalised) >= 100
    assert 0.5 < normalised.mean() / 3 < 1.3
    assert 0.25 < np.median(normalised) / 3 < 1.0
    assert np.mean(normalised < BEYOND) >= 0.98
    # where several poses are left, the true one is among them
    assert np.mean(np.array(ambiguous + [0.0]) < BEYOND) >= 0.97
    # the rest are close passes and short paths, of which either side may be the true one
    assert verdicts[Verdict.UNIQUE] > one_answer * verdicts.total()
    assert verdicts[Verdict.UNIQUE] + verdicts[Verdict.AMBIGUOUS] > 0.97 * verdicts.total()
