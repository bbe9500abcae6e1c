"""Is the Cramer-Rao bound right? Beside it, the errors of an estimator that is told all that it is.

usage: python -m lab.bound [--seeds N] [--robots N]

Where the ratio of both, in the mean of many seeds, is not one, the bound has another noise than the
simulator. Errors of one drive hang together, live ones most: twenty seeds tell a quarter.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from lab.bound import efficiency
from lab.progress import Progress
from lab.reproduce.tally import Tally


def main(arguments: Sequence[str] | None = None) -> int:
    """Print one line for each row and unit."""
    parser = argparse.ArgumentParser(prog="lab.bound", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="default 20")
    parser.add_argument("--robots", type=int, default=3, metavar="N", help="default 3")
    options = parser.parse_args(arguments)
    team, total = efficiency.Team(options.robots, 0.0), Tally()
    bar = Progress("bounds", options.seeds, "seeds")
    for seed in range(options.seeds):
        total.merge(efficiency.checked(team, seed).sums)
        bar(seed + 1)
    bar.end()
    print(f"{options.robots} robots, {options.seeds} seeds: root mean squares")
    for row in efficiency.ROWS[:2]:
        for unit in efficiency.UNITS:
            name = f"{team.name}/{row}/{unit}"
            bound, told = (total[f"{name}/{what}"].mean for what in ("bound", "told"))
            print(
                f"{row:<10} bound {bound**0.5:.3f} {unit}, told all {told**0.5:.3f} {unit}: "
                f"{bound / told:.2f}"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
