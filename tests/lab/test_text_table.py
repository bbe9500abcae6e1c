"""CSV files: columns by their names, and what cannot be used named with its line."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab import text_table
from lab.recordings.recording import BadRecording


def written(folder: Path, text: str) -> Path:
    path = folder / "some.csv"
    path.write_text(text)
    return path


def test_columns_come_by_name(tmp_path: Path) -> None:
    found = text_table.columns(written(tmp_path, "t,uwb_m\n0.5,4\n1.5,-4e-1\n"))
    assert {name: column.tolist() for name, column in found.items()} == {
        "t": [0.5, 1.5],
        "uwb_m": [4.0, -0.4],
    }


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t,m\n1,2\n3,four\n", "some.csv line 3: .*four"),
        ("t,m\n1,2\n3,4\n5\n", "some.csv line 4: 1 cells, not 2"),
        ("t,m\n1,2\n3,4,5\n", "some.csv line 3: 3 cells, not 2"),
        ("t,m\n1,2\n3,nan\n", "some.csv line 3: nan is not a finite number"),
        ("t,t\n1,2\n3,4\n", "some.csv: two columns have the same name"),
        ("t,m\n# 9,9\n\n1,2\n3,x\n", "some.csv line 5: 'x' is not a number"),
        ("t,m\n1,2\n3,\n", "some.csv line 3: '' is not a number"),
        ("t,m\n1,2\n", "some.csv: fewer than two rows"),
        ("", "some.csv: fewer than two rows"),
    ],
)
def test_what_cannot_be_used_is_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(BadRecording, match=words):
        text_table.columns(written(tmp_path, text))


def test_comments_blanks_and_a_byte_order_mark_change_nothing(tmp_path: Path) -> None:
    found = text_table.columns(written(tmp_path, "\ufeff# made by x\n t, m \n\n1,2\n# more\n3,4\n"))
    assert {name: column.tolist() for name, column in found.items()} == {"t": [1, 3], "m": [2, 4]}
