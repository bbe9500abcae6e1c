"""Which tests name which rows, read off their markers, and the page of that."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from lab.matrix.measuring import Found
from lab.matrix.rows import ROWS
from lab.soak.results import Row as Run
from lab.soak.scenarios import SCENARIOS

ROOT = Path(__file__).resolve().parents[3]
SCENARIO_TEST = "tests/lab/soak/test_scenarios.py"
PAGE = Path(__file__).with_name("matrix.md")
RUNS = ROOT / "tools" / "lab" / "soak" / "results.jsonl"
"""Runs whose figures the page shows: those of the last long run."""
MOST_SHOWN = 6

Tests = Mapping[str, Sequence[str]]
"""Tests by row, as pytest names them."""


def named_rows() -> dict[str, list[str]]:
    """Tests of each row: those with `@pytest.mark.row`, and scenarios of the bench."""
    out: dict[str, list[str]] = defaultdict(list)
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        name = str(path.relative_to(ROOT))
        for row, test in _markers(ast.parse(path.read_text())):
            out[row].append(f"{name}::{test}" if test else name)
    for scenario in SCENARIOS.values():
        for row in scenario.rows:
            out[row].append(f"{SCENARIO_TEST}[{scenario.name}]")
    return dict(out)


def _markers(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Rows that a file names, and where: at a test, or for the whole file."""
    for node in tree.body:
        is_test = isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        test = node.name if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) else ""
        places: list[ast.AST] = [node]
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            places = list(node.decorator_list)
        found = [row for place in places for row in _rows_in(place)]
        if is_test or isinstance(node, (ast.Assign, ast.AnnAssign)):
            yield from ((row, test) for row in dict.fromkeys(found))


def _rows_in(place: ast.AST) -> Iterator[str]:
    for node in ast.walk(place):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "pytest.mark.row":
            yield from (str(a.value) for a in node.args if isinstance(a, ast.Constant))


def missing(tests: Tests) -> list[str]:
    """Rows that no test names."""
    return [row for row in ROWS if row not in tests]


def unknown(tests: Tests) -> list[str]:
    """Rows that tests name and that are none."""
    return [row for row in tests if row not in ROWS]


def page(tests: Tests, runs: Sequence[Run], found: Mapping[str, Found]) -> list[str]:
    """As Markdown."""
    out = [
        "# The fault matrix",
        "",
        "Made by `tools/matrix` from the markers of the tests, from what they measured",
        "(`tools/matrix --measure`) and from what `tools/soak` found; `tests/lab/matrix` checks",
        "that it is up to date.",
        "",
        "| row | what goes wrong | what holds | tests | measured |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, row in ROWS.items():
        what = "; ".join(filter(None, (kept(name, found), measured(name, runs))))
        cells = [name, row.fault, row.line, _shown(tests.get(name, ())), what]
        out.append("| " + " | ".join(cells) + " |")
    out += ["", "## Played in virtual time", ""]
    out += [
        "A plain Linux machine lacks what these rows need; robots, clocks and radio are simulated:"
    ]
    out += ["", *(f"* {name}: {row.simulated}" for name, row in ROWS.items() if row.simulated)]
    return out


def _shown(tests: Sequence[str]) -> str:
    if not tests:
        return "**none yet**"
    short = [test.removeprefix("tests/") for test in tests]
    more = [f"and {len(short) - MOST_SHOWN} more"] if len(short) > MOST_SHOWN else []
    return "<br>".join([*(f"`{test}`" for test in short[:MOST_SHOWN]), *more])


def kept(name: str, found: Mapping[str, Found]) -> str:
    """How many tests of a row passed, and what they measured."""
    mine = [one for one in found.values() if name in one.rows]
    if not mine:
        return ""
    passed = sum(one.outcome == "passed" for one in mine)
    absent = sum(one.outcome == "skipped" for one in mine)
    left_out = f", {absent} could not run here" if absent else ""
    said = [text for one in mine for text in one.said]
    return "; ".join([f"{passed} of {len(mine)} tests passed{left_out}", *said])


def measured(name: str, runs: Sequence[Run]) -> str:
    """What the bench found of a row: how many runs, and the longest time until all was well."""
    mine = [
        run
        for run in runs
        if "scenario" in run
        and run["scenario"] in SCENARIOS
        and name in SCENARIOS[run["scenario"]].rows
    ]
    healed = [run["figures"]["healed_s"] for run in mine]
    if not mine:
        return ""
    failed = sum(bool(run["fault"]) for run in mine)
    known = [h for h in healed if h is not None]
    longest = f"well again after {max(known):.0f} s at most" if known else "never well again"
    return f"{len(mine)} runs, {failed} failed; {longest}"
