"""The same events make the same decisions; whatever is another one is found where it is."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest
from daemon_scenes import Stepped, configured, until, with_worker
from lab.recordings import world
from lab.replay.exact import Replayed, Replayer
from lab.replay.runs import Run, key_of, read_runs
from recorded_teams import SHORT, record_team

from drslamd import report
from drslamd.conventions import SECOND_US
from drslamd.daemon import Daemon
from drslamd.events import Restart, SerialData, Tick
from drslamd.io.recording.recorder import Recorder
from drslamd.recording.event_log import Entry, entries, packed


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Run]:
    """Eighteen seconds of two robots."""
    folder = tmp_path_factory.mktemp("recordings")
    record_team(folder, world.simulate(SHORT, 3), until_s=18.0)
    return read_runs([folder])


def replayed(run: Run) -> Replayed:
    return Replayer(run, key_of(run, None)).follow()


@pytest.fixture
def altered(runs: list[Run], tmp_path: Path) -> Callable[[Callable[[list[Entry]], None]], Run]:
    """The run of robot 0 after its entries were changed."""

    def alter(change: Callable[[list[Entry]], None]) -> Run:
        (path,) = runs[0].files
        with path.open("rb") as file:
            log = [entry for entry in entries(file) if isinstance(entry, Entry)]
        change(log)
        data = b"".join(packed(e.number, e.utime, e.channel.encode(), e.data) for e in log)
        (tmp_path / path.name).write_bytes(data)
        return read_runs([tmp_path])[0]

    return alter


def place(log: list[Entry], channel: str, after_s: float = 0.0) -> int:
    since = log[0].utime + after_s * 1e6
    return next(i for i, e in enumerate(log) if e.channel == channel and e.utime >= since)


@pytest.mark.slow
def test_every_robot_decides_as_it_did_and_knows_what_it_knew(tmp_path: Path) -> None:
    team = record_team(tmp_path, world.simulate(SHORT, 3))
    runs = read_runs([tmp_path])
    assert [run.robot for run in runs] == [0, 1]
    for run in runs:
        found, member = replayed(run), team.members[run.robot]
        assert (found.difference, found.ended, run.said) == (None, "", [])
        assert found.sends == len(member.traces.sent) > 50
        assert found.jobs == sum(map(len, member.traces.solve_ms.values()))
        assert found.robot.back.estimate is not None
        now = member.clock.local(team.now)
        assert report.status(found.robot, now) == report.status(member.robot, now)
        assert report.trajectories(found.robot, now) == report.trajectories(member.robot, now)


def test_a_message_that_was_another_one_is_named_with_its_time(
    altered: Callable[[Callable[[list[Entry]], None]], Run],
) -> None:
    at: list[float] = []

    def change(log: list[Entry]) -> None:
        i = place(log, "REC_SENT_000", 10.0) + 1
        log[i] = log[i]._replace(data=log[i].data[:-1] + bytes([log[i].data[-1] ^ 1]))
        at.append((log[i].utime - log[0].utime) / 1e6)

    difference = replayed(altered(change)).difference
    assert difference is not None
    assert difference.what.startswith("sends other ")
    assert difference.at_s == pytest.approx(at[0], abs=1e-6)


@pytest.mark.parametrize(
    ("channel", "what"),
    [
        ("REC_JOB_000", "the result of computation "),
        ("REC_TICK_000", "what was done since the last tick beside messages "),
    ],
)
def test_a_result_or_another_deed_that_was_another_one_is_named(
    altered: Callable[[Callable[[list[Entry]], None]], Run], channel: str, what: str
) -> None:
    def change(log: list[Entry]) -> None:
        i = place(log, channel, 15.0)
        log[i] = log[i]._replace(data=log[i].data[:-1] + bytes([log[i].data[-1] ^ 1]))

    difference = replayed(altered(change)).difference
    assert difference is not None
    assert difference.what.startswith(what)
    assert 15.0 <= difference.at_s < 17.0


def test_a_byte_of_a_sensor_that_was_another_one_is_seen_by_what_it_changes(
    altered: Callable[[Callable[[list[Entry]], None]], Run],
) -> None:
    def change(log: list[Entry]) -> None:
        for i in range(place(log, "REC_WHEELS_000", 10.0), len(log)):
            if log[i].channel == "REC_WHEELS_000" and log[i].utime < log[0].utime + 11e6:
                log[i] = log[i]._replace(data=b"")

    difference = replayed(altered(change)).difference
    assert difference is not None
    assert 10.0 <= difference.at_s < 15.0


@pytest.mark.parametrize("seed", range(3))
def test_a_run_that_was_cut_anywhere_is_the_same_up_to_there(
    runs: list[Run], tmp_path: Path, seed: int
) -> None:
    (path,) = runs[0].files
    whole = path.read_bytes()
    size = random.Random(seed).randrange(len(whole) // 4, len(whole) // 2)
    (tmp_path / path.name).write_bytes(whole[:size])
    (run,) = read_runs([tmp_path])
    found = replayed(run)
    assert found.difference is None
    assert found.seconds > 3
    assert all("the end is cut" in sentence for sentence in run.said)


def test_where_events_are_missing_it_ends_and_says_so(runs: list[Run], tmp_path: Path) -> None:
    (path,) = runs[0].files
    whole = path.read_bytes()
    half = len(whole) // 3
    (tmp_path / path.name).write_bytes(whole[:half] + whole[half + 1_000 :])
    (run,) = read_runs([tmp_path])
    found = replayed(run)
    assert found.difference is None
    assert found.ended == "events are missing here; what follows cannot be replayed"
    assert 3 < found.seconds < 12
    assert run.said[0].startswith(path.name)


def test_a_robot_that_took_the_place_of_another_is_followed(tmp_path: Path) -> None:
    """Through a real daemon without its ports: its robot begins again under another epoch."""
    clock = Stepped()
    daemon = Daemon(configured(tmp_path, "record = true\n"), clock)
    recorder = daemon._recorder
    assert isinstance(recorder, Recorder)

    def drive(seconds: int) -> None:
        for _ in range(seconds):
            clock.utime += SECOND_US
            daemon.handle(SerialData(clock.utime, "uwb", b"\x55\x04 no frame"))
            daemon.handle(Tick(clock.utime))

    async def scene() -> None:
        drive(5)
        old = daemon.robot
        daemon._perform(Restart(old.own.epoch + 5, "test"))
        await until(lambda: daemon.robot is not old)
        drive(5)

    with_worker(daemon, scene)
    recorder._flush()
    recorder._files.close()
    (run,) = read_runs([tmp_path / "state" / "recordings"])
    found = replayed(run)
    assert (found.difference, found.ended, run.said) == (None, "", [])
    assert found.robot.own == daemon.robot.own
    assert found.robot.own.epoch > run.opening.beginning.epoch
    assert report.status(found.robot, clock.utime) == report.status(daemon.robot, clock.utime)
