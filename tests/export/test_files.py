"""A file is whole or as it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from drslamd.export.files import replaced


@pytest.mark.parametrize("content", ["text with ü\n", b"\x00\xff"])
def test_what_is_written_is_there_and_nothing_else(content: str | bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before")
    replaced(path, content)
    assert path.read_bytes() == (content.encode() if isinstance(content, str) else content)
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before")

    def half(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(data[: len(data) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(OSError, match="No space"):
        replaced(path, "after")
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]
