"""Everything about a machine, the worst and the causes first."""

from __future__ import annotations

from pathlib import Path

from daemon_scenes import configured
from host_trees import HostTree

from drslamd.io.claim import Claim
from drslamd.machine.examination import examination
from drslamd.machine.finding import Severity
from drslamd.machine.folders import socket_path


def test_what_is_refused_stands_before_what_is_waited_for(tmp_path: Path) -> None:
    config = configured(tmp_path, '[gossip]\ninterface = "wlan9"\n')
    team = config.team.model_copy(update={"insecure": False, "key_file": "/nowhere/key"})
    found = examination(config.model_copy(update={"team": team}), HostTree(tmp_path))
    assert [f.check for f in found] == ["team key", "uwb port", "wheels port", "network"]
    assert [f.severity is Severity.ERROR for f in found] == [True, False, False, False]


def test_a_team_without_a_key_is_warned_of(tmp_path: Path) -> None:
    *_, last = examination(configured(tmp_path), HostTree(tmp_path))
    assert last.cause.startswith("team.insecure = true: ")
    assert "drslamd keygen" in last.remedy


def test_the_ports_of_a_daemon_that_runs_are_its_own(tmp_path: Path) -> None:
    config = configured(tmp_path, '[gossip]\ninterface = "lo"\n')
    with Claim(socket_path(config)):
        found = examination(config, HostTree(tmp_path))
    assert [f.check for f in found] == ["second daemon", "team key"]
