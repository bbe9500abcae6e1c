"""The table of readers in tools/README.md is the one that the program has."""

from __future__ import annotations

import re

from lab.recordings.readers import EDGE_FILE, READERS
from places import REPOSITORY

ROWS = re.findall(
    r"^\| (.+?) \| `(lab/[\w/]+\.py)` \| ",
    (REPOSITORY / "tools" / "README.md").read_text(),
    flags=re.MULTILINE,
)


def test_every_ending_that_is_read_has_a_row_and_no_row_is_left_over() -> None:
    endings = {kind.strip("`") for kind, _ in ROWS if kind.startswith("`.")}
    assert endings == set(READERS)


def test_folders_are_in_the_table_too() -> None:
    assert any("folder" in kind or EDGE_FILE in kind for kind, _ in ROWS)


def test_every_row_names_a_reader_that_is_there() -> None:
    for _, file in ROWS:
        assert "def read(" in (REPOSITORY / "tools" / file).read_text(), file
