"""What a run refuses, and a second daemon above all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from daemon_scenes import configured

from drslamd.config import Config
from drslamd.io.claim import Claim
from drslamd.machine import folders
from drslamd.machine.finding import Severity
from drslamd.machine.folders import socket_path
from drslamd.machine.refusals import SECOND_DAEMON, refusals


@pytest.fixture
def config(tmp_path: Path) -> Config:
    return configured(tmp_path)


def test_nothing_is_refused_of_a_machine_in_good_order(config: Config) -> None:
    assert refusals(config) == []


def test_while_a_daemon_lives_another_one_of_its_configuration_is_refused(config: Config) -> None:
    with Claim(socket_path(config)):
        (only,) = refusals(config)
    assert (only.check, only.severity) == (SECOND_DAEMON, Severity.ERROR)
    assert only.cause == f"a daemon already runs as robot 1 here (process {os.getpid()})"
    assert only.remedy.startswith("stop it first: systemctl stop drslamd@1")
    assert refusals(config) == []


def test_a_service_that_runs_keeps_a_daemon_by_hand_from_it(
    config: Config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RUNTIME_DIRECTORY", raising=False)
    monkeypatch.setattr(folders, "SERVICE_RUNTIME", tmp_path / "run")
    service = tmp_path / "run" / "drslamd-1.sock"
    with Claim(service):
        service.touch()
        (only,) = refusals(config)
    assert only.check == SECOND_DAEMON


def test_that_a_daemon_lives_stands_before_what_else_is_refused(config: Config) -> None:
    team = config.team.model_copy(update={"insecure": False, "key_file": "/nowhere/key"})
    keyless = config.model_copy(update={"team": team})
    with Claim(socket_path(config)):
        assert [f.check for f in refusals(keyless)] == [SECOND_DAEMON, "team key"]
    (only,) = refusals(keyless)
    assert only.cause == "team.key_file = '/nowhere/key': No such file or directory"
    assert only.remedy.startswith("copy the team's key there")


@pytest.mark.parametrize(("largest", "refused"), [(2**31 - 1, True), (2**63 - 1, False)])
def test_a_32_bit_system_is_refused_in_one_sentence(
    config: Config, monkeypatch: pytest.MonkeyPatch, largest: int, refused: bool
) -> None:
    monkeypatch.setattr("drslamd.machine.refusals.sys.maxsize", largest)
    found = refusals(config)
    assert [finding.check for finding in found] == (["computer"] if refused else [])
    assert all("32-bit system" in finding.cause and "64-bit" in finding.remedy for finding in found)
