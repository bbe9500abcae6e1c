"""What is kept holds as long as all is nearly as it was."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.optimizer.kept.kept_solution import KeptShares, Sureness


@pytest.mark.parametrize(
    ("pairs", "feared", "has_moved"),
    [
        ([0.061, 0.061], [0.0, 0.0], True),
        ([0.059, -0.059], [0.0, 0.0], False),
        ([0.0, 0.0], [0.0, -0.121], True),
        ([0.1, 0.0], [0.119, 0.119], False),
    ],
)
def test_what_is_claimed_holds_until_what_is_feared_has_moved(
    pairs: list[float], feared: list[float], has_moved: bool
) -> None:
    """By 6 % of pairs in the mean, or 12 % of one robot; a pair that is new is none that moved."""
    before = Sureness(np.array([1.5, 2.0]), [(0, 1), (0, 2)], np.array([1.0, 3.0]))
    now = Sureness(
        np.append(before.pairs * np.exp(pairs), 40.0)[[2, 0, 1]],
        [(1, 2), (0, 1), (0, 2)],
        before.feared * np.exp(feared),
    )
    assert now.has_moved(before) is has_moved


def test_shares_hold_for_a_minute_until_a_tenth_of_the_way_is_new_and_for_the_same_robots() -> None:
    """Thinning takes away links, and a room may become a worse one."""
    found = KeptShares((0, 3), 100, 7_000, np.ones((2, 2)))
    for robots, links, newest, holds in (
        ((0, 3), 110, 7_010, True),
        ((0, 3), 111, 7_010, False),
        ((0, 3), 100, 7_600, True),
        ((0, 3), 100, 7_601, False),
        ((0, 4), 100, 7_010, False),
        ((0, 3, 4), 100, 7_010, False),
    ):
        assert found.hold(KeptShares(robots, links, newest, np.ones((0, 0)))) is holds
