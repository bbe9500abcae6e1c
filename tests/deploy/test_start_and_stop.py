"""The shipped example as a process: it comes up without hardware, says so, and goes in time."""

from __future__ import annotations

import itertools
import re
import signal
import time
from pathlib import Path

import pytest
from deploy_helpers import LONGEST_STOP_S, ORDINARY, UWB, WHEELS, Daemon, example_in

from drslamd.cli.exit_codes import BUG, OK

pytestmark = pytest.mark.slow

LONGEST_START_S = 3.0


def stopped(daemon: Daemon, *signals: signal.Signals, pause: float = 0.0) -> int:
    """The exit code after these signals; the daemon must be gone in time."""
    began = time.monotonic()
    for number in signals:
        daemon.signal(number)
        time.sleep(pause)
    code = daemon.wait(5)
    assert time.monotonic() - began - pause * len(signals) <= LONGEST_STOP_S
    return code


def test_the_example_comes_up_and_says_what_is_missing(tmp_path: Path) -> None:
    began = time.monotonic()
    with Daemon(example_in(tmp_path), WATCHDOG_USEC="600000") as daemon:
        daemon.manager.wait_for("READY=1")
        assert time.monotonic() - began < LONGEST_START_S
        answer = daemon.ask()
        assert f"missing: {UWB}: No such file or directory" in answer
        assert f"missing: {WHEELS}: No such file or directory" in answer
        assert "INSECURE" in answer
        status = daemon.manager.wait_for("STATUS=")
        assert "not localised" in status
        assert UWB in status
        assert WHEELS in status
        assert stopped(daemon, signal.SIGTERM) == OK
    assert "Traceback" not in daemon.log


def test_the_log_of_a_start_names_everything_once(tmp_path: Path) -> None:
    with Daemon(example_in(tmp_path)) as daemon:
        daemon.manager.wait_for("READY=1")
        time.sleep(2.5)  # ports are tried again and again
        assert stopped(daemon, signal.SIGTERM) == OK
    for event in ("daemon.start", "team.insecure", "uwb.port", "wheels.port", "daemon.stop"):
        assert len(re.findall(rf"event={event}\b", daemon.log)) == 1, event


def test_signs_of_life_keep_coming(tmp_path: Path) -> None:
    with Daemon(example_in(tmp_path), WATCHDOG_USEC="600000") as daemon:
        daemon.manager.wait_for("READY=1")
        daemon.manager.listen(4.0)
    times = daemon.manager.times("WATCHDOG=1")
    assert len(times) > 10
    assert max(b - a for a, b in itertools.pairwise(times)) < 0.6


def test_a_watchdog_that_is_meant_for_another_process_gets_nothing_special(tmp_path: Path) -> None:
    with Daemon(example_in(tmp_path), WATCHDOG_USEC="600000", WATCHDOG_PID="1") as daemon:
        daemon.manager.wait_for("READY=1")
        daemon.manager.listen(1.0)
    assert not daemon.manager.times("WATCHDOG=1")


@pytest.mark.row("O4")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_it_in_order(tmp_path: Path, number: signal.Signals) -> None:
    with Daemon(example_in(tmp_path)) as daemon:
        daemon.manager.wait_for("READY=1")
        assert stopped(daemon, number) == OK
        daemon.manager.wait_for("STOPPING=1", 0.1)
    assert not (tmp_path / "socket").exists()
    assert "Traceback" not in daemon.log


@pytest.mark.parametrize("pause", [0.0, 0.001, 0.02, 0.06])
@pytest.mark.parametrize("second", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.row("O4")
def test_a_second_signal_changes_nothing(
    tmp_path: Path, pause: float, second: signal.Signals
) -> None:
    with Daemon(example_in(tmp_path)) as daemon:
        daemon.manager.wait_for("READY=1")
        assert stopped(daemon, signal.SIGTERM, second, pause=pause) == OK
    assert "Traceback" not in daemon.log


@pytest.mark.row("O4")
def test_a_stop_while_it_starts_is_a_stop(tmp_path: Path) -> None:
    """Before Python runs our first line the signal itself ends the process; that is as good."""
    for step in range(16):
        folder = tmp_path / str(step)
        folder.mkdir()
        with Daemon(example_in(folder)) as daemon:
            time.sleep(0.05 * step)
            assert stopped(daemon, signal.SIGTERM) in (OK, -signal.SIGTERM)
        assert "Traceback" not in daemon.log


@pytest.mark.row("O4")
def test_a_solver_that_does_not_end_does_not_hold_it_up(tmp_path: Path) -> None:
    with Daemon(example_in(tmp_path), fault="stuck_solver") as daemon:
        daemon.manager.wait_for("READY=1")
        time.sleep(0.6)
        assert stopped(daemon, signal.SIGTERM) == OK


@pytest.mark.row("O6")
def test_a_hang_starves_the_watchdog_and_shows_where_it_was(tmp_path: Path) -> None:
    """systemd ends a hang with SIGABRT; the service file sets PYTHONFAULTHANDLER for that."""
    config = example_in(tmp_path)
    with Daemon(
        config, fault="hung_loop", WATCHDOG_USEC="300000", PYTHONFAULTHANDLER="1"
    ) as daemon:
        daemon.manager.wait_for("WATCHDOG=1")
        daemon.manager.listen(0.5)
        before = len(daemon.manager.heard)
        daemon.manager.listen(1.0)
        assert len(daemon.manager.heard) == before
        daemon.signal(signal.SIGABRT)
        assert daemon.wait() == -signal.SIGABRT
    assert "in hung_loop" in daemon.log


def test_a_bug_of_ours_ends_with_70_and_its_traceback(tmp_path: Path) -> None:
    with Daemon(example_in(tmp_path), fault="own_bug") as daemon:
        daemon.manager.wait_for("READY=1")
        assert daemon.wait(5) == BUG
    assert "Traceback" in daemon.log
    assert "own_bug" in daemon.log


@pytest.mark.row("S6")
@pytest.mark.row("O5")
def test_epochs_grow_over_restarts_and_survive_kill_9(tmp_path: Path) -> None:
    config, epochs = example_in(tmp_path), []
    for number in (signal.SIGTERM, signal.SIGKILL, signal.SIGKILL, signal.SIGTERM):
        with Daemon(config) as daemon:
            daemon.manager.wait_for("READY=1")
            daemon.signal(number)
            daemon.wait()
            epochs.append(daemon.state()["epoch"])
    assert epochs == sorted(set(epochs))
    assert [path.name for path in (tmp_path / "state").iterdir()] == ["robot-1.json"]


def test_an_epoch_from_a_clock_that_ran_ahead_is_not_reused(tmp_path: Path) -> None:
    config = example_in(tmp_path)
    (tmp_path / "state").mkdir()
    ahead = 5 * 10**15
    (tmp_path / "state" / "robot-1.json").write_text(f'{{"schema": 1, "epoch": {ahead}}}')
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        assert ahead < daemon.state()["epoch"] <= ahead + 2 * 10**6


@pytest.mark.parametrize(
    "content",
    [
        "",
        '{"schema": 1, "epo',
        "[]",
        '{"schema": 99, "epoch": 7}',
        '{"schema": 1, "epoch": "seven"}',
        '{"schema": 1, "epoch": 9223372036854775807}',
        '{"schema": 1, "epoch": 9223372036854775808}',
        '{"schema": 1, "epoch": 7, "epochs": {"2": 9223372036854775807}}',
        "[" * 100_000,
        '{"schema": 1, "epoch": 7, "epochs": {"two": 3}}',
        '{"schema": 1, "epoch": 7, "epochs": [3]}',
        '{"schema": 1, "epoch": 7, "calibration": 3}',
        '{"schema": 1, "epoch": 7, "calibration": {"scale": [NaN, 0.01]}}',
        '{"schema": 1, "epoch": 7, "calibration": {"scale": [1.6, 0.01]}}',
        '{"schema": 1, "epoch": 7, "calibration": {"turn": [1.6, 0.01]}}',
        '{"schema": 1, "epoch": 7, "calibration": {"antenna_x_m": [2.1, 0.01]}}',
        '{"schema": 1, "epoch": 7, "calibration": {"antenna_y_m": 0.3}}',
        '{"schema": 1, "epoch": 7, "calibration": {"bias_m": {"2": [0.1]}}}',
        '{"schema": 1, "epoch": 7, "calibration": {"bias_m": {"300": [0.1, 0.1]}}}',
    ],
)
@pytest.mark.row("O13")
def test_a_damaged_or_foreign_state_file_is_named_and_replaced(
    tmp_path: Path, content: str
) -> None:
    config = example_in(tmp_path)
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / "robot-1.json").write_text(content)
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        assert daemon.state()["epoch"] > 0
    assert "event=state.fault" in daemon.log
    assert str(tmp_path / "state" / "robot-1.json") in daemon.log


def test_a_state_folder_that_cannot_be_made_is_a_warning(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    config = example_in(tmp_path, (f"{tmp_path}/state", f"{tmp_path}/file/state"))
    check_it_runs_without_state(config, f"{tmp_path}/file/state")


@pytest.mark.row("S7")
@pytest.mark.skipif(not ORDINARY, reason="root may write anywhere")
def test_a_state_folder_that_is_read_only_is_a_warning(tmp_path: Path) -> None:
    folder = tmp_path / "state"
    folder.mkdir(mode=0o555)
    check_it_runs_without_state(example_in(tmp_path), f"{folder}")


def check_it_runs_without_state(config: Path, folder: str) -> None:
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        assert "robot 1" in daemon.ask()
        assert stopped(daemon, signal.SIGTERM) == OK
    warnings = [line for line in daemon.log.splitlines() if "event=state.fault" in line]
    assert 1 <= len(warnings) <= 2  # it can be neither read nor written
    for line in warnings:
        assert "level=warning" in line
        assert folder in line


def test_a_status_socket_that_cannot_be_made_is_a_warning(tmp_path: Path) -> None:
    config = example_in(tmp_path, (f"{tmp_path}/socket", f"{tmp_path}/robot.toml/socket"))
    with Daemon(config) as daemon:
        daemon.manager.wait_for("READY=1")
        assert stopped(daemon, signal.SIGTERM) == OK
    assert "event=status.fault" in daemon.log


def test_a_socket_left_over_by_a_crash_is_no_obstacle(tmp_path: Path) -> None:
    config = example_in(tmp_path)
    for number in (signal.SIGKILL, signal.SIGTERM):
        with Daemon(config) as daemon:
            daemon.manager.wait_for("READY=1")
            assert "robot 1" in daemon.ask()
            daemon.signal(number)
            daemon.wait()
