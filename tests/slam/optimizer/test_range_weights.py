"""Between whom ranges weigh less."""

from __future__ import annotations

import pytest

from drslamd.conventions import FIRST_NODE
from drslamd.slam.optimizer.range_weights import STEADY, widths

NODE = FIRST_NODE + 3


@pytest.mark.parametrize(
    ("pair", "by_gyro", "is_wider"),
    [
        ((1, 2), {1, 2, 4}, True),
        ((1, 2), {1}, False),
        ((1, 2), {2}, False),
        ((1, 2), set(), False),
        ((1, NODE), {1}, True),
        ((1, NODE), {2}, False),
    ],
)
def test_ranges_weigh_less_where_both_ends_have_a_gyro_or_stand(
    pair: tuple[int, int], by_gyro: set[int], is_wider: bool
) -> None:
    assert widths([pair, (7, 8)], by_gyro).tolist() == [STEADY if is_wider else 1.0, 1.0]


def test_of_no_pairs_there_are_no_widths() -> None:
    assert widths([], {1}).shape == (0,)
