"""How long it takes to tell is counted while somebody reads, and only then."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest
from lab.near import busy_daemon


def test_what_is_told_to_nobody_costs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]

    def work(*_: Any) -> None:
        now[0] += 0.25

    monkeypatch.setattr(time, "thread_time", lambda: now[0])
    socket = SimpleNamespace(has_readers=False, tell=work)
    near = SimpleNamespace(on_motion=work)
    daemon: Any = SimpleNamespace(_near=socket, robot=SimpleNamespace(near=near))
    telling = busy_daemon.Telling(daemon)
    for has_readers, spent_s, times in ((False, 0.0, 0), (True, 0.5, 1), (True, 1.0, 2)):
        socket.has_readers = has_readers
        near.on_motion(None)
        socket.tell(None)
        assert (telling.spent_s, telling.times) == (spent_s, times)
