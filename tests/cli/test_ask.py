"""Asking a daemon that does not run, or not for this user."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from setup_scenes import give_away, healthy, nobody
from status_answers import answering

from drslamd import cli
from drslamd.cli import ask, exit_codes
from drslamd.cli.ask import NoAnswer, answer


@pytest.mark.parametrize("verb", ["status", "trajectory"])
def test_asking_when_no_daemon_runs_ends_with_69_and_how_to_start_one(
    verb: str, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([verb, "-c", str(config)]) == exit_codes.UNAVAILABLE == 69
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("no daemon answers at ")
    # systemd reads /etc/drslamd/3.toml, and not this file
    assert line.endswith(f"none runs with this configuration; start it: drslamd run -c {config}")


def said(path: Path) -> str:
    with pytest.raises(NoAnswer) as caught:
        answer(path, "status", "/etc/drslamd/3.toml")
    return str(caught.value)


@pytest.fixture
def place() -> Iterator[Path]:
    with healthy() as setup:
        yield setup.folder / "s"


def test_what_a_dead_daemon_left_behind_answers_nothing(place: Path) -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(place))
    assert "the last one ended without a goodbye; start it: " in said(place)


def test_the_configuration_of_the_service_is_started_by_systemd(place: Path) -> None:
    start = "start it: systemctl start drslamd@3, or drslamd run -c /etc/drslamd/3.toml"
    assert said(place).endswith(start)


def test_a_daemon_of_another_user_is_not_to_be_asked() -> None:
    with healthy() as setup:
        give_away(setup)
        closed = setup.folder / "run"
        closed.mkdir(mode=0o700)
        closed.chmod(0)
        with nobody():
            line = said(closed / "s")
    assert "ask with sudo, or join its group: usermod -aG drslamd " in line
    assert "mode 0000" in line


def test_a_daemon_that_hangs_is_said_to(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def never(path: Path, question: str) -> object:
        raise asyncio.TimeoutError

    monkeypatch.setattr(ask, "ask", never)
    assert "it runs but hangs; journalctl -u drslamd@3 may say why" in said(place)
    with pytest.raises(NoAnswer, match="its log may say why, end it with kill -ABRT"):
        answer(place, "status", "3.toml")


def test_what_is_no_answer_is_called_so(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def nonsense(path: Path, question: str) -> object:
        raise ValueError("Expecting value: line 1")

    monkeypatch.setattr(ask, "ask", nonsense)
    assert "what came is no answer (Expecting value: line 1)" in said(place)


def test_a_folder_in_the_place_of_a_socket_is_named(place: Path) -> None:
    place.mkdir()
    assert "the last one ended" in said(place)


def test_an_answer_is_handed_on(place: Path) -> None:
    with answering(place, {"robot": 3}, "status"):
        assert answer(place, "status", "3.toml") == {"robot": 3}
