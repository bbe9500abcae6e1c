"""All runs of some cases, in several processes, and what comes out of them."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lab.progress import Progress
from lab.trust.cases import CASES, Case
from lab.trust.figures import Figures, figures
from lab.trust.naming import OF_THE_START, keys
from lab.trust.promises import Check, checks
from lab.trust.watch import Run

TODAY: dict[str, dict[str, float]] = json.loads(Path(__file__).with_name("today.json").read_text())
"""ATE of cases by seed, m, of the estimator that this one must not be worse than."""

Job = tuple[str, int]
"""A case and a seed."""


@dataclass(frozen=True)
class Trusted:
    """A case, its runs by seed and what they come to."""

    case: Case
    runs: Mapping[int, Run]
    figures: Figures
    checks: list[Check]

    @property
    def title(self) -> str:
        return f"{self.case.name}: {self.case.what}"


def trusted(seeds: Mapping[str, int], processes: int, first: int | None = None) -> list[Trusted]:
    """Play cases, each with so many seeds, and what they need to be compared with.

    Args:
        first: seed of every case, in the place of its own.
    """
    wanted = {name: _seeds(CASES[name], count, first) for name, count in seeds.items()}
    twins = [(CASES[name].twin, k) for name, ks in wanted.items() for k in ks]
    jobs = dict.fromkeys([(name, k) for name, ks in wanted.items() for k in ks] + twins)
    runs = dict(_played([(name, seed) for name, seed in jobs if name], processes))
    out = []
    for name, ks in wanted.items():
        case = CASES[name]
        mine = {k: runs[name, k] for k in ks}
        clean = {k: runs[case.twin, k] for k in ks if case.twin}
        today = {int(k): ate for k, ate in TODAY.get(name, {}).items()}
        found = figures(mine, clean, today, case.cause)
        is_comparable = bool(today.keys() & mine)
        promised = tuple(p for p in case.promises if is_comparable or p.figure != "ate_x_today")
        out.append(Trusted(case, mine, found, checks(name, promised, found)))
    return out


def _seeds(case: Case, count: int, first: int | None) -> range:
    start = case.first_seed if first is None else first
    return range(start, start + count)


def _played(jobs: list[Job], processes: int) -> Iterator[tuple[Job, Run]]:
    """Each job with its run, in the order of the jobs."""
    progress = Progress("played", len(jobs), "runs")
    progress(0)
    if processes == 1:
        for done, job in enumerate(jobs, start=1):
            yield job, _run(job)
            progress(done)
    else:
        with ProcessPoolExecutor(min(processes, len(jobs))) as pool:
            for done, (job, run) in enumerate(
                zip(jobs, pool.map(_run, jobs), strict=True), start=1
            ):
                yield job, run
                progress(done)
    progress.end()


def _run(job: Job) -> Run:
    name, seed = job
    return CASES[name].run(seed)


def as_json(found: Iterable[Trusted]) -> dict[str, Any]:
    """Everything by case; what is not finite is null."""
    return {trusted.case.name: _case(trusted) for trusted in found}


def _case(trusted: Trusted) -> dict[str, Any]:
    figures = {name: _number(value) for name, value in asdict(trusted.figures).items()}
    promises = [
        {**asdict(check.promise), "reached": check.reached, "is_kept": check.is_kept}
        for check in trusted.checks
    ]
    return {
        "figures": figures,
        "promises": [{k: _number(v) for k, v in promise.items()} for promise in promises],
        "ate_m": {str(seed): _number(run.ate_m[None]) for seed, run in trusted.runs.items()},
        "sentences": dict(sentences(trusted.runs.values()).most_common()),
    }


def _number(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def sentences(runs: Iterable[Run]) -> Counter[str]:
    """In how many runs each sentence is said, whatever its numbers; not those of the start."""
    found: Counter[str] = Counter()
    for run in runs:
        told = {s.sentence for s in run.said if keys(s) or not OF_THE_START.search(s.sentence)}
        found.update({re.sub(r"\d+(\.\d+)?", "#", sentence) for sentence in told})
    return found
