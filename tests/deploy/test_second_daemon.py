"""Two daemons with one configuration: the second leaves the first alone, and outlives it."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import pytest
from deploy_helpers import Daemon, example_in, refused

from drslamd.cli.exit_codes import ALREADY_RUNS

pytestmark = pytest.mark.slow


def test_the_second_is_told_who_runs_and_the_first_still_answers(tmp_path: Path) -> None:
    config = example_in(tmp_path)
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        epoch = json.loads(daemon.ask("--json"))["epoch"]
        code, said, _ = refused(config)
        assert code == ALREADY_RUNS == 75
        assert said.startswith(f"{config}: a daemon already runs as robot 1 here (process ")
        assert said.count("\n") == 1
        assert json.loads(daemon.ask("--json"))["epoch"] == daemon.state()["epoch"] == epoch


def test_what_was_killed_is_taken_over(tmp_path: Path) -> None:
    config = example_in(tmp_path)
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        first = json.loads(daemon.ask("--json"))["epoch"]
        daemon.signal(signal.SIGKILL)
        daemon.wait()
        assert (tmp_path / "socket").exists()
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        assert json.loads(daemon.ask("--json"))["epoch"] > first


def test_one_that_hangs_lives(tmp_path: Path) -> None:
    config = example_in(tmp_path)
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        daemon.signal(signal.SIGSTOP)
        code, said, _ = refused(config)
        daemon.signal(signal.SIGCONT)
    assert code == ALREADY_RUNS, said
