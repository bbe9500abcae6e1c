"""State on disk, the key file, the status socket, the worker, TUM files."""

from __future__ import annotations

import asyncio
import json
import os
import stat
from pathlib import Path
from typing import Any

import pytest

from drslamd.config import ConfigError
from drslamd.io.state_store import StateStore, next_epoch, read_key, write_key
from drslamd.io.status_socket import StatusSocket, ask
from drslamd.io.tum import write
from drslamd.io.worker import Finished, Worker


def test_state_comes_back_as_it_was_saved(tmp_path: Path) -> None:
    StateStore(tmp_path, 3).save({"epoch": 7, "epochs": {1: 5}})
    assert StateStore(tmp_path, 3).load() == {"schema": 1, "epoch": 7, "epochs": {"1": 5}}
    assert StateStore(tmp_path, 4).load() == {}


def test_a_damaged_or_foreign_state_file_is_a_fault_and_not_an_end(tmp_path: Path) -> None:
    store = StateStore(tmp_path, 3)
    for text, word in (("{half", "cannot read"), ('{"schema": 99}', "another version")):
        store.path.write_text(text)
        fresh = StateStore(tmp_path, 3)
        assert fresh.load() == {}
        assert word in fresh.fault


def test_a_folder_that_cannot_be_written_is_a_fault_that_ends_when_it_can(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    store = StateStore(blocked / "below", 3)
    store.save({"epoch": 1})
    assert str(blocked) in store.fault
    blocked.unlink()
    store.save({"epoch": 1})
    assert store.fault == ""


def test_an_interrupted_save_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = StateStore(tmp_path, 3)
    store.save({"epoch": 1})

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    store.save({"epoch": 2})
    assert "No space left" in store.fault
    assert StateStore(tmp_path, 3).load()["epoch"] == 1


def test_an_epoch_is_above_the_last_even_when_the_wall_clock_went_back() -> None:
    assert next_epoch({}, 1_000) == 1_000
    assert next_epoch({"epoch": 1_000}, 500) == 1_001
    assert next_epoch({"epoch": 1_000}, 1_000) == 1_001
    assert next_epoch({"epoch": 1_000}, 2_000) == 2_000


def test_a_key_is_made_private_and_never_twice(tmp_path: Path) -> None:
    path = tmp_path / "team.key"
    write_key(path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert len(read_key(str(path))) == 32
    with pytest.raises(FileExistsError):
        write_key(path)


@pytest.mark.parametrize(
    ("text", "mode", "word"),
    [
        ("ab" * 32, 0o644, "chmod 600"),
        ("ab" * 32, 0o640, "chmod 600"),
        ("", 0o600, "not a team key"),
        ("ab" * 31, 0o600, "not a team key"),
        ("xy" * 32, 0o600, "not a team key"),
    ],
)
def test_a_key_file_that_is_not_right_is_refused_with_its_remedy(
    tmp_path: Path, text: str, mode: int, word: str
) -> None:
    path = tmp_path / "team.key"
    path.write_text(text)
    path.chmod(mode)
    with pytest.raises(ConfigError, match=word):
        read_key(str(path))


def test_a_missing_key_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="nowhere"):
        read_key(str(tmp_path / "nowhere"))


def serve(path: Path, client: Any) -> Any:
    async def run() -> Any:
        server = StatusSocket(path, {"status": lambda: {"robot": 3}})
        assert await server.open() == ""
        answer = await client(path)
        await server.close()
        return answer

    return asyncio.run(asyncio.wait_for(run(), 20))


def test_a_question_is_answered_by_one_line_of_json(tmp_path: Path) -> None:
    assert serve(tmp_path / "s", lambda path: ask(path, "status")) == {"robot": 3}
    assert not (tmp_path / "s").exists()


def test_an_unknown_question_is_told_what_may_be_asked(tmp_path: Path) -> None:
    assert serve(tmp_path / "s", lambda path: ask(path, "time")) == {"error": "ask one of status"}


def test_a_client_that_says_too_much_or_goes_away_does_no_harm(tmp_path: Path) -> None:
    async def rude(path: Path) -> Any:
        for data in (b"x" * 10_000, b"status", b""):
            _, writer = await asyncio.open_unix_connection(str(path))
            writer.write(data)
            writer.close()
        return await ask(path, "status")

    assert serve(tmp_path / "s", rude) == {"robot": 3}


def test_a_socket_left_over_from_a_crash_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "s").write_text("stale")
    assert serve(tmp_path / "s", lambda path: ask(path, "status")) == {"robot": 3}


def test_a_socket_that_cannot_be_made_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")

    async def run() -> str:
        return await StatusSocket(tmp_path / "file" / "s", {}).open()

    assert "cannot listen" in asyncio.run(run())


def test_the_worker_hands_back_results_and_exceptions_in_order() -> None:
    async def run() -> list[Finished]:
        worker, out = Worker(), []
        worker.start()
        done = asyncio.Event()

        def take(finished: Finished) -> None:
            out.append(finished)
            if len(out) == 2:
                done.set()

        worker.submit(lambda: 6 * 7, take)
        worker.submit(lambda: 1 // 0, take)
        await asyncio.wait_for(done.wait(), 10)
        worker.stop()
        return out

    good, bad = asyncio.run(run())
    assert (good.result, good.error) == (42, None)
    assert isinstance(bad.error, ZeroDivisionError)


def test_tum_files_have_eight_columns_and_rising_times(tmp_path: Path) -> None:
    answer = {
        "frame": 0,
        "robots": {
            "0": {"utime": [1_000_000, 1_100_000], "poses": [[1, 2, 0], [3, 4, 3.14159265]]}
        },
    }
    (path,) = write(tmp_path / "out", json.loads(json.dumps(answer)))
    rows = [[float(v) for v in line.split()] for line in path.read_text().splitlines()]
    assert path.name == "robot0.txt"
    assert rows[0] == [1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    assert rows[1][:3] == [1.1, 3.0, 4.0]
    assert rows[1][6] == pytest.approx(1.0)
    assert rows[1][7] == pytest.approx(0.0, abs=1e-6)
