"""What outlives a restart: the state file, epochs, the team key."""

from __future__ import annotations

import copy
import json
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drslamd.config import ConfigError
from drslamd.io import state_store
from drslamd.io.state_store import StateStore, read_key, write_key
from drslamd.slam.calibration.sensor_calibration import SensorCalibration


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


@pytest.mark.row("O13")
@pytest.mark.parametrize("schema", [0, 2, 99, "1", None])
def test_of_an_older_or_newer_version_the_numbers_of_starts_are_kept(
    tmp_path: Path, schema: Any
) -> None:
    later = {"epoch": 7, "epochs": {"1": 5}, "calibration": {"scale": "otherwise"}, "more": [1]}
    (tmp_path / "robot-3.json").write_text(json.dumps({**later, "schema": schema}))
    store = StateStore(tmp_path, 3)
    assert store.load() == {"epoch": 7, "epochs": {"1": 5}}
    assert "another version" in store.fault
    assert store.begin({}, 7) > 7
    assert StateStore(tmp_path, 3).load()["schema"] == 1


@pytest.mark.row("O13")
@pytest.mark.parametrize("starts", [{"epoch": -1}, {"epoch": 7, "epochs": {"255": 5}}])
def test_of_another_version_nothing_is_kept_that_is_not_believable(
    tmp_path: Path, starts: dict[str, Any]
) -> None:
    (tmp_path / "robot-3.json").write_text(json.dumps({**starts, "schema": 2}))
    assert StateStore(tmp_path, 3).load() == {}


@pytest.mark.row("T5")
@pytest.mark.parametrize(
    "wall_s",
    [-1, 0, 1, 1024 * 604_800, 2048 * 604_800, 2**31 - 1, 2**31, 2**32, 2**53 // 10**9, 2**53],
    ids=str,
)
def test_at_every_odd_date_a_start_has_a_number_above_the_last_and_is_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wall_s: int
) -> None:
    """No clock, weeks of GPS that begin anew, 2038, and beyond."""
    monkeypatch.setattr(state_store, "wall_s", lambda: wall_s)
    for last in (0, 7 * 10**15):
        epoch = StateStore(tmp_path, 3).begin({}, last)
        assert epoch > last
        assert StateStore(tmp_path, 3).load()["epoch"] == epoch


def test_a_folder_that_cannot_be_written_is_a_fault_that_ends_when_it_can(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    store = StateStore(blocked / "below", 3)
    store.save({"epoch": 1})
    assert str(blocked) in store.fault
    blocked.unlink()
    store.save({"epoch": 1})
    assert store.fault == ""


@pytest.mark.row("O2")
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


def test_a_key_is_made_private_and_never_twice(tmp_path: Path) -> None:
    path = tmp_path / "team.key"
    write_key(path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert len(read_key(str(path))) == 32
    with pytest.raises(FileExistsError):
        write_key(path)


@pytest.mark.row("S11")
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
        {"place": {"speed_mps": 0.5, "seen": [[1, 2, 3]]}},
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


# a file that a stranger wrote


def loaded(tmp_path: Path, content: str | bytes) -> tuple[dict[str, Any], str]:
    """What is read of a file, and the fault."""
    store = StateStore(tmp_path, 3)
    store.path.write_bytes(content.encode() if isinstance(content, str) else content)
    return store.load(), store.fault


def a_state(**fields: Any) -> str:
    return json.dumps({"schema": 1, "epoch": 7, "epochs": {"1": 5}, "calibration": {}} | fields)


LAST_KEPT = 2**53 + 2**44


@pytest.mark.parametrize("epoch", [0, LAST_KEPT])
def test_epochs_at_their_bounds_are_read(tmp_path: Path, epoch: int) -> None:
    state, fault = loaded(tmp_path, a_state(epoch=epoch, epochs={"0": epoch, "254": epoch}))
    assert (state["epoch"], state["epochs"], fault) == (epoch, {"0": epoch, "254": epoch}, "")


DAMAGED = [
    {"epoch": -1},
    {"epoch": LAST_KEPT + 1},
    {"epoch": 2**63 - 1},
    {"epoch": 10**400},
    {"epoch": True},
    {"epoch": None},
    {"epochs": {"1": LAST_KEPT + 1}},
    {"epochs": {"1": -1}},
    {"epochs": {"1": False}},
    {"epochs": {"255": 5}},
    {"epochs": {"-1": 5}},
    {"epochs": {"01": 5}},
    {"epochs": {"\u0661": 5}},
    {"epochs": {"1" * 5_000: 5}},
    {"calibration": []},
    {"calibration": {"bias_m": {"1" * 5_000: [0.1, 0.1]}}},
    {"calibration": {"bias_m": {"\u0661": [0.1, 0.1]}}},
    {"calibration": {"scale": [10**400, 0.1]}},
    {"calibration": {"scale": [0.1, 0.0]}},
]


@pytest.mark.parametrize("fields", DAMAGED, ids=lambda fields: str(fields)[:40])
def test_a_state_file_with_a_value_beyond_its_bound_is_not_used(
    tmp_path: Path, fields: dict[str, Any]
) -> None:
    state, fault = loaded(tmp_path, a_state(**fields))
    assert state == {}
    assert "is damaged; starting afresh" in fault


@pytest.mark.parametrize(
    ("content", "word"),
    [
        ("[" * 100_000, "nested too deep"),
        ('{"a":' * 40_000, "nested too deep"),
        ("7" * 5_000, "cannot read"),
        (b"\xff\xfe{}", "cannot read"),
        ("", "cannot read"),
        ("NaN", "another version"),
        ("null", "another version"),
    ],
    ids=["brackets", "braces", "digits", "no text", "empty", "NaN", "null"],
)
def test_a_state_file_that_is_none_is_named_with_its_fault(
    tmp_path: Path, content: str | bytes, word: str
) -> None:
    state, fault = loaded(tmp_path, content)
    assert state == {}
    assert word in fault
    assert "starting afresh" in fault


@pytest.mark.parametrize(("size", "read"), [(262_144, True), (262_145, False)])
def test_a_state_file_of_more_than_256_kib_is_not_read(
    tmp_path: Path, size: int, read: bool
) -> None:
    state, fault = loaded(tmp_path, a_state().ljust(size))
    assert bool(state) == read
    assert read or "more than 262144 bytes" in fault


@pytest.mark.parametrize("kind", ["pipe", "folder", "device"])
def test_what_is_no_plain_file_is_not_read_and_nobody_waits_for_it(
    tmp_path: Path, kind: str
) -> None:
    store = StateStore(tmp_path, 3)
    if kind == "pipe":
        os.mkfifo(store.path)
    elif kind == "folder":
        store.path.mkdir()
    else:
        store.path.symlink_to("/dev/zero")
    assert store.load() == {}
    assert "cannot read" in store.fault


def test_the_state_of_a_robot_that_knows_everybody_is_read_again(tmp_path: Path) -> None:
    pair = [-0.12345678901234567, 0.12345678901234567]
    bias = {str(robot): pair for robot in range(1, 255)}
    calibration = {"scale": pair, "yaw_rad_per_m": pair, "bias_m": bias}
    epochs = {robot: LAST_KEPT - robot for robot in range(1, 255)}
    store = StateStore(tmp_path, 3)
    store.save({"epoch": LAST_KEPT, "epochs": epochs, "calibration": calibration})
    assert store.path.stat().st_size < 262_144 / 5
    assert StateStore(tmp_path, 3).load()["calibration"] == calibration


@pytest.mark.parametrize(
    "state", [{"epoch": LAST_KEPT + 1}, {"epochs": {1: -1}}, {"calibration": 3}]
)
def test_what_would_not_be_read_is_a_bug_and_is_not_written(
    tmp_path: Path, state: dict[str, Any]
) -> None:
    store = StateStore(tmp_path, 3)
    with pytest.raises(AssertionError, match="would not read"):
        store.save(state)
    assert not store.path.exists()


def test_a_save_that_failed_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    StateStore(tmp_path, 3).save({"epoch": 2})
    assert list(tmp_path.iterdir()) == []


# a new epoch


def test_a_new_epoch_is_kept_with_what_is_known(tmp_path: Path) -> None:
    store = StateStore(tmp_path, 3)
    epoch = store.begin({"epochs": {1: 5}}, 7)
    assert epoch > 10**15
    state = StateStore(tmp_path, 3).load()
    assert (state["epoch"], state["epochs"]) == (epoch, {"1": 5})


def test_thirty_new_epochs_grow_strictly(tmp_path: Path) -> None:
    store, epochs = StateStore(tmp_path, 3), [0]
    for _ in range(30):
        epochs.append(store.begin({}, epochs[-1]))
    assert epochs == sorted(set(epochs))


# every value of the file, at every border

WHOLE: dict[str, Any] = {
    "schema": 1,
    "epoch": 7,
    "epochs": {"1": 5, "254": 6},
    "calibration": {
        "scale": [0.01, 0.02],
        "yaw_rad_per_m": [0.001, 0.002],
        "bias_m": {"1": [0.1, 0.05]},
    },
}
INTS = [0, 1, -1, 2**31, 2**53, LAST_KEPT, LAST_KEPT + 1, 2**63 - 1, 2**63, -(2**63), 2**64]
FLOATS = [float("nan"), float("inf"), -float("inf"), 5e-324, -5e-324, 1.8e308, -0.0, 0.5]
OTHERS: list[Any] = [None, True, "", "7", [], {}, [0.1, 0.1, 0.1], 10**400]
BORDERS = [*INTS, *FLOATS, *OTHERS]


def ways(value: Any) -> Iterator[tuple[Any, ...]]:
    """To every value inside, and to the whole."""
    yield ()
    if isinstance(value, dict):
        yield from ((key, *way) for key, inner in value.items() for way in ways(inner))
    if isinstance(value, list):
        yield from ((at, *way) for at, inner in enumerate(value) for way in ways(inner))


def altered(way: tuple[Any, ...], value: Any) -> Any:
    """The whole state with one value in the place of another."""
    if not way:
        return value
    state = copy.deepcopy(WHOLE)
    place: Any = state
    for step in way[:-1]:
        place = place[step]
    place[way[-1]] = value
    return state


@pytest.mark.row("O13")
def test_whatever_one_value_of_the_file_is_the_next_start_begins_and_keeps_what_can_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "fsync", lambda _: None)
    tried = 0
    for way in ways(WHOLE):
        for border in BORDERS:
            StateStore(tmp_path, 3).path.write_text(json.dumps(altered(way, border)))
            store = StateStore(tmp_path, 3)
            state = store.load()
            assert state or store.fault, (way, border)
            kept = SensorCalibration.of_state(state.get("calibration", {}))
            last = state.get("epoch", 0)
            epochs = {int(robot): epoch for robot, epoch in state.get("epochs", {}).items()}
            epoch = store.begin({"epochs": epochs, "calibration": kept.state()}, last)
            assert epoch > last or last > LAST_KEPT - 2 * 10**6
            again = StateStore(tmp_path, 3)
            assert again.load()["epoch"] == epoch
            assert again.fault == ""
            tried += 1
    assert tried > 400
