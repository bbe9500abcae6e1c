"""Where a daemon keeps its state and answers, and where whoever asks it looks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from drslamd.config import Config, ConfigError, parse
from drslamd.machine import folders
from drslamd.machine.folders import socket_path, socket_to_ask, state_dir

CONFIG = """
robot.id = 1
team.insecure = true
uwb.port = "/dev/none"
wheels.source = "kobuki"
wheels.port = "/dev/none"
[daemon]
"""


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home, and no service manager."""
    for name in ("STATE_DIRECTORY", "RUNTIME_DIRECTORY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(folders, "SERVICE_RUNTIME", tmp_path / "run")
    return tmp_path


def at(**keys: str) -> Config:
    return parse(CONFIG + "\n".join(f'{key} = "{value}"' for key, value in keys.items()))


def test_state_is_where_the_file_says_else_where_systemd_says_else_at_home(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert state_dir(at()) == places / "home" / ".local" / "state" / "drslamd"
    monkeypatch.setenv("STATE_DIRECTORY", "/var/lib/drslamd:/var/lib/other")
    assert state_dir(at()) == Path("/var/lib/drslamd")
    assert state_dir(at(state_dir="/data")) == Path("/data")


def test_the_socket_is_where_the_file_says_else_where_systemd_says_else_with_the_state(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "drslamd-1.sock"
    assert socket_path(at()) == places / "home" / ".local" / "state" / "drslamd" / name
    assert socket_path(at(state_dir="/data")) == Path("/data") / name
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/drslamd:/run/other")
    assert socket_path(at(state_dir="/data")) == Path("/run/drslamd") / name
    assert socket_path(at(status_socket="/run/my.sock")) == Path("/run/my.sock")


def test_the_service_is_asked_where_it_runs_and_a_daemon_by_hand_elsewhere(places: Path) -> None:
    by_hand = socket_path(at())
    assert socket_to_ask(at()) == by_hand
    service = places / "run" / "drslamd-1.sock"
    service.parent.mkdir()
    assert socket_to_ask(at()) == by_hand
    service.touch()
    assert socket_to_ask(at()) == service
    (places / "run" / "drslamd-2.sock").touch()
    assert socket_to_ask(at(status_socket="/run/my.sock")) == Path("/run/my.sock")


def test_inside_the_service_its_own_folder_counts(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (places / "run").mkdir()
    (places / "run" / "drslamd-1.sock").touch()
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/elsewhere")
    assert socket_to_ask(at()) == Path("/run/elsewhere/drslamd-1.sock")


def test_a_service_that_this_user_may_not_see_is_asked_all_the_same(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def denied(path: Path, **_: Any) -> Any:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "stat", denied)
    assert socket_to_ask(at()) == places / "run" / "drslamd-1.sock"


@pytest.mark.parametrize("home", ["", None])
def test_without_a_home_there_is_no_folder_and_a_sentence_says_which_key_to_set(
    places: Path, monkeypatch: pytest.MonkeyPatch, home: str | None
) -> None:
    if home is None:
        monkeypatch.delenv("HOME")
        monkeypatch.setattr(Path, "home", no_home)
    else:
        monkeypatch.setenv("HOME", home)
    for place in (state_dir, socket_path, socket_to_ask):
        with pytest.raises(
            ConfigError, match=r"daemon\.state_dir: not given, .* \(HOME is not set"
        ):
            place(at())
    assert state_dir(at(state_dir="/data")) == Path("/data")


def no_home() -> Path:
    raise RuntimeError("Could not determine home directory.")
