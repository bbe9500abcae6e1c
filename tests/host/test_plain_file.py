"""Files that anybody may have written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from drslamd.host.plain_file import read_plain


def test_a_file_of_the_most_bytes_is_read_and_one_more_is_too_many(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("12345")
    assert read_plain(path, 5) == "12345"
    with pytest.raises(ValueError, match="more than 4 bytes"):
        read_plain(path, 4)


def test_a_pipe_keeps_nobody_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ValueError, match="no plain file"):
        read_plain(tmp_path / "pipe", 5)


def test_what_is_no_text_or_not_there_is_said(tmp_path: Path) -> None:
    (tmp_path / "bytes").write_bytes(b"\xff")
    with pytest.raises(UnicodeDecodeError):
        read_plain(tmp_path / "bytes", 5)
    with pytest.raises(FileNotFoundError):
        read_plain(tmp_path / "none", 5)
    with pytest.raises(IsADirectoryError):
        read_plain(tmp_path, 5)
