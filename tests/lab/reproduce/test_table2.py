"""Figures of table II."""

from __future__ import annotations

import numpy as np
import pytest
from lab.reproduce import table2
from lab.score import metrics


def test_joint_ate_does_not_see_where_the_frame_is() -> None:
    rng = np.random.default_rng(6)
    truth = [rng.normal(size=(20, 3)) for _ in range(3)]
    moved = [metrics.compose(np.array([[4.0, -2.0, 1.0]]), t) for t in truth]
    assert table2.joint_ate(moved, truth) == pytest.approx(0.0, abs=1e-12)
    moved[0] = moved[0] + [0.3, 0.0, 0.0]
    assert 0.05 < table2.joint_ate(moved, truth) < 0.3
