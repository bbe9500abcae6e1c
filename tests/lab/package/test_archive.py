"""One folder becomes one package, the same bytes each time."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from lab.package import archive
from lab.package.faults import MISSING, Unbuilt

CONTROL = {
    "control": "Package: x\nVersion: 1\nArchitecture: all\nMaintainer: a <a@b>\nDescription: x\n",
    "postinst": "#!/bin/sh\n",
}


def tree(folder: Path, umask: int) -> Path:
    before = os.umask(umask)
    try:
        for name in ("usr/bin/x", "usr/share/y"):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(name)
    finally:
        os.umask(before)
    return folder


def listed(deb: Path) -> dict[str, tuple[str, str, str]]:
    done = subprocess.run(
        ["dpkg-deb", "--contents", deb],
        env={**os.environ, "TZ": "UTC"},
        capture_output=True,
        text=True,
        check=True,
    )
    rows = (line.split() for line in done.stdout.splitlines())
    return {row[5]: (row[0], row[1], f"{row[3]} {row[4]}") for row in rows}


@pytest.fixture(autouse=True)
def needs_dpkg() -> None:
    if shutil.which("dpkg-deb") is None:
        pytest.skip("no dpkg-deb here")


def test_neither_umask_nor_hour_nor_place_change_a_byte(tmp_path: Path) -> None:
    for name, umask in (("a", 0o022), ("b", 0o077)):
        deb = tmp_path / f"{name}.deb"
        archive.pack(tree(tmp_path / name, umask), CONTROL, deb, 1_700_000_000)
        os.utime(tmp_path)
    assert (tmp_path / "a.deb").read_bytes() == (tmp_path / "b.deb").read_bytes()


def test_modes_owners_and_dates_are_those_of_a_package(tmp_path: Path) -> None:
    archive.pack(tree(tmp_path / "a", 0o077), CONTROL, tmp_path / "a.deb", 1_700_000_000)
    found = listed(tmp_path / "a.deb")
    then = "2023-11-14 22:13"
    assert found["./usr/bin/x"] == ("-rwxr-xr-x", "root/root", then)
    assert found["./usr/share/y"] == ("-rw-r--r--", "root/root", then)
    assert found["./usr/share/"] == ("drwxr-xr-x", "root/root", then)


def test_dpkg_gets_the_sum_of_every_file(tmp_path: Path) -> None:
    archive.pack(tree(tmp_path / "a", 0o022), CONTROL, tmp_path / "a.deb", 1)
    done = subprocess.run(
        ["dpkg-deb", "--info", tmp_path / "a.deb", "md5sums"], capture_output=True, check=True
    )
    (tmp_path / "sums").write_bytes(done.stdout)
    checked = subprocess.run(
        ["md5sum", "--check", tmp_path / "sums"],
        cwd=tmp_path / "a",
        capture_output=True,
        check=True,
    )
    assert checked.stdout.split() == [b"usr/bin/x:", b"OK", b"usr/share/y:", b"OK"]


def test_a_build_that_fails_leaves_the_older_package(tmp_path: Path) -> None:
    deb = tmp_path / "a.deb"
    deb.write_text("good")
    with pytest.raises(subprocess.CalledProcessError):
        archive.pack(tree(tmp_path / "a", 0o022), {"control": "nonsense"}, deb, 1)
    assert deb.read_text() == "good"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "a.deb"]


def test_without_dpkg_there_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(Unbuilt, match="apt install dpkg") as refused:
        archive.pack(tmp_path, CONTROL, tmp_path / "a.deb", 1)
    assert refused.value.code == MISSING == 69
