"""Files of commands: no place for a result is said before the run, and a good one is never lost."""

from __future__ import annotations

import argparse
import errno
import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from lab import demo, evaluate, files
from lab.accuracy import __main__ as accuracy
from lab.benchmark import __main__ as benchmark
from lab.bound import first_pose
from lab.report import __main__ as report
from lab.trust import __main__ as trust
from places import REPOSITORY

LAB = REPOSITORY / "tools" / "lab"
RUNS: dict[str, tuple[Callable[[list[str]], int], list[str]]] = {
    "demo": (demo.main, ["--json"]),
    "demo's picture": (demo.main, ["--png"]),
    "evaluate": (evaluate.main, ["run.pyfg", "--json"]),
    "report": (report.main, ["run.pyfg", "--to"]),
    "accuracy": (accuracy.main, ["data", "--json"]),
    "trust": (trust.main, ["--json"]),
    "benchmark": (benchmark.main, ["--json"]),
    "benchmark's picture": (benchmark.main, ["--picture"]),
    "first poses": (first_pose.main, ["--json"]),
}
"""Commands that take long, and their argument that names a result."""
OTHERS_WRITE = {
    # what they write are copies of the project, configurations or parts of a package
    *("hunt", "package", "near/age.py", "play/real_team.py", "recordings/pyfg.py"),
    # they write beside it themselves
    *("soak/put_aside.py", "reproduce/state.py"),
}


@pytest.mark.parametrize("name", RUNS)
def test_no_place_for_a_result_is_said_before_anything_runs(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    main, arguments = RUNS[name]
    with pytest.raises(SystemExit) as ended:
        main([*arguments, str(tmp_path / "file" / "result")])
    assert ended.value.code == 2
    assert f"{tmp_path / 'file'} is a file and no folder" in capsys.readouterr().err


def test_a_result_may_go_into_a_folder_that_is_to_be_made_but_not_in_the_place_of_one(
    tmp_path: Path,
) -> None:
    new = tmp_path / "new" / "deep" / "result"
    assert files.result_file(str(new)) == new
    assert not new.parent.exists()
    with pytest.raises(argparse.ArgumentTypeError, match="is a folder; name a file"):
        files.result_file(str(tmp_path))


def test_a_folder_that_may_not_be_written_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(argparse.ArgumentTypeError, match=f"{tmp_path}: Permission denied"):
        files.result_file(str(tmp_path / "result"))


def test_on_a_full_disk_the_old_result_stays_and_one_sentence_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "new" / "result"
    assert files.keep(path, "good") == 0

    def full(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(data[:2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert files.keep(path, "better") == 73
    said = capsys.readouterr().err
    assert said == f"{path}: No space left on device; what was there before is still there\n"
    assert [place.read_text() for place in path.parent.iterdir()] == ["good"]


def test_where_no_result_is_wanted_none_is_written() -> None:
    assert files.keep(None, "any") == 0


@pytest.mark.parametrize(("content", "words"), [(None, "No such file"), (b"\xff", "not a text")])
def test_sections_that_cannot_be_read_end_with_66_and_one_sentence(
    content: bytes | None, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "extra.toml"
    if content is not None:
        path.write_bytes(content)
    for main in (evaluate.main, report.main, accuracy.main):
        assert main([str(tmp_path), "--config", str(path)]) == 66
        said = capsys.readouterr().err
        assert said.startswith(f"{path}: {words}")
        assert said.count("\n") == 1


def test_no_command_writes_over_a_result_in_another_way() -> None:
    """Neither text nor pictures; what is cut off in the middle is lost with what was there."""
    found = []
    for path in LAB.rglob("*.py"):
        name = str(path.relative_to(LAB))
        if name != "files.py" and not {name, name.split("/")[0]} & OTHERS_WRITE:
            writes = re.findall(r"\.(?:write_text|write_bytes|savefig)\((?!out,)", path.read_text())
            found += [f"{name}: {call}" for call in writes]
    assert found == []
