"""Module 1 by itself, both columns on the same windows: table I, and the sweeps of the figures."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from drslamd.config import OdometrySection, RelativePoseSection
from drslamd.conventions import GRID_HZ
from drslamd.slam import settings
from drslamd.slam.closure_method import POINTS
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose import algorithm_1, solver
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate, Verdict
from drslamd.slam.relative_pose.window import Window
from lab.recordings.recording import Array
from lab.reproduce import paper_column
from lab.reproduce.experiment import PAIRS, Trial, pose_errors
from lab.reproduce.paper_column import DELTA, SIGMA_R
from lab.reproduce.tally import Tally
from lab.reproduce.team_column import claim

TAUS = (10, 25, 50, 100, 200)
SWEPT_TAU = 100
OWN_TAU = round(RelativePoseSection().window_max_s * GRID_HZ)
"""Samples of the window that the daemon uses by default."""
DELTAS = (0.05, 0.1, 0.2, 0.4, 0.8)
RANGE_LIMITS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Of the largest range of the trial."""
RANGE_NOISE = (0.0, 0.1, 0.2, 0.3)
"""White noise added to the ranges, m."""
ODOMETRY_NOISE = ((0.0, 0.0), (0.01, 0.5), (0.02, 1.0), (0.05, 2.0), (0.1, 4.0))
"""White noise added to positions (m) and headings (degrees) of the odometry."""


def default_noise() -> PairNoise:
    """What the daemon tells `solve` by default."""
    section = RelativePoseSection()
    wheels = settings.odometry_noise(OdometrySection())
    ranges = RangeNoise(section.range_sigma_m, section.range_bias_sigma_m)
    return PairNoise(ranges, wheels, wheels)


@dataclass(frozen=True)
class Case:
    """One window: which pair, which pose time, and the pose that it ought to give."""

    pair: tuple[int, int]
    k: int
    truth: Array


def cases(trial: Trial, every: int) -> Iterator[Case]:
    for pair in PAIRS:
        truth = trial.true_pairs(*pair)
        for k in range(0, len(truth), every):
            yield Case(pair, k, truth[k : k + 1])


def table1(trial: Trial, every: int, shortest_every: int = 1) -> Tally:
    """Error and time of each way to solve a window, every so many pose times.

    Args:
        shortest_every: the same for this system and the shortest window, which are to be honest
            in the rarest case too.
    """
    tally = Tally()
    for tau in TAUS:
        for case in cases(trial, every):
            window = trial.window(case.pair, case.k, tau)
            if window is not None:
                _paper_ways(tally, f"table1/{tau}", window, case, trial.seed)
        for case in cases(trial, shortest_every if tau == TAUS[0] else every):
            window = trial.window(case.pair, case.k, tau, points=POINTS)
            if window is not None:
                _ours(tally, f"table1/{tau}/drslamd", window, case)
    return tally


def _paper_ways(tally: Tally, name: str, window: Window, case: Case, seed: int) -> None:
    arbitrary = seed * 100_000 + case.k
    ways = {
        "nls": lambda: paper_column.nls(window, arbitrary),
        "coarse": lambda: paper_column.coarse(window, DELTA),
        "both": lambda: algorithm_1.solve(window, SIGMA_R, DELTA).hypotheses[0].a_T_b,
    }
    for way, run in ways.items():
        pose, ms = paper_column.timed(run)
        tally.poses(f"{name}/{way}", pose_errors(pose[None], case.truth))
        tally.add(f"{name}/{way}/ms", ms)


def _ours(tally: Tally, name: str, window: Window, case: Case) -> None:
    start = time.perf_counter()
    estimate = solver.solve(window, default_noise(), DELTA)
    tally.add(f"{name}/ms", (time.perf_counter() - start) * 1e3)
    tally.add(f"{name}/unique", float(estimate.verdict is Verdict.UNIQUE))
    tally.add(f"{name}/ambiguous", float(estimate.verdict is Verdict.AMBIGUOUS))
    if estimate.verdict is Verdict.UNIQUE:
        best = estimate.hypotheses[0]
        tally.poses(name, pose_errors(best.a_T_b[None], case.truth))
        claim(tally, f"{name}/claim", best.a_T_b, best.covariance, case.truth[0])


def sweeps(trial: Trial, every: int) -> Tally:
    """Figures 5 to 7: the search step, range limit and range noise, odometry noise.

    The paper's column has the window of the paper's figures, this system's its own longer one.
    """
    tally = Tally()
    rng = np.random.default_rng(trial.seed)
    largest = max(float(data.ranges.max()) for data in trial.pairs.values())
    for delta in DELTAS:
        _by_delta(tally, trial, every, delta)
    for sigma in RANGE_NOISE:
        noisy = _noisy(trial, rng, (sigma, 0.0, 0.0))
        for limit in RANGE_LIMITS:
            _both(tally, f"sweep/range/{limit}/{sigma}", noisy, every, limit * largest)
    for metres, degrees in ODOMETRY_NOISE:
        noisy = _noisy(trial, rng, (0.0, metres, np.radians(degrees)))
        _both(tally, f"sweep/odometry/{metres}", noisy, every)
    return tally


def _by_delta(tally: Tally, trial: Trial, every: int, delta: float) -> None:
    """The search alone, with its refinement, and this system's, with their times."""
    name = f"sweep/delta/{delta}"
    for case in cases(trial, every):
        window = trial.window(case.pair, case.k, SWEPT_TAU)
        own = trial.window(case.pair, case.k, OWN_TAU, points=POINTS)
        if window is None or own is None:
            continue
        start = time.perf_counter()
        coarse = paper_column.coarse(window, delta)
        searched = time.perf_counter()
        paper = algorithm_1.solve(window, SIGMA_R, delta)
        refined = time.perf_counter()
        answer = solver.solve(own, default_noise(), delta)
        tally.add(f"{name}/coarse/ms", (searched - start) * 1e3)
        tally.add(f"{name}/paper/ms", (refined - searched) * 1e3)
        tally.add(f"{name}/drslamd/ms", (time.perf_counter() - refined) * 1e3)
        tally.poses(f"{name}/coarse", pose_errors(coarse[None], case.truth))
        _answer(tally, f"{name}/paper", paper, case)
        _answer(tally, f"{name}/drslamd", answer, case)


def _both(tally: Tally, name: str, trial: Trial, every: int, farthest: float = np.inf) -> None:
    """Both columns on the windows of a trial."""
    for case in cases(trial, every):
        window = trial.window(case.pair, case.k, SWEPT_TAU, farthest)
        own = trial.window(case.pair, case.k, OWN_TAU, farthest, POINTS)
        if window is not None and own is not None:
            paper = algorithm_1.solve(window, SIGMA_R, DELTA)
            _answer(tally, f"{name}/paper", paper, case)
            _answer(tally, f"{name}/drslamd", solver.solve(own, default_noise(), DELTA), case)


def _answer(tally: Tally, name: str, estimate: RelativePoseEstimate, case: Case) -> None:
    single = estimate.verdict is Verdict.UNIQUE
    tally.add(f"{name}/answered", float(single))
    if single:
        tally.poses(name, pose_errors(estimate.hypotheses[0].a_T_b[None], case.truth))


def _noisy(trial: Trial, rng: np.random.Generator, sigmas: tuple[float, float, float]) -> Trial:
    """White noise on every range (m) and every odometry pose (m, radians) of a trial."""
    range_sigma, metres, radians = sigmas
    spread = np.array([metres, metres, radians])
    pairs = {
        name: replace(
            data,
            ranges=data.ranges + rng.normal(0, range_sigma, len(data.t)),
            a_odometry=data.a_odometry + rng.normal(size=data.a_odometry.shape) * spread,
            b_odometry=data.b_odometry + rng.normal(size=data.b_odometry.shape) * spread,
        )
        for name, data in trial.pairs.items()
    }
    return replace(trial, pairs=pairs)
