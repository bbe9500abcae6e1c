"""The fault matrix: every row has a test that names it, and the page says which."""

from __future__ import annotations

import ast

import pytest
from lab.matrix import __main__ as command
from lab.matrix import page
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
    made = page.page(page.named_rows(), results.read(page.RUNS))
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
