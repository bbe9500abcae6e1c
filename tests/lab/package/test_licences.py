"""The copyright file holds the text of every licence, and takes it from the libraries."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab.package import licences


@pytest.fixture
def libraries(tmp_path: Path) -> Path:
    for name, about, text in (
        ("some_lib-1.0", "Name: some-lib\nVersion: 1.0\nLicense-Expression: MIT\n", "be free"),
        ("drslamd-2.0", "Name: drslamd\nVersion: 2.0\n", "ours again"),
        (
            "old-3",
            "Name: old\nVersion: 3\nClassifier: License :: OSI Approved :: BSD License\n",
            "",
        ),
    ):
        folder = tmp_path / f"{name}.dist-info"
        (folder / "licenses").mkdir(parents=True)
        (folder / "METADATA").write_text(about)
        (folder / "RECORD").write_text(f"{name}.dist-info/METADATA,,\n")
        if text:
            (folder / "licenses" / "LICENSE.txt").write_text(text)
    (tmp_path / "license.py").write_text("code")
    (tmp_path / "some_lib").mkdir()
    (tmp_path / "some_lib" / "LICENSE.md").write_text("of what it took over")
    return tmp_path


def test_each_library_is_named_with_its_licence(libraries: Path) -> None:
    text = licences.take_out(libraries)
    assert text.startswith("drslamd\n\nMIT License\n")
    assert "some-lib 1.0, pypi.org\nLicence: MIT\n\nbe free" in text
    assert "old 3, pypi.org\nLicence: BSD License\n" in text
    assert "some_lib/LICENSE.md\n\nof what it took over" in text
    assert "ours again" not in text


def test_what_is_repeated_there_is_not_installed_twice(libraries: Path) -> None:
    licences.take_out(libraries)
    assert not list(libraries.rglob("LICENSE*"))
    assert (libraries / "license.py").exists()
