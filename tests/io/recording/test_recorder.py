"""The writer: nothing is lost unsaid, nothing waits for the disk, files are whole."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from drslamd.events import Effect, Send, SerialData, Stop, Tick
from drslamd.io.recording import recorder as module
from drslamd.io.recording.log_files import LogFiles, recordings
from drslamd.io.recording.recorder import CLOCK_EVERY_US, NoRecorder, Recorder
from drslamd.recording.decoder import Decoder
from drslamd.recording.encoder import Encoder
from drslamd.recording.event_log import Entry, entries
from drslamd.recording.records import Beginning, Marked, Opening, Record, Sent, Told

BEGINNING = Beginning(1_795_745_745_123_456)
STATUS = Send("DRSLAM_STATUS_003", b"status")


@pytest.fixture
def files(tmp_path: Path) -> LogFiles:
    return LogFiles(tmp_path, 3, 16 << 20)


def made(files: LogFiles) -> Recorder:
    return Recorder(files, Encoder(3, True), {"host": "h"}, lambda: {"wall_us": 4})


def recorded(files: LogFiles, scene: Callable[[Recorder], None]) -> Recorder:
    """A recorder that lives for one scene."""

    async def run() -> Recorder:
        recorder = made(files)
        recorder.begin(1, BEGINNING)
        recorder.start()
        scene(recorder)
        await recorder.close()
        return recorder

    return asyncio.run(run())


def read(path: Path) -> list[Record]:
    decoder, found = Decoder(), []
    with path.open("rb") as file:
        for entry in entries(file):
            assert isinstance(entry, Entry)
            record = decoder.decode(entry)
            if record is not None:
                found.append(record)
    return found  # type: ignore[return-value]


def answered(recorder: Recorder, utime: int, effects: list[Effect]) -> None:
    recorder.event(SerialData(utime, "uwb", b"%d" % utime))
    recorder.effects(utime, effects)


def test_a_file_opens_with_its_origin_and_closes_with_the_last_event(files: LogFiles) -> None:
    def scene(recorder: Recorder) -> None:
        answered(recorder, 5, [STATUS])
        recorder.event(Stop(9))

    recorder = recorded(files, scene)
    (path,) = recordings(files.folder)
    opening, clock, *rest = read(path)
    assert opening == Opening(1, BEGINNING, 0, {"host": "h", "clocks": {"wall_us": 4}})
    assert clock == Told(5, "clock", {"wall_us": 4})
    assert rest == [SerialData(5, "uwb", b"5"), Sent(5, STATUS), Stop(9)]
    assert recorder.status() == {
        "folder": str(files.folder),
        "file": path.name,
        "bytes": path.stat().st_size,
        "events_lost": 0,
        "fault": "",
    }
    assert recorder.problems() == []


def test_another_robot_in_its_place_goes_on_in_the_same_file(files: LogFiles) -> None:
    second = Beginning(BEGINNING.epoch + 7, {1: 2})
    recorded(files, lambda recorder: recorder.begin(3, second))
    (path,) = recordings(files.folder)
    assert read(path)[1:] == [second]


def test_the_wall_clock_is_looked_at_once_a_minute(files: LogFiles) -> None:
    def scene(recorder: Recorder) -> None:
        for utime in (0, CLOCK_EVERY_US - 1, CLOCK_EVERY_US):
            recorder.event(Tick(utime))

    recorded(files, scene)
    (path,) = recordings(files.folder)
    assert [r.utime for r in read(path) if isinstance(r, Told)] == [0, CLOCK_EVERY_US]


def test_the_next_file_begins_between_two_events_and_stands_alone(files: LogFiles) -> None:
    files.file_bytes = 1_000

    def scene(recorder: Recorder) -> None:
        for utime in range(40):
            answered(recorder, utime, [STATUS] if utime % 2 else [])

    recorded(files, scene)
    paths = recordings(files.folder)
    assert len(paths) > 2
    parts = [read(path) for path in paths]
    assert [p[0].part for p in parts if isinstance(p[0], Opening)] == list(range(len(paths)))
    events = [r for part in parts for r in part if isinstance(r, SerialData)]
    assert [event.utime for event in events] == list(range(40))
    assert all(not isinstance(part[1], Sent) for part in parts)
    assert all(path.stat().st_size < 1_300 for path in paths)


@pytest.mark.row("O2")
def test_a_disk_that_hangs_costs_a_gap_that_is_counted_and_never_waits(
    files: LogFiles, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MAX_QUEUED", 1_000)
    recorder, lost = made(files), 0
    recorder.begin(1, BEGINNING)
    for utime in range(100):
        answered(recorder, utime, [STATUS])
    lost = recorder.dropped
    assert 80 < lost < 100
    assert recorder.problems() == [
        f"the recording lacks {lost} events: the disk was too slow for them"
    ]
    recorder._flush()
    answered(recorder, 100, [])
    recorder._flush()
    (path,) = recordings(files.folder)
    *_, gap, after = read(path)
    assert isinstance(gap, Told)
    assert (gap.kind, gap.content["lost"]) == ("gap", lost)
    assert after == SerialData(100, "uwb", b"100")
    assert recorder.dropped == lost
    files.close()


@pytest.mark.row("O2")
def test_a_disk_that_is_full_ends_the_recording_and_says_so(files: LogFiles) -> None:
    def scene(recorder: Recorder) -> None:
        files.fault = "disk full"
        answered(recorder, 5, [STATUS])

    recorder = recorded(files, scene)
    assert recorder.problems() == ["nothing is recorded: disk full"]
    assert not recorder._queue or recorder._queued < 2_000
    before = recorder._queued
    for utime in range(1_000):
        answered(recorder, utime, [STATUS])
    assert recorder._queued == before


def test_what_is_done_is_in_the_next_tick_though_it_was_not_sent(files: LogFiles) -> None:
    def scene(recorder: Recorder) -> None:
        recorder.event(Tick(1))
        recorder.effects(1, [STATUS])
        recorder.event(Tick(2))

    recorder = recorded(files, scene)
    (path,) = recordings(files.folder)
    first, second = (r for r in read(path) if isinstance(r, Marked))
    assert first.digest == 0
    assert second.digest == recorder._encoder.digest != 0


def test_the_writing_thread_ends_with_the_daemon(files: LogFiles) -> None:
    recorded(files, lambda _: None)
    assert all(thread.name != "recorder" for thread in threading.enumerate())


def test_where_nothing_is_to_be_recorded_nothing_is() -> None:
    recorder = NoRecorder()
    recorder.begin(1, BEGINNING)
    recorder.start()
    recorder.event(Tick(1))
    recorder.effects(1, [STATUS])
    asyncio.run(recorder.close())
    assert recorder.status() is None
    assert recorder.problems() == []
