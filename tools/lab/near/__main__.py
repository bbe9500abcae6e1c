"""How honest, how fresh and how dear the pose to steer by is.

usage: python -m lab.near [--seeds N] [--seconds S] [--robots N ...]

Three figures: squared errors of poses relative to peers over what was claimed, in the paper's
experiment; the age of poses at whoever reads the local socket, while module 3 of a team so large
computes without a pause; the share of a core that telling takes. The last two need a quiet machine.
"""

from __future__ import annotations

import argparse
import asyncio
import sys

import numpy as np

from lab.near import age, pairs
from lab.progress import Progress
from lab.reproduce import experiment
from lab.reproduce.tally import Tally

LEAST, MOST = 0.8, 1.25
MOST_AGE_MS, MOST_SHARE = 5.0, 0.01


def main() -> int:
    """Print every figure beside its goal; 1 when one is missed."""
    parser = argparse.ArgumentParser(prog="lab.near", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--robots", type=int, nargs="*", default=[3, 50])
    options = parser.parse_args()
    missed = 0
    for robots in options.robots:
        ages, _ = asyncio.run(age.measured(robots, options.seconds, computes=True))
        p50, p99 = np.percentile(ages, [50, 99])
        missed += _row(f"{robots} robots, age of the pose, median", p50, "ms", MOST_AGE_MS)
        missed += _row(f"{robots} robots, age of the pose, p99", p99, "ms", MOST_AGE_MS)
        _, alone = asyncio.run(age.measured(robots, options.seconds, False, reads=False))
        _, read = asyncio.run(age.measured(robots, options.seconds, False))
        missed += _row(f"{robots} robots, telling, share of a core", read - alone, "", MOST_SHARE)
    if options.seeds:
        missed += _honesty(options.seeds)
    return int(missed > 0)


def _honesty(seeds: int) -> int:
    tally, bar = Tally(), Progress("seeds", seeds, "")
    for seed in range(1, seeds + 1):
        tally.merge(pairs.honesty(experiment.trial(seed).recording, seed).sums)
        bar(seed)
    bar.end()
    nees = tally["pair/nees"].mean
    print(f"{seeds} seeds, pairs, NEES {nees:.2f} ({LEAST} to {MOST}), n {tally['pair/nees'].n}")
    print(f"{seeds} seeds, own pose, NEES {tally['own/nees'].mean:.2f}")
    print(f"{seeds} seeds, age of a peer, mean {tally['pair/age'].mean:.2f} s")
    print(f"{seeds} seeds, fastest step of odom {tally['odom/step'].most:.2f} m/s")
    return int(not LEAST <= nees <= MOST)


def _row(name: str, value: float, unit: str, goal: float) -> int:
    print(f"{name}: {value:.4g} {unit} (at most {goal:g})".replace("  ", " "), flush=True)
    return int(value > goal)


if __name__ == "__main__":
    sys.exit(main())
