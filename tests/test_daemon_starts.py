"""Starts and restarts of a daemon: what is kept of them, and what when nothing can be kept."""

from __future__ import annotations

import json
import math
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from daemon_scenes import Stepped, configured, kept, until, with_worker

from drslamd.conventions import SECOND_US
from drslamd.daemon import Daemon
from drslamd.events import NetworkState, PortCondition, PortState, Restart, Save, SaveDone, Tick
from drslamd.io import state_store
from drslamd.sensors.samples import Motion
from drslamd.slam.calibration.sensor_calibration import UNLEARNED
from drslamd.slam.graph.estimate import Learned


@pytest.fixture
def clock() -> Stepped:
    return Stepped()


@pytest.fixture
def daemon(tmp_path: Path, clock: Stepped) -> Daemon:
    """One that was not started."""
    return Daemon(configured(tmp_path), clock)


def test_a_restart_takes_ports_network_and_knowledge_along(
    daemon: Daemon, clock: Stepped, tmp_path: Path
) -> None:
    states: list[PortState | NetworkState] = [
        PortState(clock.utime, "uwb", PortCondition.OPEN),
        PortState(clock.utime, "wheels", PortCondition.BUSY, "in use"),
        NetworkState(clock.utime, True, "lo"),
    ]
    old = daemon.robot
    above = old.own.epoch + 5 * SECOND_US
    learned = replace(UNLEARNED, scale=Learned(0.05, 0.01))

    async def scene() -> None:
        for state in states:
            daemon.handle(state)
        old.calibration.latest = learned
        old.team.seal.epochs[9] = 123
        daemon._perform(Restart(above, "test"))
        await until(lambda: daemon.robot is not old)

    with_worker(daemon, scene)
    new = daemon.robot
    assert new.own.robot == 1
    assert above < new.own.epoch <= above + 2 * SECOND_US
    assert new.ports == {"uwb": states[0], "wheels": states[1]}
    assert new.network == states[2]
    assert new.team.seal.epochs == {9: 123}
    assert new.calibration.latest == learned
    assert kept(tmp_path)["epochs"] == {"9": 123}


def test_a_calibration_is_known_from_the_first_start_on_and_narrows_the_prior(
    tmp_path: Path, clock: Stepped
) -> None:
    plain = Daemon(configured(tmp_path), clock).robot.front.model
    (tmp_path / "1.cal").write_text(
        "robot.id = 1\npush = {scale = 0.02, sigma = 0.006}\n[wheels]\nsource = 'kobuki'\n"
        "track_m = 0.23\ncounts_per_metre = 11724.4\nreverse_left = false\n"
        "reverse_right = false\n[bias.4]\nbias_m = 0.1\nsigma_m = 0.08\n"
    )
    config = configured(tmp_path)
    named = config.robot.model_copy(update={"calibration": str(tmp_path / "1.cal")})
    robot = Daemon(config.model_copy(update={"robot": named}), clock).robot
    motion = robot.calibration.used.corrected(Motion(1, 1.0, 0.5))
    assert motion.distance_m == pytest.approx(0.98)
    assert motion.turn_rad == pytest.approx(0.49)
    # what changes between two starts is still allowed for
    assert plain.noise.scale == 0.10
    assert robot.front.model.noise.scale == pytest.approx(math.hypot(0.006, 0.03))
    assert robot.calibration.used.bias_sigma(4, 0.3) == pytest.approx(math.hypot(0.08, 0.15))


def test_an_epoch_is_on_disk_before_anything_is_sent_under_it(tmp_path: Path) -> None:
    epochs = []
    for _ in range(3):
        daemon = Daemon(configured(tmp_path))
        assert kept(tmp_path)["epoch"] == daemon.robot.own.epoch
        epochs.append(daemon.robot.own.epoch)
    assert epochs == sorted(set(epochs))


def test_the_epoch_of_a_restart_is_on_disk_too_and_the_old_robot_overwrites_it_with_nothing(
    daemon: Daemon, tmp_path: Path
) -> None:
    old, may_end = daemon.robot, threading.Event()

    async def scene() -> None:
        daemon._disk.submit(lambda: may_end.wait(10), lambda finished: None)
        daemon._perform(Restart(old.own.epoch, "test"))
        daemon._perform(Save(old.memory.state()))
        assert daemon.robot is old  # the worker has not come to it
        may_end.set()
        await until(lambda: daemon.robot is not old)
        assert kept(tmp_path)["epoch"] == daemon.robot.own.epoch > old.own.epoch

    with_worker(daemon, scene)
    assert kept(tmp_path)["epoch"] == daemon.robot.own.epoch


def test_restarts_follow_each_other_after_30_seconds_and_then_ever_more_slowly(
    daemon: Daemon, clock: Stepped
) -> None:
    done: list[int] = []

    async def scene() -> None:
        began = clock.utime
        for _ in range(250):
            old = daemon.robot
            daemon._perform(Restart(old.own.epoch, "test"))
            if daemon._ends is old:
                await until(lambda old=old: daemon.robot is not old)  # type: ignore[misc]
                done.append((clock.utime - began) // SECOND_US)
            clock.utime += SECOND_US

    with_worker(daemon, scene)
    assert done == [0, 30, 90, 210]


@pytest.mark.parametrize("content", ["[" * 100_000, "9" * 5_000, "NaN", '{"schema": 1, "epoch": 1'])
def test_whatever_stands_in_the_state_file_the_daemon_starts_and_writes_a_good_one(
    tmp_path: Path, content: str
) -> None:
    path = tmp_path / "state" / "robot-1.json"
    path.parent.mkdir()
    path.write_text(content)
    daemon = Daemon(configured(tmp_path))
    assert str(path) in daemon._load_fault
    assert kept(tmp_path)["epoch"] == daemon.robot.own.epoch


# nothing can be kept


@pytest.fixture
def read_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A state file that can be read and not replaced, from a clock that ran ahead."""
    path = tmp_path / "state" / "robot-1.json"
    path.parent.mkdir()
    path.write_text(json.dumps({"schema": 1, "epoch": 5 * 10**15}))
    path.with_suffix(".new").mkdir()
    return path


def test_starts_whose_epochs_cannot_be_kept_do_not_repeat_them(
    tmp_path: Path, read_only: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    epochs = []
    for uptime in (100, 101, 105, 1_000):
        monkeypatch.setattr(state_store, "uptime_s", lambda uptime=uptime: uptime)
        epochs.append(Daemon(configured(tmp_path)).robot.own.epoch)
    assert epochs == sorted(set(epochs))
    assert epochs[0] > 5 * 10**15
    assert json.loads(read_only.read_text())["epoch"] == 5 * 10**15


def test_where_the_clock_runs_it_keeps_starts_in_order_that_cannot_be_kept(
    tmp_path: Path, read_only: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Later, on a disk that works again, nothing has run ahead."""
    for wall_s in (5_000_000_001, 5_000_000_009):
        monkeypatch.setattr(state_store, "wall_s", lambda wall_s=wall_s: wall_s)
        assert Daemon(configured(tmp_path)).robot.own.epoch // 10**6 == wall_s


def test_starts_after_each_power_up_of_a_computer_without_clock_and_disk_differ(
    tmp_path: Path, read_only: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock comes up the same, the disk says the same, the uptime is the same."""
    monkeypatch.setattr(state_store, "uptime_s", lambda: 20)
    monkeypatch.setattr(state_store, "wall_s", lambda: 1_700_000_000)
    epochs = {Daemon(configured(tmp_path)).robot.own.epoch for _ in range(10)}
    assert len(epochs) == 10


def woken(daemon: Daemon, clock: Stepped) -> None:
    """It is woken as often as its robot wants to be at this moment."""
    while daemon.robot.next_tick <= clock.utime:
        daemon.handle(Tick(clock.utime))


def test_that_nothing_can_be_kept_is_said_until_it_can(
    tmp_path: Path, read_only: Path, clock: Stepped
) -> None:
    daemon = Daemon(configured(tmp_path), clock)

    async def scene() -> None:
        daemon.handle(SaveDone(clock.utime, daemon._store.fault))
        woken(daemon, clock)
        (sentence,) = (p for p in daemon._picture()["problems"] if str(read_only) in p)
        assert "cannot write" in sentence
        assert "name another in daemon.state_dir" in sentence
        read_only.with_suffix(".new").rmdir()
        daemon._perform(Save(daemon.robot.memory.state()))
        await until(lambda: not daemon.robot.memory.fault)
        clock.utime += 2 * SECOND_US
        woken(daemon, clock)
        assert not [p for p in daemon._picture()["problems"] if str(read_only) in p]

    with_worker(daemon, scene)
    assert kept(tmp_path)["epoch"] == daemon.robot.own.epoch
