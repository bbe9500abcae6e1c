"""Directions and scales of the wheels."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.wheel_mounting import wheel_mounting


@pytest.mark.parametrize(("scale", "words"), [(0.1, ""), (0.2, "by 0.80"), (-0.25, "by 1.25")])
def test_ways_that_ranges_find_shorter_or_longer_name_the_factor(scale: float, words: str) -> None:
    case = Case()
    case.now["graph"]["wheel_scale"] = {"3": scale}
    said = found(wheel_mounting, case)
    assert bool(said) is bool(words)
    assert all(f"divide wheels.counts_per_metre {words}" in sentence for sentence in said)


@pytest.mark.parametrize(("turn", "words"), [(-0.1, ""), (0.3, "1.30"), (-0.5, "0.50")])
def test_turns_that_ranges_find_other_name_the_factor_of_the_track(turn: float, words: str) -> None:
    case = Case()
    case.now["graph"]["wheel_turn"] = {"3": turn}
    said = found(wheel_mounting, case)
    assert bool(said) is bool(words)
    assert all(f"divide wheels.track_m by {words}" in sentence for sentence in said)


def test_what_the_search_for_mistakes_named_is_repeated() -> None:
    case = Case()
    case.say("mounting", "the wheels of robot 3 run backwards on the left (set ...)")
    assert found(wheel_mounting, case) == [
        "the wheels of robot 3 run backwards on the left (set ...)"
    ]
