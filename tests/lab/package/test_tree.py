"""What the package installs beside the libraries."""

from __future__ import annotations

import gzip
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from lab.package import completion, tree
from places import REPOSITORY

from drslamd import __version__

SCRIPTS = ("postinst", "prerm", "postrm")


def test_the_unit_differs_from_that_of_a_clone_in_program_and_pages() -> None:
    ours = tree.unit().splitlines()
    theirs = (REPOSITORY / "systemd" / "drslamd@.service").read_text().splitlines()
    changed = [(a, b) for a, b in zip(theirs, ours, strict=True) if a != b]
    assert [new for _, new in changed] == [
        "Documentation=man:drslamd(1) man:drslamd.toml(5)",
        "ExecStart=/usr/bin/drslamd run -c /etc/drslamd/%i.toml",
    ]


def test_the_log_of_changes_is_that_of_this_version() -> None:
    text = tree.changes()
    assert text.startswith(f"drslamd ({__version__}-1) unstable; urgency=medium\n")
    assert re.search(r"^ -- .+ <.+>  \w{3}, \d\d \w{3} \d{4} 00:00:00 \+0000$", text, re.M)


def test_the_date_is_what_the_environment_says_else_that_of_the_commit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "17")
    assert tree.source_epoch() == 17
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    assert tree.source_epoch() == tree.source_epoch() > 1_700_000_000
    monkeypatch.setenv("PATH", "")  # no git: the day of the newest version
    assert tree.source_epoch() % 86_400 == 0


def test_help_lies_where_shells_and_man_look(tmp_path: Path) -> None:
    tree.help_in_place(tmp_path, 1_700_000_000)
    found = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert set(completion.SHELLS.values()) <= found
    assert {"usr/share/man/man1/drslamd.1.gz", "usr/share/man/man5/drslamd.toml.5.gz"} <= found
    packed = (tmp_path / "usr/share/man/man1/drslamd.1.gz").read_bytes()
    assert packed[4:8] == bytes(4)  # no hour of the build
    assert gzip.decompress(packed).startswith(b".TH DRSLAMD 1 2023-11-14 ")


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_of_the_package_can_be_read_and_ends_at_the_first_fault(name: str) -> None:
    path = tree.DEBIAN / name
    assert path.read_text().startswith("#!/bin/sh\nset -e\n")
    subprocess.run(["sh", "-n", path], check=True)
    if shutil.which("shellcheck") is not None:
        subprocess.run(["shellcheck", path], check=True)


@pytest.mark.parametrize("name", SCRIPTS)
def test_no_script_asks_a_systemd_or_udev_that_does_not_run(name: str) -> None:
    """In an image that is being built there is neither."""
    depth = [0]
    for line in (tree.DEBIAN / name).read_text().splitlines():
        if line.strip().startswith("if "):
            depth.append(depth[-1] + ("/run/" in line))
        elif line.strip() == "fi":
            depth.pop()
        elif re.search(r"\b(systemctl|deb-systemd-invoke|udevadm)\b", line):
            assert depth[-1] > 0, line
