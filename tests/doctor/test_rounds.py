"""All checks: every file is asked, a healthy robot is healthy, causes come first."""

from __future__ import annotations

from pathlib import Path

import pytest
from daemon_scenes import configured
from patients import Case
from places import REPOSITORY

from drslamd.conditions.health import CAUSES_FIRST
from drslamd.doctor.rounds import DAEMON, MACHINE, names, of_daemon, of_machine
from drslamd.io.claim import Claim
from drslamd.machine.folders import socket_path


@pytest.mark.parametrize(("folder", "looks"), [("daemon", DAEMON), ("machine", MACHINE)])
def test_every_file_is_one_check_that_is_asked(folder: str, looks: tuple[object, ...]) -> None:
    files = {p.stem for p in (REPOSITORY / "drslamd" / "doctor" / folder).glob("[a-z]*.py")}
    assert [look.__name__ for look in looks] == sorted(files, key=names_order(looks))  # type: ignore[attr-defined]
    assert all(name.replace("_", " ") in names() for name in files)


def names_order(looks: tuple[object, ...]) -> object:
    return [look.__name__ for look in looks].index  # type: ignore[attr-defined]


def test_of_a_robot_in_good_order_nothing_is_found() -> None:
    assert of_daemon(Case().patient) == []


def test_everything_that_the_daemon_says_is_told_by_a_check_causes_first() -> None:
    case = Case()
    for key in CAUSES_FIRST:
        case.say(key, key)
    told = [finding.cause for finding in of_daemon(case.patient)]
    assert sorted(told) == sorted(CAUSES_FIRST)
    assert told[0] == "team.own_id_used"
    assert told[-2:] == ["pose", "state"]


def test_that_a_daemon_runs_is_no_finding(tmp_path: Path) -> None:
    config = configured(tmp_path, '[gossip]\ninterface = "lo"\nttl = 0\nport = 47212\n')
    with Claim(socket_path(config)):
        assert [f.check for f in of_machine(config)] == ["team key"]
