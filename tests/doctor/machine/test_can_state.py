"""States of a CAN controller, as iproute2 shows them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from patients import configuration

from drslamd.config import parse
from drslamd.doctor.machine.can_state import can_state
from drslamd.host.kernel import Host

TOML = """
robot.id = 1
team.insecure = true
uwb.port = "/dev/none"
[wheels]
source = "agilex"
track_m = 0.4
can.channel = "can1"
"""


def iproute2(folder: Path, printed: str) -> str:
    """A program `ip` that prints this."""
    program = folder / "ip"
    program.write_text(f"#!/bin/sh\ncat <<'END'\n{printed}\nEND\n")
    program.chmod(0o755)
    return f"{folder}:/usr/bin:/bin"


@pytest.mark.parametrize(
    ("state", "severity"),
    [
        ("ERROR-ACTIVE", ""),
        ("ERROR-WARNING", "warning"),
        ("ERROR-PASSIVE", "warning"),
        ("BUS-OFF", "error"),
        ("STOPPED", "error"),
    ],
)
def test_a_controller_in_trouble_is_told_with_its_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: str, severity: str
) -> None:
    link = {"ifname": "can1", "linkinfo": {"info_kind": "can", "info_data": {"state": state}}}
    monkeypatch.setenv("PATH", iproute2(tmp_path, json.dumps([link])))
    findings = list(can_state(parse(TOML), Host()))
    assert [f.severity.value for f in findings] == ([severity] if severity else [])
    assert all(f.cause == f"can1 is in the state {state}" for f in findings)
    assert all("NAME" not in f.remedy for f in findings)


@pytest.mark.parametrize("printed", ["", "nonsense", "[]", "[{}]", '[{"linkinfo": 3}]'])
def test_an_answer_that_cannot_be_read_says_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, printed: str
) -> None:
    monkeypatch.setenv("PATH", iproute2(tmp_path, printed))
    assert list(can_state(parse(TOML), Host())) == []


def test_without_iproute2_or_without_can_nothing_is_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert list(can_state(parse(TOML), Host())) == []
    assert list(can_state(configuration(), Host())) == []
