"""Mutants: what is changed, and that files find their tests."""

from __future__ import annotations

import pytest
from lab.hunt import mutants

TEXT = """
def inside(a, b):
    if a < 3 and b + 1 == 2:
        return True
    return not a
"""


def test_each_small_change_is_made_once() -> None:
    found = [mutants.mutant(TEXT, at) for at in mutants.places(TEXT)]
    assert sorted(m.what for m in found) == [
        "1 became 2",
        "2 became 3",
        "3 became 4",
        "Add became Sub",
        "Eq became NotEq",
        "Lt became LtE",
        "and became or",
        "it became False",
        "not was left out",
        "the question was turned round",
    ]
    assert len({m.text for m in found}) == len(found)


def test_texts_are_not_taken_apart() -> None:
    assert mutants.places('x = "a" + y\nz = y + b"c"\n') == []


def test_files_of_the_three_rooms_find_their_tests() -> None:
    names = mutants.names()
    assert {"gossip/seal.py", "sensors/device_clock.py", "slam/consistency/pcm.py"} <= set(names)
    assert "tests/gossip/test_seal.py" in mutants.tests_of("gossip/seal.py")
    assert mutants.tests_of("gossip/nothing.py") == []


def test_an_unknown_file_is_refused() -> None:
    with pytest.raises(SystemExit):
        mutants.main(["gossip/nothing.py"])
