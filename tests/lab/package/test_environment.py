"""The libraries that come with the program."""

from __future__ import annotations

import re
from importlib.metadata import requires
from pathlib import Path

import pytest
from lab.package import environment
from lab.package.faults import Unbuilt

PINS = dict(line.split("==") for line in environment.VERSIONS.read_text().split())


def test_every_library_of_a_robot_has_a_pin() -> None:
    wanted = [
        line for line in requires("drslamd") or () if "extra ==" not in line or "'can'" in line
    ]
    names = {re.match(r"[\w-]+", line).group().lower() for line in wanted}  # type: ignore[union-attr]
    assert {"numpy", "pydantic", "pyserial"} <= names
    assert names - {"drslamd"} <= set(PINS)


def test_the_package_holds_what_a_robot_may_want_and_no_more() -> None:
    assert "can" in environment.extras()
    assert {"test", "lab"}.isdisjoint(environment.extras())


def test_what_a_robot_never_loads_goes(tmp_path: Path) -> None:
    stays = ["numpy/core.py", "numpy-1.dist-info/METADATA", "lcm/types.lcm", "can/lib/x.py"]
    goes = ["bin/f2py", "numpy/tests/x.py", "numpy/a.pyi", "numpy-1.dist-info/RECORD", "lib/x.so"]
    for name in stays + goes:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    (tmp_path / "empty" / "inside").mkdir(parents=True)
    environment.trim(tmp_path)
    left = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert left == set(stays)
    assert not (tmp_path / "empty").exists()


@pytest.mark.parametrize(
    ("needed", "packages"),
    [
        (["libc.so.6", "libm.so.6"], {"libc6"}),
        (["libglib-2.0.so.0", "libown.so"], {"libglib2.0-0"}),
    ],
)
def test_what_libraries_need_of_the_system_is_said_by_its_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, needed: list[str], packages: set[str]
) -> None:
    (tmp_path / "libown.so").touch()
    monkeypatch.setattr(environment, "_dynamic", lambda path, kind: needed)
    assert environment.system_packages(tmp_path) == packages


def test_a_library_that_nobody_knows_stops_the_build(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.so").touch()
    monkeypatch.setattr(environment, "_dynamic", lambda path, kind: ["libX11.so.6"])
    with pytest.raises(Unbuilt, match=r"a\.so wants libX11\.so\.6"):
        environment.system_packages(tmp_path)


def test_a_search_path_outside_the_package_is_taken_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.so"
    path.write_bytes(b"ELF /opt/build/lib\0rest $ORIGIN/../b\0")
    monkeypatch.setattr(
        environment, "_dynamic", lambda path, kind: ["/opt/build/lib", "$ORIGIN/../b"]
    )
    environment.trim(tmp_path)
    assert path.read_bytes() == b"ELF " + bytes(15) + b"rest $ORIGIN/../b\0"


def test_a_library_without_a_pin_stops_the_build(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def pip(*arguments: str) -> None:
        about = tmp_path / "new_one-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Name: new_one\nVersion: 1.0\n")

    monkeypatch.setattr(environment, "_pip", pip)
    monkeypatch.setattr(environment, "_own_wheel", lambda folder: folder / "x.whl")
    with pytest.raises(Unbuilt, match=r"does not pin new-one==1\.0; tools/package --pin does"):
        environment.install(tmp_path, "amd64")


def test_a_pip_that_fails_is_one_sentence_with_its_reason() -> None:
    with pytest.raises(Unbuilt, match=r"^pip install ended with 1: ERROR: none\.whl is not"):
        environment._pip("install", "--no-index", "/nowhere/none.whl")
