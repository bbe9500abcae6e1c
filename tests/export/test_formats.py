"""The formats by name: what each needs, and what it does where it cannot be."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import team_answers

from drslamd.cli.export import QUESTIONS
from drslamd.export import pyfg_file
from drslamd.export.formats import CannotWrite, write


@pytest.mark.parametrize("name", [name for name in QUESTIONS if name != "geojson"])
def test_a_format_needs_no_more_answers_than_are_asked_for(name: str, tmp_path: Path) -> None:
    told = team_answers.answers()
    found = write(name, tmp_path, {question: told[question] for question in QUESTIONS[name]})
    assert found
    assert all(path.stat().st_size > 1_000 for path in found)


@pytest.mark.parametrize("name", ["tum", "g2o", "pyfg"])
def test_a_team_that_is_not_localised_leaves_what_was_written_before(
    name: str, tmp_path: Path
) -> None:
    before = {path: path.read_bytes() for path in write(name, tmp_path, team_answers.answers())}
    assert write(name, tmp_path, team_answers.unlocalised()) == []
    assert {path: path.read_bytes() for path in before} == before


def test_without_its_package_mcap_is_refused_with_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "drslamd.export.ros2.team_file", None)
    monkeypatch.delattr("drslamd.export.ros2.team_file", raising=False)
    with pytest.raises(CannotWrite, match=r'pip install "drslamd\[export\]"'):
        write("mcap", tmp_path, team_answers.answers())
    assert list(tmp_path.iterdir()) == []


def test_a_format_that_is_too_small_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pyfg_file, "LETTERS", ["A", "B"])
    with pytest.raises(CannotWrite, match="3 robots, and pyfg has letters for 2"):
        write("pyfg", tmp_path, team_answers.answers())
