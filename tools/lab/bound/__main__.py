"""Is the Cramer-Rao bound right? Beside it, the errors of an estimator that is told all that it is.

usage: python -m lab.bound [--seeds N] [--robots N]

Where the ratio of both, in the mean of many seeds, is not one, the bound has another noise than the
simulator. Errors of one drive hang together, live ones most; the scatter is that of whole drives
(jackknife), and none with one.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np

from lab.bound import efficiency
from lab.numbers import whole
from lab.progress import Progress
from lab.recordings.recording import Array
from lab.reproduce.tally import Tally

KINDS = ("bound", "told")


def jackknifed(drives: Array) -> tuple[float, float]:
    """The ratio of the means of two columns (n, 2), and how far that scatters by the drives."""
    first, second = drives.mean(axis=0)
    others = drives.sum(axis=0) - drives
    with np.errstate(invalid="ignore"):
        spread = np.sqrt((len(drives) - 1) * np.var(others[:, 0] / others[:, 1]))
    return float(first / second), float(spread)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print one line for each row and unit."""
    parser = argparse.ArgumentParser(prog="lab.bound", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=whole(1), default=20, metavar="N", help="default 20")
    parser.add_argument("--robots", type=whole(2, 100), default=3, metavar="N", help="default 3")
    options = parser.parse_args(arguments)
    team, drives = efficiency.Team(options.robots, 0.0), list[Tally]()
    bar = Progress("bounds", options.seeds, "seeds")
    for seed in range(options.seeds):
        drives.append(efficiency.checked(team, seed))
        bar(seed + 1)
    bar.end()
    print(f"{options.robots} robots, {options.seeds} seeds: root mean squares")
    for row in efficiency.ROWS[:2]:
        for unit in efficiency.UNITS:
            name = f"{team.name}/{row}/{unit}"
            known = np.array([[drive[f"{name}/{x}"].mean for x in KINDS] for drive in drives])
            bound, told = np.sqrt(known.mean(axis=0))
            ratio, spread = jackknifed(known)
            print(
                f"{row:<10} bound {bound:.3f} {unit}, told all {told:.3f} {unit}: "
                f"{ratio:.2f} ± {spread:.2f}"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
