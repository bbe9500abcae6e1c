"""One pose update of the whole team: all three modules one after the other, on all its robots."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from drslamd.slam import se2
from drslamd.slam.consistency.pcm import PairConsistency
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.relative_pose import solver
from lab.benchmark import closures, module1, timing, windows
from lab.benchmark.rows import Peer, Row

ROBOTS, TAU, EPSILON = 3, 50, 0.1
HALF = 2.0
"""So many updates in the time of one window of grid + least_squares."""
OWNED = (2, 1)
"""Pairs of robot 0 and of robot 1, whose windows are solved at once."""
SECONDS = 75
"""Of the paper's experiment; a keyframe and a closure a second."""
PAPER_MS = 81.0
PAIRS = ((0, 1), (0, 2), (1, 2))
STEP_SIGMAS, CLOSURE_SIGMAS = (0.02, 0.008), (0.15, 0.05)
"""m and rad."""


class Update:
    """The team at the end of its drive; every call is its next second."""

    def __init__(self) -> None:
        rng = np.random.default_rng(5)
        self.windows = [windows.window(rng, TAU)[0] for _ in range(60)]
        self._pairs, self._waiting = [], []
        for k in range(ROBOTS):
            pair = PairConsistency(closures.NOISE, closures.NOISE, EPSILON)
            candidates = closures.candidates(10 * SECONDS, 0.8, seed=k)
            for candidate in (next(candidates) for _ in range(SECONDS)):
                pair.add(candidate)
            self._pairs.append(pair)
            self._waiting.append(candidates)
        self._edges = _team_edges(rng)
        newest = np.minimum(self._edges.i, self._edges.j) >= ROBOTS * (SECONDS - 1)
        before = self._edges.chosen(~newest)
        self._solved = PoseGraphSolver(before, ROBOTS * SECONDS).solve().poses
        self._turn = 0

    def __call__(self) -> None:
        """Module 1 and 2 for each pair on one of its robots, module 3 on every robot."""
        for owned in OWNED:
            some = [self.windows[(self._turn + k) % len(self.windows)] for k in range(owned)]
            self._turn += owned
            solver.solve_all(some, [windows.NOISE] * owned, module1.DELTA)
        for pair, waiting in zip(self._pairs, self._waiting, strict=True):
            pair.add(next(waiting))
        for _ in range(ROBOTS):
            PoseGraphSolver(self._edges, ROBOTS * SECONDS).solve(self._solved)


def _team_edges(rng: np.random.Generator) -> ComplexFactors:
    """Three wandering robots; pose k of robot r is number 3 k + r."""
    truth = np.zeros((SECONDS * ROBOTS, 3))
    truth[:ROBOTS] = rng.uniform(-5, 5, (ROBOTS, 3))
    for k in range(ROBOTS, len(truth)):
        truth[k] = se2.compose(truth[k - ROBOTS], np.array([0.5, 0.0, rng.normal(0, 0.3)]))
    i = np.arange(len(truth) - ROBOTS)
    rows = [(i, i + ROBOTS, STEP_SIGMAS)]
    for a, b in PAIRS:
        at = np.arange(SECONDS) * ROBOTS
        rows.append((at + a, at + b, CLOSURE_SIGMAS))
    start, end = (np.concatenate([row[k] for row in rows]) for k in (0, 1))
    sigmas = np.concatenate([np.tile(s, (len(a), 1)) for a, _, s in rows])
    measured = se2.between(truth[start], truth[end])
    measured += sigmas[:, [0, 0, 1]] * rng.normal(size=measured.shape)
    x, y, theta = measured.T
    tau, kappa = sigmas.T**-2.0
    return ComplexFactors(start, end, np.exp(1j * theta), x + 1j * y, kappa, tau)


def rows(quick: bool) -> Iterator[Row]:
    """The three modules as one."""
    update = Update()
    programs: dict[str, Callable[[], object]] = {
        "update": update,
        module1.GRID: module1.over(update.windows, module1.grid),
    }
    taken = timing.in_turns(programs, 60 if quick else 400, 5 if quick else 30)
    work = f"one update of {ROBOTS} robots, tau {TAU}, delta {module1.DELTA}"
    peers = (
        Peer(f"{module1.GRID} of one window", taken[module1.GRID].median, True),
        Peer("paper", PAPER_MS, False),
    )
    times = taken["update"]
    yield Row(0, work, times.median, "ms", None, times.p99, peers, times=HALF)
