"""The log: one line per event, for people or for machines, from the level that is asked for."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
import structlog

from drslamd.config import DaemonSection
from drslamd.io.logs import set_up


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    before = structlog.get_config()
    yield
    structlog.configure(**before)


def lines(capsys: pytest.CaptureFixture[str], **keys: Any) -> list[str]:
    """What one event of each level comes to."""
    set_up(DaemonSection(**keys))
    log = structlog.get_logger()
    for level in ("debug", "info", "warning", "error"):
        getattr(log, level)("pose.fault", what=f"two words\nat {level}", robot=3)
    out, err = capsys.readouterr()
    assert out == ""
    return err.splitlines()


@pytest.mark.parametrize(
    ("level", "count"), [("debug", 4), ("info", 3), ("warning", 2), ("error", 1)]
)
def test_what_is_below_the_level_is_left_out(
    level: str, count: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert len(lines(capsys, log_level=level)) == count


def test_a_line_for_people_begins_with_time_level_and_event(
    capsys: pytest.CaptureFixture[str],
) -> None:
    first = lines(capsys)[0].split(" ")
    assert [word.partition("=")[0] for word in first[:3]] == ["timestamp", "level", "event"]
    assert first[1:3] == ["level=info", "event=pose.fault"]
    assert "robot=3" in first


def test_a_line_for_machines_is_json(capsys: pytest.CaptureFixture[str]) -> None:
    events = [json.loads(line) for line in lines(capsys, log_format="json")]
    assert [event["level"] for event in events] == ["info", "warning", "error"]
    assert events[0]["what"] == "two words\nat info"
    assert events[0]["timestamp"].endswith("Z")


def test_an_exception_is_shown_where_it_came_from(capsys: pytest.CaptureFixture[str]) -> None:
    set_up(DaemonSection())
    try:
        1 // 0  # noqa: B018
    except ZeroDivisionError:
        structlog.get_logger().exception("daemon.bug")
    said = capsys.readouterr().err
    assert "event=daemon.bug" in said
    assert "ZeroDivisionError" in said
    assert "test_logs.py" in said


def test_the_log_brings_no_colours_with_it() -> None:
    """Of this host, where pytest brings them."""
    program = "import sys, drslamd.io.logs; print(*({'structlog', 'rich'} & {*sys.modules}))"
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert said.stdout.split() == [b"structlog"]
