"""The wiring of one process: clock, computations, faults. Nothing here is started."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

import pytest
from daemon_scenes import Stepped, configured, heard_by, until, with_worker

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.daemon import Daemon
from drslamd.events import Event, JobDone, Restart, Send, Solve, Tick, Write
from drslamd.io.clock import MonotonicClock


@pytest.fixture
def clock() -> Stepped:
    return Stepped()


@pytest.fixture
def daemon(tmp_path: Path, clock: Stepped) -> Daemon:
    """One that was not started."""
    return Daemon(configured(tmp_path), clock)


# the clock


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


# computations and restarts


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


# what goes wrong inside


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
