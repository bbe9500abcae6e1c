"""tools/package: exit codes and sentences."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab.package import __main__ as package
from lab.package import environment, tree
from lab.package.faults import MISSING, Unbuilt


def test_wrong_usage_ends_with_2() -> None:
    with pytest.raises(SystemExit) as ended:
        package.main(["--arch", "mips"])
    assert ended.value.code == 2


@pytest.mark.parametrize("code", [1, MISSING])
def test_a_package_that_cannot_be_built_is_a_sentence(
    code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object) -> None:
        raise Unbuilt("no network", code)

    monkeypatch.setattr(tree, "build", refuse)
    assert package.main(["--out", str(tmp_path / "out")]) == code
    assert capsys.readouterr().err.endswith("no network\n")
    assert not (tmp_path / "out").exists()


def test_pins_that_cannot_be_chosen_leave_those_that_are(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise Unbuilt("no network")

    before = environment.VERSIONS.read_text()
    monkeypatch.setattr(environment, "install", refuse)
    assert package.main(["--pin"]) == 1
    assert environment.VERSIONS.read_text() == before
