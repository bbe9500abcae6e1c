"""A plug-in of pytest: which tests failed, and which rows of the matrix they name."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

WHERE = "DRSLAMD_FAILED"
"""The variable that names the file."""


class Told:
    """Failed tests of one run, by name, with their rows."""

    def __init__(self) -> None:
        self.failed: dict[str, list[str]] = {}

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Any:
        outcome = yield
        if outcome.get_result().failed:
            rows = sorted(str(mark.args[0]) for mark in item.iter_markers("row"))
            self.failed[item.nodeid] = rows

    def pytest_sessionfinish(self) -> None:
        Path(os.environ[WHERE]).write_text(json.dumps(self.failed))


def pytest_configure(config: pytest.Config) -> None:
    if os.environ.get(WHERE):
        config.pluginmanager.register(Told())
