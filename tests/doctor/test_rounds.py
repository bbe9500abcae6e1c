"""All checks: every file is asked, a healthy robot is healthy, causes come first."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from daemon_scenes import configured
from patients import Case
from places import REPOSITORY

from drslamd.conditions.health import CAUSES_FIRST
from drslamd.doctor.patient import warning
from drslamd.doctor.rounds import DAEMON, MACHINE, names, of_daemon, of_machine, together
from drslamd.io.claim import Claim
from drslamd.machine.folders import socket_path


@pytest.mark.parametrize(("folder", "looks"), [("daemon", DAEMON), ("machine", MACHINE)])
def test_every_file_is_one_check_that_is_asked(folder: str, looks: tuple[object, ...]) -> None:
    files = {p.stem for p in (REPOSITORY / "drslamd" / "doctor" / folder).glob("[a-z]*.py")}
    asked = [str(getattr(look, "__name__", "")) for look in looks]
    assert sorted(asked) == sorted(files)
    assert all(name.replace("_", " ") in names() for name in files)


def test_what_machine_and_daemon_both_say_is_told_once_with_since_when() -> None:
    machine = [warning("network", "it is down", ""), warning("disk", "it is full", "")]
    daemon = [replace(machine[0], since_s=9)]
    assert together(machine, daemon) == [machine[1], daemon[0]]


def test_of_a_robot_in_good_order_nothing_is_found() -> None:
    assert of_daemon(Case().patient) == []


def test_everything_that_the_daemon_says_is_told_by_a_check_causes_first() -> None:
    case = Case()
    for key in CAUSES_FIRST:
        case.say(key, key)
    told = [finding.cause for finding in of_daemon(case.patient)]
    assert sorted(told) == sorted(CAUSES_FIRST)
    assert told[0] == "team.own_id_used"
    assert told[-3:] == ["pose", "site", "state"]


def test_that_a_daemon_runs_is_no_finding(tmp_path: Path) -> None:
    config = configured(tmp_path, '[gossip]\ninterface = "lo"\nttl = 0\nport = 47212\n')
    with Claim(socket_path(config)):
        assert [f.check for f in of_machine(config)] == ["team key"]
