"""Questions at a terminal."""

from __future__ import annotations

import io

import pytest

from drslamd.cli.setting_up.asking import TRIES, NobodyAnswers, ask, is_a_person_there, one_of, show


def answers(monkeypatch: pytest.MonkeyPatch, *lines: str) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("".join(f"{line}\n" for line in lines)))


def test_a_wrong_answer_is_told_why_and_asked_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    answers(monkeypatch, "3", "2")
    assert ask("which", one_of(["a", "b"])) == "b"
    said = capsys.readouterr()
    assert said.out == ""
    assert "1 to 2" in said.err


def test_a_name_is_an_answer_and_an_empty_line_is_the_default(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answers(monkeypatch, "/dev/other", "")
    assert ask("which", one_of(["a"])) == "/dev/other"
    assert ask("which", str, "team.key") == "team.key"


def test_nobody_is_asked_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch, *["7"] * TRIES, "1")
    with pytest.raises(NobodyAnswers):
        ask("which", one_of(["a"]))
    answers(monkeypatch)
    with pytest.raises(NobodyAnswers):
        ask("which", one_of(["a"]))


def test_choices_are_numbered_from_one(capsys: pytest.CaptureFixture[str]) -> None:
    show(["a", "b"])
    assert capsys.readouterr().err == "  1  a\n  2  b\n"


def test_a_pipe_is_no_person(monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch)
    assert not is_a_person_there()
