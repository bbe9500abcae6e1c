"""The Python in drslamd/lcmtypes is what lcm-gen makes of the .lcm files beside it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from drslamd import lcmtypes
from drslamd.gossip.codecs import CODECS

FOLDER = Path(lcmtypes.__file__).parent
LCM_GEN = Path(sys.executable).parent / "lcm-gen"


def test_the_generated_types_are_those_of_the_lcm_files(tmp_path: Path) -> None:
    if not LCM_GEN.exists():
        pytest.skip(f"no {LCM_GEN}: pip install lcm")
    sources = sorted(FOLDER.glob("*.lcm"))
    subprocess.run([LCM_GEN, "-p", "--ppath", tmp_path, *sources], check=True, timeout=30)
    fresh = {p.name: p.read_text() for p in (tmp_path / "drslamd" / "lcmtypes").glob("*.py")}
    assert {p.name: p.read_text() for p in FOLDER.glob("*.py")} == fresh


def test_every_type_is_explained_and_has_a_file_of_its_own() -> None:
    for source in FOLDER.glob("*.lcm"):
        text = source.read_text()
        assert text.startswith("package drslamd.lcmtypes;\n\n// "), source.name
        assert f"\nstruct {source.stem}\n{{" in text, source.name


def test_every_type_is_part_of_what_robots_say() -> None:
    """From the structs of the messages through their fields."""
    said = {codec.struct.__name__ for codec in CODECS.values()}
    while True:
        kinds = [getattr(lcmtypes, name) for name in said]
        parts = {t.rsplit(".")[-1] for kind in kinds for t in kind.__typenames__ if "." in t}
        if parts <= said:
            break
        said |= parts
    assert {source.stem for source in FOLDER.glob("*.lcm")} == said
