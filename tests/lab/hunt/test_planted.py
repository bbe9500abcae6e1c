"""Planted bugs: each still has its place, and a row that catches it."""

from __future__ import annotations

import ast

import pytest
from lab.hunt import planted
from lab.hunt.copies import ROOT, copied
from lab.hunt.plants import PLANTS, TEN, Plant


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_each_bug_has_one_place_and_leaves_a_program(plant: Plant) -> None:
    sound = (ROOT / "drslamd" / plant.path).read_text()
    bad = planted.broken(sound, plant)
    ast.parse(bad)
    assert bad != sound
    assert all((ROOT / "tests" / test).exists() for test in plant.tests)


def test_the_ten_of_the_plan_are_among_them() -> None:
    assert len(TEN) == 10
    assert len(PLANTS) >= 24


def test_a_bug_whose_place_is_gone_is_a_fault_of_the_table() -> None:
    with pytest.raises(AssertionError, match="0 such places"):
        planted.broken("", TEN[0])


@pytest.mark.slow
def test_a_planted_bug_is_caught_by_its_row_and_taken_out_again() -> None:
    plant = PLANTS["unbounded-dict"]
    with copied() as folder:
        path = folder / "drslamd" / plant.path
        sound = path.read_text()
        rows, test = planted.verdict(folder, plant)
        assert path.read_text() == sound
    assert (rows, test) == ("O11", "test_there_is_an_end_to_how_many_are_held")


def test_an_unknown_bug_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        planted.main(["no-such-bug"])
    assert "'no-such-bug' is none of" in capsys.readouterr().err
