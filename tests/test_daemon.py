"""The wiring of one process: clock, computations, faults. Nothing here is started."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from daemon_scenes import Stepped, configured, heard_by, until, with_worker
from robot_scenes import ticked

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.daemon import Daemon
from drslamd.events import Effect, Event, JobDone, Restart, Send, SerialData, Solve, Tick, Write
from drslamd.io.clock import MonotonicClock
from drslamd.io.recording.log_files import recordings
from drslamd.recording.decoder import Decoder
from drslamd.recording.event_log import Entry, entries
from drslamd.recording.records import Beginning, Sent


@pytest.fixture
def clock() -> Stepped:
    return Stepped()


@pytest.fixture
def daemon(tmp_path: Path, clock: Stepped) -> Daemon:
    """One that was not started."""
    return Daemon(configured(tmp_path), clock)


# the clock


@pytest.mark.row("T1")
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
@pytest.mark.row("T3")
def test_how_late_the_loop_was_is_in_the_status(
    daemon: Daemon, clock: Stepped, late_ms: int
) -> None:
    async def one_tick() -> None:
        ticked(daemon.robot, clock.utime)
        daemon.robot.timers.next = clock.utime + 10 * MILLISECOND_US
        daemon._wake()
        clock.utime += (10 + late_ms) * MILLISECOND_US
        await until(lambda: daemon.robot.next_tick > clock.utime)

    with_worker(daemon, one_tick)
    assert daemon._picture()["loop_lag_ms"] == {"median": late_ms, "p99": late_ms}


def test_what_was_due_before_anybody_was_asked_for_it_is_not_late(
    daemon: Daemon, clock: Stepped
) -> None:
    """It waited behind a pause for what came before it."""

    async def one_tick() -> None:
        ticked(daemon.robot, clock.utime)
        clock.utime += 20 * MILLISECOND_US
        daemon.robot.timers.next = clock.utime - 20 * MILLISECOND_US
        daemon._wake()
        await until(lambda: bool(daemon._pace.lags))

    with_worker(daemon, one_tick)
    assert set(daemon._pace.lags) == {0.0}


# computations and restarts


def test_a_result_comes_back_as_an_event_with_its_times(daemon: Daemon, clock: Stepped) -> None:
    heard = heard_by(daemon)

    def run() -> str:
        time.sleep(0.02)
        clock.utime += 30 * MILLISECOND_US
        return "answer"

    async def scene() -> None:
        daemon._perform(Solve(7, "optimizer", run))
        assert daemon._worker.waiting == 1
        await until(lambda: not daemon._worker.waiting)

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
        await until(lambda: not daemon._worker.waiting)

    with_worker(daemon, scene)
    assert heard == heard_by_old == []
    assert daemon._picture()["ms"] == {}


# what is recorded


def recording(daemon: Daemon) -> list[Any]:
    """What was written so far."""
    recorder: Any = daemon._recorder
    recorder._flush()
    decoder, found = Decoder(), []
    for path in recordings(recorder._files.folder):
        for entry in entries(io.BytesIO(path.read_bytes())):
            assert isinstance(entry, Entry)
            found.append(decoder.decode(entry))
    return [record for record in found if record is not None]


@pytest.fixture
def recorded(tmp_path: Path, clock: Stepped) -> Iterator[Daemon]:
    """One that records, and was not started."""
    daemon = Daemon(configured(tmp_path, "record = true\n"), clock)
    yield daemon
    daemon._recorder._files.close()  # type: ignore[union-attr]


def test_an_event_is_recorded_before_it_is_answered_and_its_answer_before_it_is_done(
    recorded: Daemon, clock: Stepped, monkeypatch: pytest.MonkeyPatch
) -> None:
    event, send = SerialData(clock.utime, "uwb", b"x"), Send("DRSLAM_STATUS_001", b"y")

    def answer(_: Event) -> list[Effect]:
        assert recording(recorded)[-1] == event
        return [send]

    def carry_out(_: Effect) -> None:
        assert recording(recorded)[-1] == Sent(clock.utime, send)
        raise ZeroDivisionError

    monkeypatch.setattr(recorded.robot, "handle", answer)
    monkeypatch.setattr(recorded, "_perform", carry_out)
    with pytest.raises(ZeroDivisionError):
        recorded.handle(event)


def test_the_recording_opens_with_what_the_robot_began_with(recorded: Daemon) -> None:
    opening = recording(recorded)[0]
    assert opening.beginning == Beginning(recorded.robot.own.epoch, {}, {"bias_m": {}})
    assert opening.provenance["configuration"]["daemon"]["record"] is True


def test_a_robot_in_the_place_of_another_is_recorded_with_what_it_begins_with(
    recorded: Daemon,
) -> None:
    old = recorded.robot
    old.team.seal.epochs[2] = 77

    async def scene() -> None:
        recorded._perform(Restart(old.own.epoch + 5, "test"))
        await until(lambda: recorded.robot is not old)

    with_worker(recorded, scene)
    found = [record for record in recording(recorded) if isinstance(record, Beginning)]
    assert found == [Beginning(recorded.robot.own.epoch, {2: 77}, {"bias_m": {}})]


def test_what_is_wrong_with_the_recording_is_one_of_the_problems(
    tmp_path: Path, clock: Stepped
) -> None:
    (tmp_path / "file").touch()
    more = f'record = true\nrecord_dir = "{tmp_path}/file"\n'
    daemon = Daemon(configured(tmp_path, more), clock)
    daemon._recorder._flush()  # type: ignore[union-attr]
    assert daemon._picture()["problems"][-1].startswith("nothing is recorded: cannot write")
    assert "; nothing is recorded: " in daemon._one_line()


def test_nothing_is_recorded_unless_it_is_asked_for(tmp_path: Path, daemon: Daemon) -> None:
    assert daemon._picture()["recording"] is None
    assert not (tmp_path / "state" / "recordings").exists()


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
    assert daemon._one_line() == "INSECURE, not localised, 0 peers"
    daemon.robot.health.set("uwb", "no bytes", 0)
    daemon.robot.health.set("wheels", "no motion", 0)
    assert daemon._one_line() == "INSECURE, not localised, 0 peers; no bytes; no motion"
