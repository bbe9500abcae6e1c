"""Runs a scenario in a network namespace of its own, where a test may make and break interfaces."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCENARIOS = Path(__file__).with_name("network_scenarios.py")
LONGEST_S = 60.0


@functools.cache
def hindrance() -> str:
    """Why there can be no namespace here; empty when there can."""
    for program in ("unshare", "ip"):
        if shutil.which(program) is None:
            return f"no program {program}"
    tried = subprocess.run(
        ["unshare", "-rn", "ip", "link", "set", "lo", "up"], capture_output=True, text=True
    )
    return "" if tried.returncode == 0 else f"unshare -rn: {tried.stderr.strip()}"


def run_in_namespace(scenario: str, *arguments: str) -> None:
    """Run one coroutine of `network_scenarios` as root of a new namespace.

    Raises:
        AssertionError: with all that it printed.
    """
    if hindrance():
        pytest.skip(hindrance())
    command = [
        "unshare",
        "-rn",
        sys.executable,
        "-W",
        "error",
        str(SCENARIOS),
        scenario,
        *arguments,
    ]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=LONGEST_S, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
