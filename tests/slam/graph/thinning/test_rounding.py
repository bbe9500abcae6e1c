"""What a digest sees of numbers."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.graph.thinning.rounding import RESOLUTION, as_digested


@pytest.mark.parametrize(("off", "same"), [(0.4, True), (0.6, False), (-0.4, True), (-0.6, False)])
def test_what_is_nearer_than_half_a_step_is_the_same(off: float, same: bool) -> None:
    values = RESOLUTION * np.array([[3.0, -2.0], [0.0, 10.0]])
    moved = values.copy()
    moved[1, 0] += off * RESOLUTION
    assert (as_digested(moved) == as_digested(values)) is same
