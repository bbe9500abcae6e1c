"""How large logs grow."""

from __future__ import annotations

import pytest
from lab import log_sizes


def test_what_was_not_measured_grows_as_the_last_hour_did() -> None:
    assert log_sizes.after(10, [5]) == 5 * 10
    assert log_sizes.after(10, [5, 7]) == 7 + 8 * 2
    assert log_sizes.after(3, [5, 7, 8]) == 8


def test_logs_are_what_was_said_until_chapters_stand_for_it() -> None:
    """A hundred seconds of two robots: 200 entries of 80 to 120 bytes, each held once."""
    ((said, held),) = log_sizes.hourly_bytes(2, 1, hour_s=100)
    assert 200 * 80 < said < 200 * 120
    assert held > said + 200 * 33
    ((less, _),) = log_sizes.hourly_bytes(2, 1, hour_s=300)
    assert less < 2 * said


def test_it_prints_what_ten_hours_come_to(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(log_sizes, "hourly_bytes", lambda *_: iter([(10**6, 2 * 10**6)] * 2))
    assert log_sizes.main(["--robots", "3", "--hours", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == "3 robots, hour 2: 1.00 MB of messages, 2.00 MB in memory"
    assert lines[2] == "after 10 hours: 1.00 MB of messages, 2.00 MB in memory (20)"
