"""The type jar for lcm-spy."""

from __future__ import annotations

import os
import shutil
import sysconfig
import zipfile
from pathlib import Path

import pytest
from lab import spy
from places import REPOSITORY


@pytest.mark.slow
def test_the_jar_holds_a_class_for_every_type(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for tool in ("javac", "jar"):
        if shutil.which(tool) is None:
            pytest.skip(f"no {tool} here; apt install default-jdk-headless")
    jar = tmp_path / "new" / "types.jar"
    assert spy.main(["--build", "--jar", str(jar)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(jar)
    names = set(zipfile.ZipFile(jar).namelist())
    types = (REPOSITORY / "drslamd" / "lcmtypes").glob("*.lcm")
    wanted = {f"drslamd/lcmtypes/{path.stem}.class" for path in types}
    assert len(wanted) >= 10
    assert wanted <= names
    assert not [name for name in names if name.endswith(".java")]


@pytest.mark.parametrize(
    ("hidden", "remedy"),
    [
        ("javac", "javac is not installed; apt install default-jdk-headless\n"),
        ("jar", "jar is not installed; apt install default-jdk-headless\n"),
        ("lcm-gen", "lcm-gen is not installed; pip install lcm\n"),
    ],
)
def test_a_program_that_is_missing_ends_with_69_and_names_its_package(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    hidden: str,
    remedy: str,
) -> None:
    for name in {"javac", "jar", "lcm-gen"} - {hidden}:
        (tmp_path / name).symlink_to("/bin/true")
    monkeypatch.setenv("PATH", str(tmp_path))
    paths = {"scripts": os.devnull, "purelib": sysconfig.get_path("purelib")}
    monkeypatch.setattr("sysconfig.get_path", paths.__getitem__)
    assert spy.main(["--build", "--jar", str(tmp_path / "types.jar")]) == spy.MISSING == 69
    assert capsys.readouterr().err == remedy


def test_wrong_usage_ends_with_2() -> None:
    with pytest.raises(SystemExit) as ended:
        spy.main(["--bild"])
    assert ended.value.code == 2
