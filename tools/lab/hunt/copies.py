"""A copy of the tree in which something may be broken, and tests run in it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from lab.hunt.told import WHERE

ROOT = Path(__file__).resolve().parents[3]
PARTS = ("drslamd", "tests", "tools", "etc", "systemd", "pyproject.toml", "README.md")
PATIENCE_S = 300.0
MOST_FAILED = 8
"""Of which one names a row."""


class Ran(NamedTuple):
    """How a run of tests ended.

    Attributes:
        failed: the rows that each failed test names.
        is_green: did every test pass?
        said: its last lines.
    """

    failed: dict[str, list[str]]
    is_green: bool
    said: str


@contextmanager
def copied() -> Iterator[Path]:
    """A copy that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="drslamd-hunt-") as name:
        folder = Path(name)
        for part in PARTS:
            source = ROOT / part
            if source.is_dir():
                ignored = shutil.ignore_patterns("__pycache__", "*.png", "out")
                shutil.copytree(source, folder / part, ignore=ignored)
            else:
                shutil.copy(source, folder / part)
        yield folder


def ran(
    folder: Path, tests: Sequence[str], patience_s: float = PATIENCE_S, most: int = MOST_FAILED
) -> Ran:
    """Run tests of a copy until so many fail; tests that do not end count as failed."""
    told = folder / "failed.json"
    told.unlink(missing_ok=True)
    paths = os.pathsep.join(str(folder / part) for part in (".", "tools"))
    environment = {
        **os.environ,
        "PYTHONPATH": paths,
        "PYTHONDONTWRITEBYTECODE": "1",
        "OPENBLAS_NUM_THREADS": "1",
        WHERE: str(told),
    }
    options = [
        f"--maxfail={most}",
        "-q",
        "-p",
        "lab.hunt.told",
        "-p",
        "no:cacheprovider",
        "--no-header",
    ]
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=patience_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Ran({"(none of them ends)": []}, False, "")
    failed = json.loads(told.read_text()) if told.exists() else {}
    return Ran(failed, done.returncode == 0, "\n".join(done.stdout.splitlines()[-15:]))
