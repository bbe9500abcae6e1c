"""Distances for the graph: what they say of themselves."""

from __future__ import annotations

import math

import pytest
from pair_scenes import moving_end, weak_paths

from drslamd.conventions import Chain
from drslamd.slam.relative_pose.range_sampler import RangeSampler


@pytest.mark.parametrize(
    ("gap_db", "share", "metres", "sigma"),
    [
        (10.0, 0.4, 5.0, 0.1),
        (10.0, 1.0, 6.0, math.hypot(0.1, 0.5)),
        (8.0, 1.0, 6.0, math.hypot(0.1, 0.25)),
        (6.0, 1.0, 6.0, 0.1),
    ],
)
def test_a_range_for_the_graph_says_how_much_it_is_worth(
    gap_db: float, share: float, metres: float, sigma: float
) -> None:
    found = RangeSampler(0.1).sample(
        weak_paths(gap_db, share), moving_end(0), moving_end(1), Chain(1, 1)
    )
    assert found is not None
    assert found.range_m == metres
    assert found.sigma_m == pytest.approx(sigma, abs=0.006)
