"""Published poses in a ring."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.history import pose_history
from drslamd.history.pose_history import COLUMNS, PoseHistory


@pytest.mark.parametrize("count", [0, 1, pose_history.MOST, pose_history.MOST + 1, 1_500])
def test_the_latest_ten_minutes_are_kept_in_order(count: int) -> None:
    history = PoseHistory()
    for k in range(count):
        history.add([float(k)] * len(COLUMNS))
    rows = history.rows()
    first = max(0, count - pose_history.MOST)
    assert rows.shape == (count - first, len(COLUMNS))
    assert np.array_equal(rows[:, 0], np.arange(first, count))
