"""What outlives a restart: the state file, epochs, the team key."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any

import pytest

from drslamd.config import ConfigError
from drslamd.io.state_store import StateStore, next_epoch, read_key, write_key


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


@pytest.mark.parametrize(
    "state",
    [
        [],
        {"epoch": "7"},
        {"epoch": 1.5},
        {"epochs": []},
        {"epochs": {"one": 5}},
        {"epochs": {"1": "5"}},
        {"calibration": {"scale": "wide"}},
    ],
)
def test_a_state_file_with_a_wrong_kind_of_value_is_not_used(tmp_path: Path, state: Any) -> None:
    store = StateStore(tmp_path, 3)
    whole = {"schema": 1, **state} if isinstance(state, dict) else state
    store.path.write_text(json.dumps(whole))
    assert store.load() == {}
    assert "starting afresh" in store.fault


def test_a_robot_has_a_file_of_its_own_and_no_other_is_left_behind(tmp_path: Path) -> None:
    for robot in (3, 4):
        StateStore(tmp_path / "below", robot).save({"epoch": robot})
    names = sorted(path.name for path in (tmp_path / "below").iterdir())
    assert names == ["robot-3.json", "robot-4.json"]


def test_a_key_file_that_is_no_text_is_named(tmp_path: Path) -> None:
    path = tmp_path / "team.key"
    path.write_bytes(b"\xff\xfe")
    path.chmod(0o600)
    with pytest.raises(ConfigError, match="not a text file"):
        read_key(str(path))


def test_two_keys_are_different(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_key(tmp_path / name)
    assert read_key(str(tmp_path / "a")) != read_key(str(tmp_path / "b"))
