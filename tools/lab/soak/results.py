"""The results file of tools/soak, one JSON object a line, and the page that is made of it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lab.soak.scenarios import MIXED, SCENARIOS

Row = Mapping[str, Any]


def read(path: Path) -> list[Row]:
    """What is there; a line that was cut when the run was ended is left out."""
    rows = []
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    return rows


def add(path: Path, row: Row) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        file.write(json.dumps(row) + "\n")


def done(rows: Sequence[Row], commit: str) -> set[tuple[str, int]]:
    """Runs that need not be played again: scenario and seed, at this commit."""
    return {(r["scenario"], r["seed"]) for r in rows if "scenario" in r and r["commit"] == commit}


def page(rows: Sequence[Row]) -> list[str]:
    """As Markdown: the scenarios, the mixtures, the day."""
    runs = [row for row in rows if "scenario" in row]
    out = ["# What tools/soak found last", "", "Made by `tools/soak --page`; commits: "]
    out[-1] += ", ".join(sorted({str(row["commit"]) for row in rows})) + "."
    out += [
        "",
        "| scenario | what happens | runs | failed | well again after [s], longest | liars |",
    ]
    out += ["| --- | --- | ---: | ---: | ---: | ---: |"]
    for name, scenario in SCENARIOS.items():
        mine = [row for row in runs if row["scenario"] == name]
        if mine:
            out.append(f"| {name} | {scenario.what} | {_summary(mine)} |")
    mixed = [row for row in runs if row["scenario"] == MIXED]
    if mixed:
        out.append(f"| {MIXED} | three to six of these at once | {_summary(mixed)} |")
    failed = Counter(f"{row['scenario']}: {row['fault']}" for row in runs if row["fault"])
    if failed:
        out += ["", "Failures:", ""]
        out += [f"* {count} x {what}" for what, count in failed.most_common(40)]
    return [*out, *_day([row for row in rows if "hour" in row])]


def _summary(rows: Sequence[Row]) -> str:
    healed = [row["figures"]["healed_s"] for row in rows]
    known = [h for h in healed if h is not None]
    longest = f"{max(known):.0f}" if known else "-"
    liars = sum(row["figures"]["liars"] for row in rows)
    return f"{len(rows)} | {sum(bool(r['fault']) for r in rows)} | {longest} | {liars}"


def _day(hours: Sequence[Row]) -> list[str]:
    if not hours:
        return []
    begins = [k for k, row in enumerate(hours) if row["hour"] == 1]
    hours = hours[begins[-1] if begins else 0 :]
    out = ["", "Five robots, one restarted every half hour, 30 % of datagrams lost. Where a second"]
    out += ["process went on with the day, memory begins anew.", ""]
    columns = {
        "hour": "hour",
        "of a core [s]": "took_s",
        "process": "sitting",
        "RSS [MB]": "rss_mb",
        "descriptors": "descriptors",
        "solve [ms]": "solve_ms",
        "pairs [m]": "pair_rms_m",
        "entries": "entries",
    }
    out += [f"| {' | '.join(columns)} |", f"|{' ---: |' * len(columns)}"]
    keys = columns.values()
    return [*out, *("| " + " | ".join(str(row[key]) for key in keys) + " |" for row in hours)]
