"""Of which pairs something can be measured, and from when on."""

from __future__ import annotations

from typing import Any

import pytest
from front_scenes import SECONDS, FrontScene

from drslamd.conventions import GRID_US, Segment
from drslamd.slam.consistency.measurable import Measurable, behind_lapses
from drslamd.slam.graph.estimate import Lapse, TeamEstimate


def pairs() -> list[Measurable]:
    """Robot 0 and its peer 1."""
    scene = FrontScene()
    scene.drive(SECONDS)
    scene.module1()
    front: Any = scene.front
    found: list[Measurable] = front._measurable([scene.neighbour()], scene.graph, scene.utime)
    return found


def with_lapses(*lapses: Lapse) -> TeamEstimate:
    return TeamEstimate(Segment(0, 1, 0), {}, lapses=lapses)


def test_without_lapses_all_that_was_driven_counts() -> None:
    found = pairs()
    assert len(found) == 1
    assert behind_lapses(found, None) == found
    assert behind_lapses(found, with_lapses()) == found
    assert behind_lapses(found, with_lapses(Lapse(2, 10, 20, stood=True)))[0].a is found[0].a


@pytest.mark.parametrize("robot", [0, 1])
def test_of_who_lapsed_only_what_it_drove_behind_the_last_lapse_counts(robot: int) -> None:
    """By its own clock."""
    found = pairs()
    ends = found[0].a, found[0].b
    last = ends[robot].track.end - 80
    early, late = (Lapse(robot, n - 30, n, stood=False) for n in (last - 60, last))
    (shorter,) = behind_lapses(found, with_lapses(late, early))
    after = shorter.a, shorter.b
    assert after[robot].first_us == last * GRID_US - ends[robot].ahead_us
    assert ends[robot].first_us < after[robot].first_us < ends[robot].last_us
    assert after[1 - robot] is ends[1 - robot]
    assert shorter.pair is found[0].pair
