"""The pages of the repository: their blocks of code, and what they name in running text."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path
from typing import NamedTuple

from places import REPOSITORY

ROOMS = ("drslamd", "etc", "systemd", "tools", "tests")
FENCE = "```"


class Page(NamedTuple):
    """One Markdown file: fenced and indented blocks, and the spans between backticks."""

    name: str
    blocks: list[str]
    spans: list[str]


def pages() -> list[Page]:
    """Of the whole repository."""
    paths = [*REPOSITORY.glob("*.md"), *(p for room in ROOMS for p in path_of(room).rglob("*.md"))]
    return [read(str(p.relative_to(REPOSITORY)), p.read_text()) for p in sorted(paths)]


def path_of(room: str) -> Path:
    return REPOSITORY / room


def read(name: str, text: str) -> Page:
    """A page from its text."""
    blocks: list[list[str]] = []
    prose: list[str] = []
    fenced = inside = False
    before = ""
    for line in text.splitlines():
        if line.startswith(FENCE):
            fenced, inside = not fenced, False
            blocks += [[]] if fenced else []
        elif fenced:
            blocks[-1].append(line)
        elif line.startswith("    ") and (inside or not before.strip()):
            blocks += [] if inside else [[]]
            blocks[-1].append(line)
            inside = True
        elif inside and not line.strip():
            blocks[-1].append("")
        else:
            inside = False
            prose.append(line)
        before = line
    spans = [" ".join(span.split()) for span in re.findall("`([^`]+)`", "\n".join(prose))]
    return Page(name, [textwrap.dedent("\n".join(block)).strip() for block in blocks], spans)
