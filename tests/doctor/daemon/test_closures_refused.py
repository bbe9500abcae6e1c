"""Closures that do not agree."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.closures_refused import closures_refused


@pytest.mark.parametrize(
    ("kept", "seen", "is_found"), [(4, 8, False), (3, 8, True), (0, 7, False), (0, 20, True)]
)
def test_fewer_than_half_of_enough_closures_is_a_finding(
    kept: int, seen: int, is_found: bool
) -> None:
    case = Case()
    case.now["pairs"]["1"] |= {"closures_kept": kept, "closures_seen": seen}
    assert bool(found(closures_refused, case)) is is_found


def test_the_worst_partner_and_the_gate_are_named() -> None:
    case = Case()
    pair = case.now["pairs"]["1"]
    case.now["pairs"] = {
        "1": {**pair, "closures_kept": 3, "closures_seen": 9},
        "2": {**pair, "closures_kept": 1, "closures_seen": 9},
    }
    (said,) = found(closures_refused, case)
    assert said.startswith("of 9 closures with robot 2 1 agree (gate: chi-squared 6.3 at ")
