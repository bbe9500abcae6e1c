"""The page of changes: its newest entry is this version, and entries fall in order."""

from __future__ import annotations

import re

from places import REPOSITORY

from drslamd import __version__

TEXT = (REPOSITORY / "tools" / "CHANGELOG.md").read_text()
ENTRIES = re.findall(r"^## (\S+) - (\d{4}-\d\d-\d\d)$", TEXT, re.MULTILINE)


def test_the_newest_entry_is_the_version_of_the_package() -> None:
    assert ENTRIES[0][0] == __version__


def test_entries_go_back_in_time_and_in_number() -> None:
    numbers = [[int(part) for part in version.split(".")] for version, _ in ENTRIES]
    assert len(ENTRIES) == len(re.findall("^## ", TEXT, re.MULTILINE))
    assert numbers == sorted(numbers, reverse=True)
    assert len({version for version, _ in ENTRIES}) == len(ENTRIES)
    assert [date for _, date in ENTRIES] == sorted((d for _, d in ENTRIES), reverse=True)


def test_every_change_has_a_kind() -> None:
    kinds = set(re.findall(r"^### (.+)$", TEXT, re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
