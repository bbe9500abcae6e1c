"""What is said of first poses."""

from __future__ import annotations

import numpy as np
import pytest
from lab.bound import first_pose
from lab.bound.first_pose import MEDIAN_S, WRONG, FirstPose


def firsts(count: int, near: float = MEDIAN_S, wrong: int = 0) -> list[FirstPose]:
    return [
        FirstPose(k // 3, k % 3, {}, near, near, WRONG + 1 if k < wrong else 1.0)
        for k in range(count)
    ]


@pytest.mark.parametrize(
    ("near", "wrong", "is_reached"),
    [(MEDIAN_S, 1, True), (MEDIAN_S + 0.1, 1, False), (MEDIAN_S, 2, False)],
)
def test_it_is_wanted_soon_and_hardly_ever_wrong(near: float, wrong: int, is_reached: bool) -> None:
    """One in a thousand."""
    assert first_pose.is_reached(firsts(1_000, near, wrong)) is is_reached


def test_what_never_came_counts_as_late_and_what_is_wrong_is_named() -> None:
    found = firsts(6, wrong=1)
    found[5].near = np.inf
    said = "\n".join(first_pose.lines(found))
    assert "wrong first poses: 1 of 6" in said
    assert "seed 0, robot 0: 0.00 m off" in said
    near = next(line for line in said.splitlines() if line.startswith("published within"))
    assert near.split()[-1] == "1"
    team = next(line for line in said.splitlines() if line.startswith("the same"))
    assert team.split()[-1] == "1"


@pytest.mark.slow
def test_a_pair_that_knows_nothing_says_where_it_is_and_how_it_came_there() -> None:
    found = first_pose.of_seed(1, robots=2, longest_s=40.0)
    assert [first.robot for first in found] == [0, 1]
    for first in found:
        # of two answers one window may be sure before any names one alone
        assert set(first.stages) | {"one answer"} == set(first_pose.STAGES)
        assert first.stages["answered"] <= first.stages["agreed"]
        assert 5.0 < first.published <= first.near < 40.0
        assert not first.is_wrong
    assert [first.in_own_frame for first in found] == [True, False]
