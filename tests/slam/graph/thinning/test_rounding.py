"""Numbers as digests take them."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.graph.thinning.rounding import RESOLUTION, as_digested


@pytest.mark.parametrize(("apart", "is_equal"), [(0.4, True), (0.6, False)])
def test_what_differs_by_less_than_half_a_step_is_equal(apart: float, is_equal: bool) -> None:
    one = np.array([7 * RESOLUTION, -3.0])
    assert (as_digested(one) == as_digested(one + apart * RESOLUTION)) is is_equal


@pytest.mark.parametrize(
    ("value", "like"), [(1e30, 2.0**62 * RESOLUTION), (-np.inf, -1e30), (np.nan, 0.0)]
)
def test_numbers_that_no_integer_can_say_are_told_without_a_warning(
    value: float, like: float
) -> None:
    assert as_digested(np.array([value])) == as_digested(np.array([like]))
