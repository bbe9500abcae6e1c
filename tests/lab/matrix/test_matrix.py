"""The fault matrix: every row has a test that names it, and the page says which."""

from __future__ import annotations

import ast

import pytest
from lab.matrix import __main__ as command
from lab.matrix import measuring, page
from lab.matrix.rows import ROWS
from lab.soak import results

COUNTS = {"D": 11, "M": 10, "N": 12, "S": 12, "T": 5, "O": 14}


def test_there_are_64_rows() -> None:
    assert list(ROWS) == [f"{c}{k}" for c, most in COUNTS.items() for k in range(1, most + 1)]


def test_no_test_names_a_row_that_is_none() -> None:
    assert page.unknown(page.named_rows()) == []


def test_every_row_has_a_test() -> None:
    absent = set(page.missing(page.named_rows()))
    assert absent == set()


def test_the_page_is_what_the_markers_say() -> None:
    found = measuring.read(measuring.FOUND)
    made = page.page(page.named_rows(), results.read(page.RUNS), found)
    assert page.PAGE.read_text() == "\n".join(made) + "\n", "run tools/matrix"


def test_markers_are_found_at_tests_and_for_whole_files() -> None:
    text = 'pytestmark = pytest.mark.row("D1")\n@pytest.mark.row("N6")\ndef test_it(): ...\n'
    assert list(page._markers(ast.parse(text))) == [("D1", ""), ("N6", "test_it")]


def test_a_row_without_a_test_fails_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    everything = {row: ["test"] for row in ROWS}
    monkeypatch.setattr(page, "named_rows", lambda: everything)
    assert command.main(["--check"]) == 0
    del everything["N6"]
    assert command.main(["--check"]) == 1
    everything["N60"] = ["test"]
    assert command.main(["--check"]) == 1
    assert capsys.readouterr().out.splitlines()[-1].endswith("N6, N60")


def test_what_a_test_of_a_row_measured_is_kept(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Together with what other runs found; of several cases the worst counts."""
    told = pytester.path / "measured.json"
    measuring.write(told, {"tests/other.py::test": measuring.Found(["T1"], "passed", ["7 s"])})
    monkeypatch.setenv(measuring.WHERE, str(told))
    monkeypatch.setenv("PYTHONPATH", str(page.ROOT / "tools"))
    pytester.makeini("[pytest]\nmarkers =\n    row(name): a row\n")
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.row("D1")
        @pytest.mark.parametrize("n", [1, 2])
        def test_one(n, record_property):
            record_property("measured", f"{n} m")
            assert n == 1

        @pytest.mark.row("D2")
        @pytest.mark.row("D1")
        def test_two(): ...

        @pytest.mark.row("D2")
        def test_three(): pytest.skip("not here")

        def test_four(): ...
        """
    )
    pytester.runpytest_subprocess("-p", "lab.matrix.measuring")
    found = measuring.read(told)
    assert {name.split("::")[1]: one[1:] for name, one in found.items()} == {
        "test": ("passed", ["7 s"]),
        "test_one": ("failed", ["1 m", "2 m"]),
        "test_two": ("passed", []),
        "test_three": ("skipped", []),
    }
    assert page.kept("D1", found) == "1 of 2 tests passed; 1 m; 2 m"
    assert page.kept("D2", found) == "1 of 2 tests passed, 1 could not run here"
    assert page.kept("D3", found) == ""
    measuring.write(told, found)
    assert measuring.read(told) == found
