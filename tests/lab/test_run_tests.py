"""tools/test: which steps there are, and when it fails."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from lab import run_tests
from places import REPOSITORY

QUICK = ["lint", "format", "quick tests", "types"]
SLOW = ["slow tests side by side", "slow tests one by one"]
STEPS = sorted([*QUICK, *SLOW])


class Steps:
    """What would have been run; the named ones fail."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.names: list[str] = []
        self.commands: dict[str, tuple[str, ...]] = {}
        self.failing: set[str] = set()
        self.others: list[str] = []
        monkeypatch.setattr(run_tests, "_run", self._run)
        monkeypatch.setattr(run_tests, "_other_interpreters", lambda: self.others)

    def _run(self, name: str, *command: str, shown: bool = True) -> int:
        self.names.append(name)
        self.commands[name] = command
        return int(name in self.failing)


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> Steps:
    return Steps(monkeypatch)


def test_everything_is_run_and_quick_leaves_the_slow_out(steps: Steps) -> None:
    assert run_tests.main([]) == 0
    assert sorted(steps.names) == STEPS
    steps.names.clear()
    assert run_tests.main(["--quick"]) == 0
    assert sorted(steps.names) == sorted(QUICK)


def test_every_folder_with_slow_tests_is_in_one_of_the_two_steps(steps: Steps) -> None:
    run_tests.main([])
    shared, alone = (steps.commands[name] for name in SLOW)
    folders = [part for part in shared if part.startswith("tests/")]
    assert all((REPOSITORY / folder).exists() for folder in folders)
    assert folders == [p.removeprefix("--ignore=") for p in alone if p.startswith("--ignore=")]
    assert not [part for part in alone if part.startswith("tests/")]


@pytest.mark.parametrize("name", STEPS)
def test_one_step_that_fails_does_not_stop_the_others(
    steps: Steps, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    steps.failing = {name}
    assert run_tests.main([]) == 1
    assert sorted(steps.names) == STEPS
    assert f"FAILED: {name}\n" in capsys.readouterr().out


def test_another_interpreter_that_fails_counts_unless_it_is_quick(steps: Steps) -> None:
    steps.others = ["Python 3.10"]
    assert run_tests.main([]) == 1
    assert run_tests.main(["--quick"]) == 0


def test_the_other_interpreters_share_the_quick_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    own = f"{sys.version_info.major}.{sys.version_info.minor}"
    others = [version for version in run_tests.SUPPORTED if version != own]
    asked: list[tuple[str, ...]] = []
    monkeypatch.setattr(run_tests, "_find", lambda v: None if v == others[1] else f"python{v}")
    monkeypatch.setattr(run_tests, "_quick_tests_on", lambda *what: asked.append(what))
    assert run_tests._other_interpreters() == []
    first, _, last = others
    assert asked == [(first, f"python{first}", "1/2"), (last, f"python{last}", "2/2")]


@pytest.mark.parametrize(("there", "is_made"), [("python", True), ("pip", False)])
def test_another_interpreter_runs_its_share_in_an_environment_that_was_made_to_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, there: str, is_made: bool
) -> None:
    """pip is the last thing that one gets."""
    programs = tmp_path / ".venvs" / "3.12" / "bin"
    programs.mkdir(parents=True)
    (programs / there).touch()
    ran: list[list[str]] = []

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        ran.append(command)
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(run_tests, "ROOT", tmp_path)
    monkeypatch.setattr(subprocess, "run", run)
    assert run_tests._quick_tests_on("3.12", "python3.12", "2/3") == 0
    made = ["python3.12", "-m", "venv", "--clear", str(programs.parent)]
    assert (ran[0] == made) is is_made
    assert f"{tmp_path}[test]" in ran[-2]
    at = ran[-1].index("--share")
    assert ran[-1][at + 1] == "2/3"


def test_arguments_go_to_pytest_alone(steps: Steps) -> None:
    assert run_tests.main(["--", "-k", "clock"]) == 0
    assert steps.commands == {"tests": (sys.executable, "-m", "pytest", "-k", "clock")}


def test_types_are_checked_of_every_test_file(steps: Steps) -> None:
    run_tests.main(["--quick"])
    files = {str(p.relative_to(REPOSITORY)) for p in (REPOSITORY / "tests").rglob("*.py")}
    assert files <= set(steps.commands["types"])


def test_what_runs_beside_the_tests_is_told_at_its_end_and_only_if_it_failed(
    capfd: pytest.CaptureFixture[str],
) -> None:
    says = "print('a wrong type'); raise SystemExit({})"
    assert run_tests._run("types", sys.executable, "-c", says.format(0), shown=False) == 0
    assert "a wrong type" not in capfd.readouterr().out
    assert run_tests._run("types", sys.executable, "-c", says.format(1), shown=False) == 1
    told = capfd.readouterr().out
    assert told.index("== types\na wrong type") < told.index("== types: FAILED")


def test_what_tests_start_finds_its_bytecode_whatever_the_caller_says(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    says = "import sys; print('kept' if not sys.dont_write_bytecode else 'lost')"
    assert run_tests._run("bytecode", sys.executable, "-c", says) == 0
    assert "kept" in capfd.readouterr().out


def test_an_interpreter_is_found_when_it_says_its_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path) + os.pathsep + "/nowhere")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert run_tests._find("3.12") is None
    for version, answer in (("3.12", "3.12"), ("3.13", "3.11")):
        program = tmp_path / f"python{version}"
        program.write_text(f"#!/bin/sh\necho {answer}\n")
        program.chmod(0o755)
    assert run_tests._find("3.12") == str(tmp_path / "python3.12")
    assert run_tests._find("3.13") is None
