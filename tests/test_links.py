"""Links in the repository's pages: files that are there, headings that are there."""

from __future__ import annotations

import re
import subprocess

import pytest
from places import REPOSITORY

LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
CODE = re.compile(r"^    .*$|`[^`]*`", re.MULTILINE)


def pages() -> list[str]:
    """All that is tracked, or all that is there but what tools make, without git."""
    tracked = subprocess.run(
        ["git", "ls-files", "*.md"], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    if tracked.returncode == 0:
        return tracked.stdout.split()
    found = (path.relative_to(REPOSITORY) for path in REPOSITORY.rglob("*.md"))
    return sorted(str(path) for path in found if not path.parts[0].startswith((".", "out")))


def anchors(text: str) -> set[str]:
    """Of all headings, as GitHub makes them: lower case, no punctuation, hyphens for spaces."""
    words = (re.sub(r"[^\w\- ]", "", title.lower()) for title in HEADING.findall(text))
    return {word.replace(" ", "-") for word in words}


def test_there_are_pages() -> None:
    assert {"README.md", "tools/README.md", "tools/lab/README.md"} <= set(pages())


@pytest.mark.parametrize("page", pages())
def test_every_link_leads_to_a_file_and_a_heading_that_exist(page: str) -> None:
    path = REPOSITORY / page
    text = path.read_text()
    for link in LINK.findall(CODE.sub("", text)):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = path.parent / name if name else path
        assert target.resolve().is_relative_to(REPOSITORY), f"{link} leads out of the repository"
        assert target.exists(), f"{link}: no such file"
        if anchor:
            assert anchor in anchors(target.read_text()), f"{link}: no such heading"


def test_links_and_headings_are_found() -> None:
    """The test's own eyes."""
    text = "# The paper's `tau`, 10 Hz\n\nsee [a\nb](c.md#d) and ![e](f.svg)\n\n    [no](g)\n"
    assert LINK.findall(CODE.sub("", text)) == ["c.md#d", "f.svg"]
    assert anchors(text) == {"the-papers-tau-10-hz"}
