"""The copyright file: our licence, and the text of each library's."""

from __future__ import annotations

import textwrap
from importlib.metadata import Distribution, PackageMetadata
from pathlib import Path

from lab.package.environment import ROOT, installed

HEAD = """\
drslamd

{licence}
This package also holds the libraries below, as their authors published them on pypi.org, without
their tests. Each has a licence of its own.
"""


def take_out(target: Path) -> str:
    """The text of the copyright file; the files that it repeats leave `target`."""
    parts = [HEAD.format(licence=(ROOT / "drslamd" / "LICENSE").read_text())]
    for one in installed(target):
        if one.metadata["Name"] != "drslamd":
            parts.append(_of(one, target))
    for path in _texts(target):
        if not any(folder.name.endswith(".dist-info") for folder in path.parents):
            parts.append(f"{'=' * 78}\n{path.relative_to(target)}\n\n{_read(path)}")
        path.unlink()
    return "\n".join(parts)


def _of(one: Distribution, target: Path) -> str:
    """Name, place, licence, and the texts that came with it."""
    about = one.metadata
    home = _first(about, "Home-page") or _first(about, "Project-URL") or "pypi.org"
    licence = _first(about, "License-Expression") or _first(about, "License").split("\n")[0]
    classified = [c for c in about.get_all("Classifier") or () if c.startswith("License ::")]
    named = licence or "; ".join(c.rpartition(" :: ")[2] for c in classified) or "see below"
    place = home.rpartition(", ")[2]
    head = f"{'=' * 78}\n{about['Name']} {one.version}, {place}\nLicence: {named}\n"
    folders = [target / str(path.parts[0]) for path in one.files or () if path.name == "METADATA"]
    texts = [path for path in _texts(target) if any(f in path.parents for f in folders)]
    return "\n".join([head, *(_read(path) for path in texts)])


def _first(about: PackageMetadata, field: str) -> str:
    """An absent field is empty: since Python 3.12 asking for one by brackets is a warning."""
    return next(iter(about.get_all(field) or ()), "")


def _read(path: Path) -> str:
    return textwrap.dedent(path.read_text(errors="replace"))


def _texts(target: Path) -> list[Path]:
    """Files that hold a licence."""
    names = ("LICEN", "COPYING", "NOTICE", "AUTHORS")
    return sorted(
        path
        for path in target.rglob("*")
        if path.is_file() and path.suffix != ".py" and path.name.upper().startswith(names)
    )
