"""The project file: the licence travels with the program, and everybody has the same linters."""

from __future__ import annotations

import importlib.metadata
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
import tomli
from places import REPOSITORY

TEXT = (REPOSITORY / "drslamd" / "LICENSE").read_text()
PROJECT = tomli.loads((REPOSITORY / "pyproject.toml").read_text())
BUILD = "from setuptools import build_meta as b; b.build_wheel({0!r}); b.build_sdist({0!r})"


def least_setuptools() -> int:
    """The one that the project file asks for knows `license-files`."""
    (wanted,) = PROJECT["build-system"]["requires"]
    return int(wanted.removeprefix("setuptools>="))


def test_the_text_is_the_one_that_the_project_names() -> None:
    assert PROJECT["project"]["license"] == "MIT"
    assert PROJECT["project"]["license-files"] == ["drslamd/LICENSE"]
    assert TEXT.startswith("MIT License\n\nCopyright (c) 2026 drslamd developers\n\nPermission ")
    assert "[drslamd/LICENSE](drslamd/LICENSE)" in (REPOSITORY / "README.md").read_text()


@pytest.mark.parametrize("linter", ["ruff", "mypy"])
def test_a_linter_is_the_same_for_everybody(linter: str) -> None:
    wanted = PROJECT["project"]["optional-dependencies"]["test"]
    assert f"{linter}=={importlib.metadata.version(linter)}" in wanted


@pytest.mark.slow
def test_wheel_and_source_archive_hold_the_licence(tmp_path: Path) -> None:
    found = int(importlib.metadata.version("setuptools").split(".")[0])
    if found < least_setuptools():
        pytest.skip(f"setuptools {found} is too old to build with, {least_setuptools()} is wanted")
    source, built = tmp_path / "source", tmp_path / "built"
    # a copy, because a build leaves folders behind
    for name in ("pyproject.toml", "README.md"):
        source.mkdir(exist_ok=True)
        shutil.copy(REPOSITORY / name, source)
    shutil.copytree(
        REPOSITORY / "drslamd", source / "drslamd", ignore=shutil.ignore_patterns("__pycache__")
    )
    built.mkdir()
    subprocess.run(
        [sys.executable, "-c", BUILD.format(str(built))],
        cwd=source,
        check=True,
        capture_output=True,
        timeout=300,
    )
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if re.search(r"\.dist-info/licenses/.*LICENSE", n))
        assert archive.read(name).decode() == TEXT
        (about,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        metadata = archive.read(about).decode().splitlines()
    assert {"License-Expression: MIT", "License-File: drslamd/LICENSE"} <= set(metadata)
    (archive_path,) = built.glob("*.tar.gz")
    with tarfile.open(archive_path) as sources:
        (member,) = (m for m in sources.getmembers() if m.name.endswith("/drslamd/LICENSE"))
        file = sources.extractfile(member)
        assert file is not None
        assert file.read().decode() == TEXT
