"""The page of tools/accuracy has the rows and the pieces that the program has."""

from __future__ import annotations

import re

from lab.accuracy.ablation import PIECES
from lab.accuracy.accuracy_rows import ROWS
from places import REPOSITORY

PAGE = (REPOSITORY / "tools" / "lab" / "accuracy" / "README.md").read_text()


def table(heading: str) -> dict[str, str]:
    """First and second column of the table below a heading."""
    section = PAGE.split(f"## {heading}\n")[1].split("\n## ")[0]
    return dict(re.findall(r"^\| `([\w-]+)` \| (.+?) \|", section, flags=re.MULTILINE))


def test_every_row_is_there() -> None:
    assert list(table("Rows")) == list(ROWS)


def test_every_piece_is_there_with_what_is_done_instead() -> None:
    assert table("Pieces") == {name: piece.instead for name, piece in PIECES.items()}
