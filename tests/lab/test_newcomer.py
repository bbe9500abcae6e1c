"""A scripted newcomer: what the first page has one type leads to robots that move on a map."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pages
import pytest
from namespace import hindrance
from places import REPOSITORY

pytest.importorskip("aiohttp", reason="aiohttp is not installed")

import newcomer
from browser import CHROMIUM

MOST_COMMANDS = 5


def clone() -> list[str]:
    """From git clone to the folder in which the commands of the first page are typed."""
    return [f"git -c safe.directory='*' clone --quiet {REPOSITORY} drslamd", "cd drslamd"]


def first_command() -> str:
    """The first line under "Two commands", without its remark."""
    page = pages.read("README.md", (REPOSITORY / "README.md").read_text())
    (block,) = (block for block in page.blocks if block.startswith("tools/demo"))
    return block.splitlines()[0].partition("#")[0].strip()


def lend_environment() -> str:
    """What is installed here, so that nothing is loaded from the network once more."""
    stamp = ".venv/.lab-$(cksum <pyproject.toml | tr ' ' '-')"
    own = " ".join(str(Path(sys.prefix) / name) for name in ("bin", "lib", "pyvenv.cfg"))
    return f"mkdir .venv; ln -s {own} .venv; touch {stamp}"


def test_it_takes_at_most_five_commands() -> None:
    assert len([*clone(), first_command()]) <= MOST_COMMANDS


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium is installed")
def test_from_git_clone_to_a_moving_map(tmp_path: Path) -> None:
    if hindrance() or not (REPOSITORY / ".git").exists():
        pytest.skip(hindrance() or "not a git checkout")
    lines = [*clone(), lend_environment(), first_command()]
    done = subprocess.run(
        ["unshare", "-rn", sys.executable, newcomer.__file__, str(tmp_path), *lines],
        capture_output=True,
        text=True,
        timeout=newcomer.PATIENCE_S,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    log = tmp_path / "log"
    assert done.returncode == 0, done.stderr + (log.read_text() if log.exists() else "")
    seen = json.loads(done.stdout)
    assert seen["url"] == "http://127.0.0.1:8808/"
    assert seen["complaints"] == []
    print(f"a moving map after {seen['seconds']:.0f} s")
