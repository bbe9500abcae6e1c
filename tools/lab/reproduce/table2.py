"""Table II, the paper's column: consistency and optimisation for every tau and epsilon."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drslamd.slam.optimizer.rbcd import riemannian_descent
from lab.play.block_team import descend
from lab.recordings.recording import Array
from lab.reproduce import dpgo, paper_column
from lab.reproduce.experiment import PAIRS, Trial, odometry_errors, pose_errors
from lab.reproduce.paper_column import Closures
from lab.reproduce.tally import Tally
from lab.score import metrics

TAUS = (10, 50, 100)
MOST_ROUNDS = 120
"""Of DPGO; most rows are at rest after thirty."""
NEAR = 1.01
"""Share of the least cost that rounds are counted to."""
EPSILONS = (None, 0.01, 0.05, 0.1, 0.2, 0.5, 0.8)
"""None is "without PCM"."""


@dataclass(frozen=True)
class Row:
    """One row on one seed.

    Attributes:
        kept: closures of each pair, after PCM.
        poses: of each robot after DPGO, as the daemon runs it; least: at the minimum of its cost.
        rounds: until the cost was within 1 % of that; one above MOST_ROUNDS when it never was.
    """

    tau: int
    epsilon: float | None
    kept: dict[tuple[int, int], Closures]
    poses: dict[int, Array]
    least: dict[int, Array]
    rounds: int


def rows(
    trial: Trial, taus: Sequence[int], epsilons: Sequence[float | None], tally: Tally
) -> Iterator[Row]:
    """The rows of a seed; the times of the three modules go to the tally."""
    for tau in taus:
        ms: list[float] = []
        seen = {pair: paper_column.closures(trial, pair, tau, ms) for pair in PAIRS}
        tally.add(f"paper/ms/{tau}/pose", ms)
        start = time.perf_counter()
        lengths = {pair: paper_column.consistency(trial, pair, c) for pair, c in seen.items()}
        rowed = time.perf_counter() - start
        for epsilon in epsilons:
            start = time.perf_counter()
            kept = {p: _kept(c, lengths[p], epsilon) for p, c in seen.items()}
            sought = time.perf_counter() - start
            problem = dpgo.graph(trial.odometry, kept)
            start = time.perf_counter()
            least = dpgo.minimum(problem, dpgo.chordal(problem))
            tally.add(f"paper/ms/{tau}/dpgo", (time.perf_counter() - start) * 1e3)
            parts = dpgo.split(problem)
            found = descend(parts, MOST_ROUNDS)
            enough = NEAR * parts.cost(riemannian_descent.lift(least, 1))
            if epsilon is not None:
                each = (rowed + sought) * 1e3 / max(1, sum(len(c.k) for c in seen.values()))
                tally.add(f"paper/ms/{tau}/pcm", each)
            yield Row(
                tau,
                epsilon,
                kept,
                dpgo.by_robot(problem, found.poses()),
                dpgo.by_robot(problem, least),
                found.rounds_to(enough) or MOST_ROUNDS + 1,
            )


def _kept(found: Closures, lengths: list[Array], epsilon: float | None) -> Closures:
    if epsilon is None:
        return found
    return found.chosen(paper_column.inliers(lengths, epsilon))


def fill(trial: Trial, taus: Sequence[int], epsilons: Sequence[float | None]) -> Tally:
    """Errors before and after optimisation, and of odometry alone.

    Before it there is a pose only where a closure was kept; "there" is after it at the same times.
    """
    tally = Tally()
    tally.poses("odometry", odometry_errors(trial.recording))
    truth = [trial.truth[r] for r in sorted(trial.truth)]
    for row in rows(trial, taus, epsilons, tally):
        name = f"table2/{row.tau}/{row.epsilon}"
        tally.add(f"{name}/inliers", sum(len(c.k) for c in row.kept.values()))
        for pair, closures in row.kept.items():
            true = trial.true_pairs(*pair)
            tally.poses(f"{name}/before", pose_errors(closures.poses, true[closures.k]))
            after = metrics.relative(row.poses[pair[0]], row.poses[pair[1]])
            tally.poses(f"{name}/after", pose_errors(after, true))
            there = closures.k
            tally.poses(f"{name}/there", pose_errors(after[there], true[there]))
        for words, poses in ((name, row.poses), (f"{name}/least", row.least)):
            tally.add(f"{words}/ate", joint_ate([poses[r] for r in sorted(poses)], truth))
        tally.add(f"{name}/rounds", row.rounds)
    return tally


def joint_ate(poses: Sequence[Array], truth: Sequence[Array]) -> float:
    """RMSE, m, of all robots' positions under one SE(2)."""
    together, true = np.concatenate(poses), np.concatenate(truth)
    moved = metrics.compose(metrics.alignment(together[:, :2], true[:, :2])[None], together)
    return float(np.sqrt(np.mean(np.sum((moved - true)[:, :2] ** 2, axis=1))))
