"""One robot of a pair: heights of antennas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import NOISE, model_of

from drslamd.slam.relative_pose.pair_end import level


@pytest.mark.parametrize(
    ("measured", "from_above"),
    [(5.0, 4.0), (3.0001, math.sqrt(3.0001**2 - 9)), (2.9, 2.9), (-0.3, -0.3)],
)
def test_ranges_between_antennas_of_different_heights_are_seen_from_above(
    measured: float, from_above: float
) -> None:
    low, high = model_of(NOISE, height=0.5), model_of(NOISE, height=3.5)
    for a, b in ((low, high), (high, low)):
        assert level(np.array([measured]), a, b)[0] == pytest.approx(from_above)
    assert level(np.array([measured]), low, low)[0] == pytest.approx(measured)
