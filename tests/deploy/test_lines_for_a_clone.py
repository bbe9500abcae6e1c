"""The first page's lines for a clone make a program; test_systemd_box types those that follow."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from deploy_helpers import REPOSITORY, lines_on_a_robot

from drslamd import __version__

PROGRAM = 3
"""Lines that make the program; those that follow install what the service needs."""


def test_the_first_lines_are_those_of_the_program() -> None:
    is_program = [" /opt/drslamd" in line for line in lines_on_a_robot()[1]]
    assert is_program == [True] * PROGRAM + [False] * (len(is_program) - PROGRAM)


@pytest.mark.slow
def test_they_make_a_program_with_everything_for_can(tmp_path: Path) -> None:
    clone, opt, bin_ = (tmp_path / name for name in ("clone", "opt", "bin"))
    bin_.mkdir()
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(REPOSITORY / "drslamd", clone / "drslamd", ignore=ignore)
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(REPOSITORY / name, clone)
    environment = {**os.environ, "PYTHONPATH": ""}
    for line in lines_on_a_robot()[1][:PROGRAM]:
        here = line.removeprefix("sudo ").replace("/opt/drslamd", str(opt))
        here = here.replace("/usr/local/bin", str(bin_))
        done = subprocess.run(
            ["sh", "-c", here],
            cwd=clone,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if "No matching distribution" in done.stderr:
            pytest.skip("pip finds no libraries here")
        assert done.returncode == 0, f"{line}: {done.stderr}"
    said = subprocess.run(
        [bin_ / "drslamd", "--version"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        check=True,
    )
    assert said.stdout.decode() == f"drslamd {__version__}\n"
    check = "import can, cantools, scipy, serial"
    subprocess.run([opt / "bin" / "python", "-c", check], cwd=tmp_path, env=environment, check=True)
