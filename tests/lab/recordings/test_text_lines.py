"""Lines as tools write them."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab.recordings import text_lines
from lab.recordings.recording import BadRecording


def test_blank_lines_comments_and_a_byte_order_mark_are_not_there(tmp_path: Path) -> None:
    path = tmp_path / "a"
    text = "\ufeff# a\n\n x  1\r\n//b\n  % c\ny # 2"
    path.write_text(text, encoding="utf-8", newline="")
    assert list(text_lines.worded(path)) == [(3, ["x", "1"]), (6, ["y", "#", "2"])]


@pytest.mark.parametrize("data", [b"\xff\xfe\x00", b"a\x00b", b"\x89PNG"])
def test_what_is_no_text_is_said(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(data)
    with pytest.raises(BadRecording, match=r"^a: not a text file$"):
        list(text_lines.worded(tmp_path / "a"))


def test_a_file_that_would_fill_the_memory_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(text_lines, "MOST_BYTES", 4)
    (tmp_path / "a").write_text("1234")
    assert text_lines.text(tmp_path / "a") == "1234"
    (tmp_path / "a").write_text("12345")
    with pytest.raises(BadRecording, match="no recording of a team"):
        text_lines.text(tmp_path / "a")


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("one", "'one' is not a number"),
        ("inf", "inf is not a finite number"),
        ("-nan", "-nan is not a finite number"),
        ("1.1e15", "1.1e15 is too large"),
        ("9" * 400, "is not a finite number"),
    ],
)
def test_a_word_that_is_no_number_is_named(word: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        text_lines.number(word)


def test_numbers_are_as_many_as_there_are_names() -> None:
    assert text_lines.numbers(["1", "-1e15"], "x y") == [1, -1e15]
    with pytest.raises(ValueError, match="3 numbers stand there, 2 belong there: x y"):
        text_lines.numbers(["1", "2", "3"], "x y")
