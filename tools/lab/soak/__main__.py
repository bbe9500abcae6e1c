"""tools/soak: faults of every kind, alone and mixed, and a whole day, in virtual time.

Exit codes: 0 every promise is kept, 1 some are not, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from lab.files import keep
from lab.numbers import real, whole
from lab.progress import Progress
from lab.soak import churn, results
from lab.soak.invariants import Broken
from lab.soak.run import Result, commit, run
from lab.soak.scenarios import MIXED, SCENARIOS

BROKEN = 1
MIXED_SEEDS = 1_000
HOURS = 24.0
JOURNAL_EVERY = 10
"""Of so many seeds one is also replayed to fresh robots (P7), which takes as long again."""
RESULTS = Path(__file__).with_name("results.jsonl")
PAGE = Path(__file__).with_name("results.md")

EXAMPLES = """\
examples:
  tools/soak                              all scenarios, 1,000 mixtures, a day; goes on where it was
  tools/soak parted outliers-0.3 --seeds 5
  tools/soak mixed --seed 17              one mixture, and nothing is written down
  tools/soak mixed --seed 17 --until 61.3   only so far
  tools/soak --hours 2                    only two hours of the day with churn
  tools/soak --page                       results.md anew from the results file
  tools/soak --list                       the names of all scenarios
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    unknown = [name for name in options.scenario if name not in {*SCENARIOS, MIXED}]
    if unknown:
        parser.error(f"no scenario {unknown[0]!r}; tools/soak --list names them")
    if options.list:
        print(
            "\n".join(f"{s.name:<22} {', '.join(s.rows):<8} {s.what}" for s in SCENARIOS.values())
        )
        return 0
    if options.page:
        return keep(PAGE, "\n".join(results.page(results.read(options.results))) + "\n")
    if options.seed is not None:
        found = [run(name, options.seed, options.until) for name in options.scenario or [MIXED]]
        print("\n".join(result.line for result in found))
        return BROKEN if any(result.fault for result in found) else 0
    failed = 0
    if options.hours is None or options.scenario:
        failed += _runs(_wanted(options.scenario, options.seeds), options.results, options.jobs)
    if not options.scenario:
        failed += _day(HOURS if options.hours is None else options.hours, options.results)
    return BROKEN if failed else 0


def _wanted(names: list[str], seeds: int) -> list[tuple[str, int]]:
    if names:
        return [(name, seed) for name in names for seed in range(1, seeds + 1)]
    alone = [(name, seed) for name in SCENARIOS for seed in range(1, seeds + 1)]
    return alone + [(MIXED, seed) for seed in range(1, MIXED_SEEDS + 1)]


def _runs(wanted: list[tuple[str, int]], path: Path, jobs: int) -> int:
    """Play what is not in the results file yet; how many failed."""
    known = results.done(results.read(path), commit())
    left = [job for job in wanted if job not in known]
    progress = Progress("played", len(wanted), "runs")
    failed = 0
    for count, result in enumerate(_played(left, jobs), start=len(wanted) - len(left) + 1):
        results.add(path, result.as_json())
        progress(count)
        if result.fault:
            failed += 1
            print(result.line, flush=True)
    progress.end()
    return failed


def _played(left: list[tuple[str, int]], jobs: int) -> Iterator[Result]:
    if jobs == 1:
        yield from map(_run, left)
    elif left:
        with ProcessPoolExecutor(min(jobs, len(left))) as pool:
            yield from pool.map(_run, left)


def _run(job: tuple[str, int]) -> Result:
    name, seed = job
    return run(name, seed, journal=seed % JOURNAL_EVERY == 1)


def _day(hours: float, path: Path) -> int:
    progress = Progress("played", hours * 3600)
    try:
        for hour in churn.hours(1, hours, progress, (path.with_suffix(".day"), commit())):
            results.add(path, {**hour.as_json(), "commit": commit()})
    except Broken as broken:
        print(f"FAIL day seed=1 commit={commit()} {broken}\n  repeat: tools/soak --hours {hours:g}")
        return 1
    finally:
        progress.end()
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/soak",
        description="Play faults to a team in virtual time: are all promises kept, always?",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scenario", nargs="*", metavar="SCENARIO", help="all of them if left out")
    parser.add_argument("--seeds", type=whole(1), default=1, metavar="N", help="of each, 1 to N")
    parser.add_argument("--seed", type=whole(), metavar="N", help="only this one, written nowhere")
    parser.add_argument(
        "--until", type=real(), default=float("inf"), metavar="S", help="second of the run"
    )
    parser.add_argument("--hours", type=real(), metavar="H", help="of the day with churn")
    parser.add_argument(
        "--jobs", type=whole(1), default=os.cpu_count() or 1, metavar="N", help="at once"
    )
    parser.add_argument(
        "--results",
        type=Path,
        default=RESULTS,
        metavar="FILE",
        help="by default results.jsonl beside results.md",
    )
    parser.add_argument("--page", action="store_true", help="make results.md of the results file")
    parser.add_argument("--list", action="store_true", help="name the scenarios")
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
