"""What the tests of the rows find: a plug-in of pytest, and the file in which it is kept.

A test says what it measured by pytest's `record_property("measured", "0.23 s of a core")`; one that
says nothing tells that its line is kept, by passing. Runs add to each other, so that the slow tests
can have their own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from lab.files import keep

WHERE = "DRSLAMD_MEASURED"
"""The variable that names the file."""
FOUND = Path(__file__).with_name("measured.json")


class Found(NamedTuple):
    """What one test found.

    Attributes:
        rows: that it names.
        outcome: passed, failed or skipped; of several cases the worst.
        said: what it measured.
    """

    rows: list[str]
    outcome: str
    said: list[str]


WORST = ("failed", "skipped", "passed")


def read(path: Path) -> dict[str, Found]:
    """By test; nothing where there is no file yet."""
    if not path.exists():
        return {}
    return {name: Found(*row) for name, row in json.loads(path.read_text()).items()}


def write(path: Path, found: Mapping[str, Found]) -> None:
    """One line for each test."""
    lines = [f"{json.dumps(name)}: {json.dumps(found[name])}" for name in sorted(found)]
    keep(path, "{\n" + ",\n".join(lines) + "\n}\n")


class Measuring:
    """Tests of one run that name rows."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[str, Found] = {}

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Any:
        outcome = yield
        report = outcome.get_result()
        rows = sorted({str(mark.args[0]) for mark in item.iter_markers("row")})
        is_result = report.when == "call" or report.outcome != "passed"
        if not rows or not is_result:
            return
        name = item.nodeid.split("[")[0]
        before = self._found.get(name, Found(rows, "passed", []))
        worst = min(before.outcome, report.outcome, key=WORST.index)
        said = [str(text) for key, text in report.user_properties if key == "measured"]
        self._found[name] = Found(rows, worst, [*before.said, *said])

    def pytest_sessionfinish(self) -> None:
        write(self._path, {**read(self._path), **self._found})


def pytest_configure(config: pytest.Config) -> None:
    if os.environ.get(WHERE):
        config.pluginmanager.register(Measuring(Path(os.environ[WHERE])))
