"""Completion: every verb and option in every shell, and shells that do take the scripts."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from command_lines import PARSERS
from lab.package import completion

from drslamd import cli

SCRIPTS = completion.scripts(cli.parser())


def script(shell: str) -> str:
    return SCRIPTS[completion.SHELLS[shell]]


def run(shell: str, script_file: Path, text: str) -> list[str]:
    """What a shell says that has read the script."""
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    done = subprocess.run(
        [shell, "-c", f"source {script_file}; {text}"],
        cwd=script_file.parent,
        env={"PATH": "/usr/bin:/bin", "HOME": str(script_file.parent)},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


def bash(folder: Path, *words: str) -> set[str]:
    """What bash offers for the last of the words."""
    path = folder / "completion"
    path.write_text(script("bash"))
    quoted = " ".join(f"'{word}'" for word in words)
    text = f"COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; _shtab_drslamd; "
    return set(run("bash", path, text + 'printf "%s\\n" "${COMPREPLY[@]}"'))


@pytest.mark.parametrize("shell", completion.SHELLS)
@pytest.mark.parametrize("prog", PARSERS)
def test_every_verb_and_option_is_in_every_script(shell: str, prog: str) -> None:
    text = script(shell)
    options = re.findall(r"(?<![\w-])--[a-z][\w-]*", PARSERS[prog].format_usage())
    for word in [*options, prog.split()[-1]]:
        assert word.removeprefix("--") in text


def test_bash_completes_verbs_options_files_and_folders(tmp_path: Path) -> None:
    (tmp_path / "team.toml").touch()
    (tmp_path / "tracks").mkdir()
    assert bash(tmp_path, "drslamd", "st") == {"status"}
    assert {"--config", "--json"} <= bash(tmp_path, "drslamd", "status", "--")
    assert bash(tmp_path, "drslamd", "status", "-c", "te") == {"team.toml"}
    assert bash(tmp_path, "drslamd", "trajectory", "--tum", "t") == {"tracks"}


def test_zsh_can_read_its_script(tmp_path: Path) -> None:
    path = tmp_path / "_drslamd"
    path.write_text(script("zsh"))
    assert script("zsh").startswith("#compdef drslamd\n")
    if shutil.which("zsh") is None:
        pytest.skip("no zsh here")
    subprocess.run(["zsh", "-n", path], check=True)


def test_fish_completes_a_verb(tmp_path: Path) -> None:
    path = tmp_path / "drslamd.fish"
    path.write_text(script("fish"))
    offered = run("fish", path, "complete -C 'drslamd st'")
    assert [line.split("\t")[0] for line in offered] == ["status"]
