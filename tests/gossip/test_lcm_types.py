"""The Python in drslamd/lcmtypes is what lcm-gen makes of the .lcm files beside it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from message_builders import HEADER

from drslamd import lcmtypes
from drslamd.gossip import messages
from drslamd.gossip.codecs import CODECS
from drslamd.slam.graph.public_poses import PublicPoses

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


@pytest.mark.parametrize("rank", [2, 5])
@pytest.mark.parametrize("n", [0, 1, 7])
def test_the_size_that_public_poses_state_is_the_one_that_is_sent(rank: int, n: int) -> None:
    text = (FOLDER / "public_poses_t.lcm").read_text()
    (stated,) = re.findall(r"// ([\w *+()]+)\n +int32_t +n_values;", text)
    values = np.zeros((n + 1, 2 * rank), dtype=complex)
    public = PublicPoses(3, 11, rank, tuple(range(n)), values)
    raw = lcmtypes.public_poses_t.decode(messages.encode(HEADER, public))
    assert raw.n_values == eval(stated, {"rank": raw.rank, "n": raw.n})
    assert messages.decode("PUBLIC", raw.encode()) == public


def test_every_type_is_part_of_what_robots_say() -> None:
    """From the structs of the messages through their fields."""
    said = {codec.struct.__name__ for codec in CODECS.values()}
    while True:
        kinds = [getattr(lcmtypes, name) for name in said]
        parts = {t.rsplit(".")[-1] for kind in kinds for t in kind.__typenames__ if "." in t}
        if parts <= said:
            break
        said |= parts
    for_whoever_steers = {"near_t"}
    assert {source.stem for source in FOLDER.glob("*.lcm")} == said | for_whoever_steers
