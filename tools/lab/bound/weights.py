"""How much ranges should weigh, and what is lost by weighing each by itself: by covariances alone.

usage: python -m lab.bound.weights [--seeds N] [--robots N] [--seconds S]

Ranges of a pair share their errors from one second to the next. An estimator that weighs each by
itself can at best choose the weight that suits how long a drive is. Here it is told everything
else, so what it falls behind the bound is what the weights cost. Nothing is drawn but the drives,
so a few seeds are enough. Live, in the frame of robot 0, without gyros.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np

from lab.bound import cramer_rao
from lab.bound.efficiency import Team
from lab.numbers import real, whole
from lab.progress import Progress
from lab.recordings.recording import Array
from lab.recordings.world import STEP_S
from lab.reproduce import driving

SIGMAS_M = (0.06, 0.1, 0.135)
"""As ranges scatter, as configured, and as much as between robots with gyros."""
FIRST_S, EVERY_S = 20.0, 10.0


def variances(robots: int, covariances: Array) -> Array:
    """(k,) mean variance of the positions of all but robot 0, m^2, of covariances (k, 3R, 3R)."""
    of_axes = np.einsum("kii->ki", covariances).reshape(-1, robots, 3)
    return np.asarray(of_axes[:, 1:, :2].sum(axis=2).mean(axis=1))


def of_drive(team: Team, seed: int, seconds: float, at: Array) -> Array:
    """(1 + sigmas, k) those of the bound and with each of `SIGMAS_M`, at some of the steps."""
    rng, scene = np.random.default_rng(seed), team.scene
    ways = [driving.by_hand(rng, scene) for _ in range(scene.robots)]
    truths = np.stack(ways, axis=1)[:: round(cramer_rao.STEP_S / STEP_S)]
    truths = truths[: round(seconds / cramer_rao.STEP_S) + 1]
    reached = [cramer_rao.of_team(truths, scene, at).live]
    reached += [cramer_rao.each_alone(truths, scene, sigma, at) for sigma in SIGMAS_M]
    return np.array([variances(scene.robots, each) for each in reached])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print root mean squares by time, and beside them the share of the bound's variance."""
    parser = argparse.ArgumentParser(
        prog="lab.bound.weights", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--seeds", type=whole(1), default=6, metavar="N", help="default 6")
    parser.add_argument("--robots", type=whole(2, 100), default=3, metavar="N", help="default 3")
    parser.add_argument("--seconds", type=real(30), default=120.0, metavar="S", help="default 120")
    options = parser.parse_args(arguments)
    times = np.arange(FIRST_S, min(options.seconds, 350.0) + 0.5, EVERY_S)
    at, drives = np.round(times / cramer_rao.STEP_S).astype(int), list[Array]()
    bar = Progress("drives", options.seeds, "seeds")
    for seed in range(options.seeds):
        drives.append(of_drive(Team(options.robots, 0.0), seed, times[-1], at))
        bar(seed + 1)
    bar.end()
    mean = np.mean(drives, axis=0)
    print("| s | bound m |", *(f"{sigma:g} m: error m | efficiency |" for sigma in SIGMAS_M))
    print("| --- | --- |", *("--- | --- |" for _ in SIGMAS_M))
    for k, t in enumerate(times):
        cells = (f"{np.sqrt(v):.3f} | {mean[0, k] / v:.2f} |" for v in mean[1:, k])
        print(f"| {t:.0f} | {np.sqrt(mean[0, k]):.3f} |", *cells)
    total = mean.sum(axis=1)
    print("| all | |", *(f"| {total[0] / v:.2f} |" for v in total[1:]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
