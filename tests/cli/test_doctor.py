"""``drslamd doctor``."""

from __future__ import annotations

import json

import pytest
from patients import healthy_answer
from setup_scenes import Setup, healthy
from status_answers import answering

from drslamd import cli
from drslamd.cli import doctor


@pytest.fixture(autouse=True)
def hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "BETWEEN_S", 0.01)


def look(setup: Setup, *options: str) -> int:
    return cli.main(["doctor", "-c", str(setup.config), *options])


def test_without_a_daemon_the_machine_is_looked_at_and_the_code_says_so(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with healthy() as setup:
        assert look(setup) == 69
        (line,) = capsys.readouterr().out.splitlines()
        assert line.startswith("no daemon answers at ")
        setup.key.chmod(0o644)
        assert look(setup) == 78
    first, remedy, last = capsys.readouterr().out.splitlines()
    assert first.startswith("error: team.key_file = ")
    assert remedy.startswith("    chmod 600 ")
    assert last == line


def test_a_robot_in_good_order_is_told_what_was_looked_at(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with healthy() as setup, answering(setup.state / "drslamd-3.sock", healthy_answer(), "status"):
        assert look(setup) == 0
    assert capsys.readouterr().out.startswith("nothing is wrong; looked at: machine, can state, ")


def test_a_finding_has_its_age_its_remedy_and_an_exit_code(
    capsys: pytest.CaptureFixture[str],
) -> None:
    answer = healthy_answer()
    what = "the UWB module is in LP mode; set it to DR_MODE0"
    answer["conditions"] = [{"key": "uwb", "what": what, "since_s": 600}]
    with healthy() as setup, answering(setup.state / "drslamd-3.sock", answer, "status"):
        assert look(setup) == 1
        printed = capsys.readouterr().out.splitlines()
        assert look(setup, "--json") == 1
        table = json.loads(capsys.readouterr().out)
    assert printed[:2] == [
        "error: module mode: the UWB module is in LP mode (since 10 min)",
        "    set it to DR_MODE0",
    ]
    assert table["exit_code"] == 1
    assert table["no_answer"] == ""
    assert table["findings"][0]["since_s"] == 600
