"""Questions over the local socket, from clients that are polite and from others."""

from __future__ import annotations

import asyncio
import stat
from pathlib import Path
from typing import Any

import pytest

from drslamd.io import status_socket
from drslamd.io.status_socket import StatusSocket, ask


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


def test_the_socket_is_for_its_user_and_his_group(tmp_path: Path) -> None:
    async def mode(path: Path) -> Any:
        return stat.S_IMODE(path.stat().st_mode)

    assert serve(tmp_path / "below" / "s", mode) == 0o660


def test_a_client_that_asks_nothing_is_let_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(status_socket, "PATIENCE_S", 0.05)

    async def silent(path: Path) -> Any:
        reader, writer = await asyncio.open_unix_connection(str(path))
        try:
            return await reader.read()
        finally:
            writer.close()

    assert serve(tmp_path / "s", silent) == b""


def test_nobody_to_ask_is_an_error_of_the_system(tmp_path: Path) -> None:
    with pytest.raises(OSError):
        asyncio.run(ask(tmp_path / "s", "status"))


def test_one_that_was_never_opened_can_be_closed(tmp_path: Path) -> None:
    asyncio.run(StatusSocket(tmp_path / "s", {}).close())
