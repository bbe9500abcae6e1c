"""What cannot be made says why, and what to do."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path

import pytest
from places import REPOSITORY

from drslamd.host.unmade import REMEDIES, unmade


@pytest.mark.parametrize("number", sorted(REMEDIES))
def test_every_cause_has_its_remedy(number: int, tmp_path: Path) -> None:
    path = tmp_path / "no" / "file"
    said = unmade(path, OSError(number, os.strerror(number)))
    cause, _, remedy = said.partition("; ")
    assert cause == f"{path}: {os.strerror(number)}"
    assert remedy == REMEDIES[number].format(folder=path.parent)
    assert len(remedy) > 5


def test_a_folder_that_is_there_is_not_to_be_made(tmp_path: Path) -> None:
    gone = FileNotFoundError(errno.ENOENT, "No such file or directory")
    assert "mkdir -p" in unmade(tmp_path / "no" / "file", gone)
    assert "mkdir" not in unmade(tmp_path / "file", gone)


def test_what_has_no_number_is_said_in_its_own_words() -> None:
    assert unmade("x", OSError("too strange")).startswith("x: too strange; ")


def test_no_verb_says_a_cause_of_the_kernel_without_a_remedy() -> None:
    """The sentence ends with `strerror`: what was to be done would be missing."""
    bare = re.compile(r"strerror[^\n}]*}\"")
    verbs = (REPOSITORY / "drslamd" / "cli").rglob("*.py")
    assert [path.name for path in verbs if bare.search(path.read_text())] == []
