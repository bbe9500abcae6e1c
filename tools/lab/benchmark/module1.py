"""Module 1 beside a vectorised grid with scipy's least squares."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import cycle
from typing import TypeVar

import numpy as np
from scipy.optimize import least_squares

from drslamd.slam.closure_method import POINTS
from drslamd.slam.relative_pose import coarse_search, solver
from drslamd.slam.relative_pose.descent import ITERATIONS, Descent
from drslamd.slam.relative_pose.estimate import RelativePoseEstimate
from drslamd.slam.relative_pose.range_fit import RangeFit
from drslamd.slam.relative_pose.window import Window, binned
from drslamd.slam.relative_pose.window_stack import WindowStack
from lab.benchmark import timing, windows
from lab.benchmark.rows import Peer, Row
from lab.recordings.recording import Array

DELTA = 0.1
TAUS = (50, 100, 200)
PAPER_MS = {50: 13.0, 100: 19.0, 200: 29.0}
CERES_MS = {50: 0.72, 100: 1.19, 200: 2.55}
GRID = "grid + least_squares"
POOL = 20
"""Windows that every program goes through in turns."""
NINE = 9
ONE_SEED = {50: 12.0, 100: 20.0, 200: 28.0}
"""So many times as fast as the grid, of a window among nine."""
VERDICT = 10.0
"""Likewise."""
AT_ONCE = 0.45
Given = TypeVar("Given")
STARTS = 17
"""Of the search that stands for the truth."""
SAME_COST = 1.001


def rows(quick: bool) -> Iterator[Row]:
    """All figures of module 1."""
    one: dict[int, float] = {}
    farthest = 0.0
    for tau in TAUS:
        rng = np.random.default_rng(tau)
        pool = [windows.window(rng, tau)[0] for _ in range(POOL)]
        nines = [[pool[(k + j) % POOL] for j in range(NINE)] for k in range(POOL)]
        programs = {
            "one": over(pool, one_seed),
            "nine": over(nines, nine_seeds),
            GRID: over(pool, grid),
            "apart": over(nines, apart),
            "together": over(nines, together),
        }
        times = timing.in_turns(programs, 60 if quick else 400, 6 if quick else 40)
        one[tau] = times["one"].median
        quoted = (Peer("paper", PAPER_MS[tau], False), Peer("C++ Ceres", CERES_MS[tau], False))
        peers = (Peer(GRID, times[GRID].median, True), *quoted)
        p99 = times["one"].p99
        yield Row(1, f"one seed, tau {tau}", one[tau], "ms", None, p99, peers)
        seed, alone, nine = (times[name].median / NINE for name in ("nine", "apart", "together"))
        work = f"one seed, tau {tau}, of nine at once"
        yield Row(1, work, seed, "ms", None, None, peers, times=ONE_SEED[tau])
        work = f"all seeds, covariance, verdict, tau {tau}"
        yield Row(1, work, alone, "ms", None, None, peers)
        yield Row(1, f"{work}, of nine at once", nine, "ms", None, None, peers, times=VERDICT)
        work = f"nine windows at once over nine one by one, tau {tau}"
        yield Row(1, work, nine / alone, "ratio", AT_ONCE)
        farthest = max(farthest, *(difference(apart(some), together(some)) for some in nines))
    yield Row(1, "nine at once, the pose farthest from one by one, m", farthest, "gap", 1e-14)
    yield Row(1, "one seed, t(200) / t(50)", one[200] / one[50], "ratio", 1.3)
    count = 60 if quick else 400
    yield Row(1, "global minimum found, tau 100", global_share(count, False), "share", 0.995)
    yield Row(1, "the same, nearly straight", global_share(count, True), "share", 0.95)


def over(pool: list[Given], solve: Callable[[Given], object]) -> Callable[[], object]:
    """A program that takes what comes next at every call."""
    turns = cycle(pool)
    return lambda: solve(next(turns))


def one_seed(window: Window) -> Array:
    """The best point of the coarse search, refined: the paper's question."""
    return refined([window], 1)[0]


def nine_seeds(some: list[Window]) -> list[Array]:
    """The same of several windows at once."""
    return refined(some, 1)


def full(window: Window) -> RelativePoseEstimate:
    """What the daemon does with every window: into bins, solved with a verdict."""
    return solver.solve(thinned(window), windows.NOISE, DELTA)


def apart(some: list[Window]) -> list[RelativePoseEstimate]:
    """The same of several windows, one by one."""
    return [full(window) for window in some]


def together(some: list[Window]) -> list[RelativePoseEstimate]:
    """The same at once, as the daemon does with those of all its pairs."""
    thin = [thinned(window) for window in some]
    return solver.solve_all(thin, [windows.NOISE] * len(thin), DELTA)


def thinned(window: Window) -> Window:
    """In bins."""
    width = max(1.0 / windows.HZ, np.ptp(window.t) / POINTS)
    t, ranges, _ = binned(window.t, window.ranges, float(width))
    poses = [
        np.stack([np.interp(t, window.t, values) for values in track.T], axis=-1)
        for track in (window.a_poses, window.b_poses)
    ]
    return Window(t, ranges, poses[0], poses[1], window.a_antenna, window.b_antenna)


def difference(some: list[RelativePoseEstimate], others: list[RelativePoseEstimate]) -> float:
    """The farthest that two answers lie apart, m; infinite where a verdict is another one."""
    farthest = 0.0
    for one, other in zip(some, others, strict=True):
        if one.verdict is not other.verdict or len(one.hypotheses) != len(other.hypotheses):
            return float("inf")
        for found, again in zip(one.hypotheses, other.hypotheses, strict=True):
            farthest = max(farthest, float(np.abs(found.a_T_b - again.a_T_b)[:2].max()))
    return farthest


def refined(some: list[Window], seeds: int) -> list[Array]:
    """(seeds, 3) the minima of each window that our search finds from so many seeds."""
    stack = WindowStack.of(some)
    a, b, rho = stack.points[0], stack.points[1], stack.latest_ranges
    found, of = coarse_search.seeds(a, b, stack.ranges, rho, DELTA, seeds)
    fit = RangeFit.of(stack)
    noises = [windows.NOISE.ranges] * len(some)
    descent = Descent(fit, fit.rows(of).centred(found), noises, of)
    descent.run(ITERATIONS)
    minima, groups = descent.minima()
    poses = fit.rows(groups.of).poses(minima.centred)
    return [poses[span] for _, span in groups.slices()]


def grid(window: Window) -> Array:
    """The peer: every point of the grid by broadcasting, then MINPACK with its Jacobian."""
    a, b, ranges = window.a_points, window.b_points, window.ranges
    angles = np.arange(-np.pi, np.pi, DELTA)
    phi, theta = (x[..., None] for x in np.meshgrid(angles, angles, indexing="ij"))
    cos, sin = np.cos(theta), np.sin(theta)
    x = ranges[-1] * np.cos(phi) + cos * b[:, 0] - sin * b[:, 1] - a[:, 0]
    y = ranges[-1] * np.sin(phi) + sin * b[:, 0] + cos * b[:, 1] - a[:, 1]
    cost = ((np.hypot(x, y) - ranges) ** 2).sum(axis=-1)
    i, j = np.unravel_index(np.argmin(cost), cost.shape)
    phi_0 = angles[i]
    start = np.array([ranges[-1] * np.cos(phi_0), ranges[-1] * np.sin(phi_0), angles[j]])
    return polished(window, start)[0]


def polished(window: Window, start: Array) -> tuple[Array, float]:
    """The nearest minimum of the sum of squared range errors, and that sum."""
    a, b, ranges = window.a_points, window.b_points, window.ranges

    def parts(pose: Array) -> tuple[Array, Array, Array]:
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        arm = np.stack([cos * b[:, 0] - sin * b[:, 1], sin * b[:, 0] + cos * b[:, 1]])
        sight = pose[:2, None] + arm - a.T
        return arm, sight, np.hypot(*sight)

    def errors(pose: Array) -> Array:
        return np.asarray(parts(pose)[2] - ranges)

    def jacobian(pose: Array) -> Array:
        arm, sight, length = parts(pose)
        x, y = sight / length
        return np.stack([x, y, y * arm[0] - x * arm[1]], axis=-1)

    found = least_squares(errors, start, jacobian, method="lm")
    return np.asarray(found.x), float(2 * found.cost)


def global_share(count: int, straight: bool) -> float:
    """Share of windows of 100 ranges whose best minimum is among those of our search."""
    rng = np.random.default_rng(7 + straight)
    hits = 0
    for _ in range(count):
        window, truth = windows.window(rng, 100, straight)
        ours = [polished(window, pose)[1] for pose in refined([window], solver.SEEDS)[0]]
        phi = rng.uniform(-np.pi, np.pi, STARTS - 1)
        theta = rng.uniform(-np.pi, np.pi, STARTS - 1)
        place = window.ranges[-1] * np.stack([np.cos(phi), np.sin(phi)])
        starts = [truth, *np.column_stack([place.T, theta])]
        best = min(polished(window, start)[1] for start in starts)
        hits += min(ours) <= best * SAME_COST
    return hits / count
