"""The wiring of one process: clock, restarts, computations. Nothing here is started."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drslamd.config import Config, ConfigError, parse
from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.daemon import Daemon
from drslamd.events import (
    Effect,
    Event,
    JobDone,
    NetworkState,
    PortCondition,
    PortState,
    Restart,
    Save,
    SaveDone,
    Send,
    Solve,
    Tick,
    Write,
)
from drslamd.io import state_store
from drslamd.io.clock import MonotonicClock
from drslamd.slam.calibration.sensor_calibration import UNLEARNED
from drslamd.slam.graph.estimate import Learned

CONFIG = """
[robot]
id = 1
[team]
insecure = true
[uwb]
port = "/dev/none"
[wheels]
source = "kobuki"
port = "/dev/none"
[daemon]
log_level = "error"
"""
DBC_WHEELS = """
source = "dbc"
dbc_file = "DBC"
measures = "wheel_speeds"
left = "A.B"
right = "A.C"
track_m = 0.5
"""


class Stepped:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.utime = 1_000_000_000

    def now(self) -> int:
        return self.utime


def configured(tmp_path: Path, more: str = "") -> Config:
    return parse(f'{CONFIG}state_dir = "{tmp_path / "state"}"\n{more}')


@pytest.fixture
def clock() -> Stepped:
    return Stepped()


@pytest.fixture
def daemon(tmp_path: Path, clock: Stepped) -> Daemon:
    """One that was not started."""
    return Daemon(configured(tmp_path), clock)


def heard_by(daemon: Daemon) -> list[Event]:
    """What the robot that the daemon has now is told from now on; it answers nothing."""
    heard: list[Event] = []

    def handle(event: Event) -> list[Effect]:
        heard.append(event)
        return []

    daemon.robot.handle = handle  # type: ignore[method-assign]
    return heard


def with_worker(daemon: Daemon, scene: Callable[[], Awaitable[None]]) -> None:
    """Play a scene in a loop, with the thread for computations and without the ports."""

    async def run() -> None:
        daemon._worker.start()
        try:
            await asyncio.wait_for(scene(), 10)
        finally:
            daemon._worker.stop()
            if daemon._timer is not None:
                daemon._timer.cancel()

    asyncio.run(run())


async def until(what: Callable[[], object]) -> None:
    while not what():
        await asyncio.sleep(0.002)


# ---- the clock ---------------------------------------------------------------------------------


def test_the_clock_of_a_daemon_is_one_that_nobody_can_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    daemon = Daemon(configured(tmp_path))
    assert isinstance(daemon._clock, MonotonicClock)
    before = time.monotonic_ns() // 1_000
    monkeypatch.setattr(time, "time_ns", lambda: 4 * 10**18)
    assert 0 <= daemon._clock.now() - before < 60 * SECOND_US


def test_ports_network_and_timers_have_one_clock(daemon: Daemon, clock: Stepped) -> None:
    parts: list[Any] = [daemon, daemon._uwb, daemon._wheels, daemon._transport]
    assert all(part._clock is clock for part in parts)


def test_a_tick_carries_the_time_of_the_clock(daemon: Daemon, clock: Stepped) -> None:
    heard = heard_by(daemon)

    async def scene() -> None:
        clock.utime += 7
        daemon._tick()

    with_worker(daemon, scene)
    assert heard[0] == Tick(1_000_000_007)


def test_it_is_woken_when_the_robot_asks_and_asked_again_only_for_another_time(
    daemon: Daemon, clock: Stepped
) -> None:
    async def scene() -> None:
        daemon.robot.timers.next = clock.utime + 50 * MILLISECOND_US
        daemon._wake()
        first = daemon._timer
        daemon._wake()
        assert daemon._timer is first
        daemon.robot.timers.next += 1
        daemon._wake()
        assert daemon._timer is not first
        assert first is not None
        assert first.cancelled()

    with_worker(daemon, scene)


@pytest.mark.parametrize("late_ms", [0, 25])
def test_how_late_the_loop_was_is_in_the_status(
    daemon: Daemon, clock: Stepped, late_ms: int
) -> None:
    async def one_tick() -> None:
        daemon.robot.timers.next = clock.utime + 10 * MILLISECOND_US
        daemon._wake()
        clock.utime += (10 + late_ms) * MILLISECOND_US
        await until(lambda: daemon.robot.next_tick > clock.utime)

    with_worker(daemon, one_tick)
    assert daemon._picture()["loop_lag_ms"] == {"median": late_ms, "p99": late_ms}


# ---- computations and restarts -----------------------------------------------------------------


def test_a_result_comes_back_as_an_event_with_its_times(daemon: Daemon, clock: Stepped) -> None:
    heard = heard_by(daemon)

    def run() -> str:
        time.sleep(0.02)
        clock.utime += 30 * MILLISECOND_US
        return "answer"

    async def scene() -> None:
        daemon._perform(Solve(7, "optimizer", run))
        assert daemon._jobs_waiting == 1
        await until(lambda: not daemon._jobs_waiting)

    with_worker(daemon, scene)
    (event,) = (event for event in heard if isinstance(event, JobDone))
    assert (event.utime, event.job_id, event.result) == (1_000_030_000, 7, "answer")
    assert 20_000 <= event.elapsed_us < 5 * SECOND_US
    assert len(daemon._picture()["ms"]["optimizer"]["all"]) == 1


def test_what_an_old_robot_had_asked_for_is_not_told_to_the_new_one(daemon: Daemon) -> None:
    old, heard_by_old, may_end = daemon.robot, heard_by(daemon), threading.Event()
    heard: list[Event] = []

    async def scene() -> None:
        daemon._perform(Restart(old.own.epoch + 5, "test"))
        daemon._perform(Solve(7, "optimizer", lambda: may_end.wait(10)))
        await until(lambda: daemon.robot is not old)
        heard.extend(heard_by(daemon))
        may_end.set()
        await until(lambda: not daemon._jobs_waiting)

    with_worker(daemon, scene)
    assert heard == heard_by_old == []
    assert daemon._picture()["ms"] == {}


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


def kept(tmp_path: Path) -> dict[str, Any]:
    state: dict[str, Any] = json.loads((tmp_path / "state" / "robot-1.json").read_text())
    return state


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
        daemon._worker.submit(lambda: may_end.wait(10), lambda finished: None)
        daemon._perform(Restart(old.own.epoch, "test"))
        daemon._perform(Save(old.state()))
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


# ---- nothing can be kept -----------------------------------------------------------------------


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


def test_that_nothing_can_be_kept_is_said_until_it_can(
    tmp_path: Path, read_only: Path, clock: Stepped
) -> None:
    daemon = Daemon(configured(tmp_path), clock)

    async def scene() -> None:
        daemon.handle(SaveDone(clock.utime, daemon._store.fault))
        daemon.handle(Tick(clock.utime))
        (sentence,) = (p for p in daemon._picture()["problems"] if str(read_only) in p)
        assert "cannot write" in sentence
        assert "name another in daemon.state_dir" in sentence
        read_only.with_suffix(".new").rmdir()
        daemon._perform(Save(daemon.robot.state()))
        await until(lambda: not daemon.robot.save_fault)
        clock.utime += 2 * SECOND_US
        daemon.handle(Tick(clock.utime))
        assert not [p for p in daemon._picture()["problems"] if str(read_only) in p]

    with_worker(daemon, scene)
    assert kept(tmp_path)["epoch"] == daemon.robot.own.epoch


# ---- what goes wrong inside --------------------------------------------------------------------


def test_a_fault_of_ours_ends_it_and_no_event_is_handled_after_it(daemon: Daemon) -> None:
    heard, bug = heard_by(daemon), ZeroDivisionError()
    daemon._fail(bug)
    daemon._fail(RuntimeError("a later one"))
    daemon.handle(Tick(1))
    assert heard == []
    assert daemon._stop.is_set()
    assert daemon._failure is bug


@pytest.mark.parametrize("port", ["uwb", "wheels"])
def test_only_wheels_on_a_serial_line_are_ever_written_to(daemon: Daemon, port: Any) -> None:
    if port == "wheels":
        daemon._perform(Write(port, b"?C\r"))  # not open: dropped
        return
    with pytest.raises(AssertionError, match="nothing may be written to uwb"):
        daemon._perform(Write(port, b"x"))


def test_what_the_network_did_not_take_is_in_the_status(daemon: Daemon) -> None:
    assert daemon._picture()["network"]["dropped"] == 0
    for _ in range(3):
        daemon._perform(Send("DRSLAM_STATUS_001", b""))
    assert daemon._picture()["network"]["dropped"] == 3


def test_the_line_for_systemd_says_where_it_stands_and_what_is_wrong(daemon: Daemon) -> None:
    assert daemon._one_line() == "not localised, 0 peers"
    daemon.robot.health.set("uwb", "no bytes", 0)
    daemon.robot.health.set("wheels", "no motion", 0)
    assert daemon._one_line() == "not localised, 0 peers; no bytes; no motion"


@pytest.mark.parametrize(
    ("content", "sentence"), [(None, "No such file or directory"), (b"\xff\xfe", "not a text file")]
)
def test_a_dbc_file_that_cannot_be_read_is_one_sentence(
    tmp_path: Path, content: bytes | None, sentence: str
) -> None:
    path = tmp_path / "base.dbc"
    if content is not None:
        path.write_bytes(content)
    before, _, rest = CONFIG.partition('source = "kobuki"\nport = "/dev/none"\n')
    text = before + DBC_WHEELS.replace("DBC", str(path)) + rest
    with pytest.raises(ConfigError) as caught:
        Daemon(parse(f'{text}state_dir = "{tmp_path}"\n'))
    assert caught.value.faults == [f"wheels.dbc_file = '{path}': {sentence}"]
