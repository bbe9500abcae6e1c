"""How honest, how fresh and how dear the pose to steer by is.

usage: python -m lab.near [--seeds N] [--first N] [--world NAME ...] [--seconds S] [--robots N ...]
                          [--recording FILE ...]

Three figures: squared errors of poses relative to peers over what was claimed, in the paper's
experiment, in worlds of short drives (`lab.trust.worlds`) and in recordings; the age of poses at
whoever reads the local socket, while module 3 of a team so large computes without a pause; the
share of a core that telling takes. The last two need a quiet machine; `--robots` without a number
leaves them out, `--seeds 0` the first.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from lab.near import age, pairs
from lab.numbers import real, whole
from lab.progress import Progress
from lab.recordings import readers
from lab.recordings.recording import Recording
from lab.recordings.world import simulate
from lab.reproduce import experiment
from lab.reproduce.tally import Tally
from lab.trust.worlds import CONFIGURED, RECORDED

LEAST, MOST = 0.8, 1.25
MOST_AGE_MS, MOST_SHARE = 5.0, 0.01
HZ = 50
WORLDS: dict[str, Callable[[int], Recording]] = {
    "reproduce": lambda seed: experiment.trial(seed).recording,
    "configured": lambda seed: simulate(CONFIGURED, seed),
    "recorded": lambda seed: simulate(RECORDED, seed),
}
"""What a seed is played of."""


def main() -> int:
    """Print every figure beside its goal; 1 when one is missed."""
    parser = argparse.ArgumentParser(prog="lab.near", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=whole(), default=20)
    parser.add_argument("--first", type=whole(), default=1, help="seed")
    parser.add_argument("--world", nargs="*", default=["reproduce"], choices=tuple(WORLDS))
    parser.add_argument("--seconds", type=real(1), default=20.0)
    parser.add_argument("--robots", type=whole(2, 100), nargs="*", default=[3, 50])
    parser.add_argument("--recording", type=Path, nargs="*", default=[], metavar="FILE")
    options = parser.parse_args()
    missed = 0
    for robots in options.robots:
        ages, cost_us = asyncio.run(age.measured(robots, options.seconds))
        p50, p99 = np.percentile(ages, [50, 99])
        missed += _row(f"{robots} robots, age of the pose, median", p50, "ms", MOST_AGE_MS)
        missed += _row(f"{robots} robots, age of the pose, p99", p99, "ms", MOST_AGE_MS)
        share = HZ * cost_us / 1e6
        missed += _row(f"{robots} robots, telling, share of a core", share, "", MOST_SHARE)
    seeds = range(options.first, options.first + options.seeds)
    for name in options.world if options.seeds else ():
        played = ((seed, WORLDS[name](seed)) for seed in seeds)
        missed += _honesty(name, played, len(seeds))
    for path in options.recording:
        recording = pairs.on_axles(readers.read(path))
        missed += _honesty(recording.name, [(1, recording)], 1)
    return int(missed > 0)


def _honesty(name: str, played: Iterable[tuple[int, Recording]], runs: int) -> int:
    """Figures of recordings, each with its seed; 1 when the goal is missed."""
    tally, bar = Tally(), Progress(name, runs, "runs")
    for done, (seed, recording) in enumerate(played, start=1):
        tally.merge(pairs.honesty(recording, seed).sums)
        bar(done)
    bar.end()
    nees = tally["pair/nees"].mean
    print(f"{name}, {runs} runs")
    print(f"  pairs, NEES {nees:.2f} ({LEAST} to {MOST}), n {tally['pair/nees'].n}")
    print(f"  pairs in their 95 % ellipses {100 * tally['pair/inside'].mean:.1f} %")
    print(f"  own pose, NEES {tally['own/nees'].mean:.2f}, n {tally['own/nees'].n}")
    print(f"  age of a peer, mean {tally['pair/age'].mean:.2f} s")
    print(f"  fastest step of odom {tally['odom/step'].most:.2f} m/s", flush=True)
    return int(not LEAST <= nees <= MOST)


def _row(name: str, value: float, unit: str, goal: float) -> int:
    print(f"{name}: {value:.4g} {unit} (at most {goal:g})".replace("  ", " "), flush=True)
    return int(value > goal)


if __name__ == "__main__":
    sys.exit(main())
