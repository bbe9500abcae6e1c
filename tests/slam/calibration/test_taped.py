"""What a tape says and what was learned: one of the two."""

from __future__ import annotations

import pytest

from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.calibration.taped import with_tape
from drslamd.slam.graph.estimate import Learned

TAPED = SensorCalibration(
    scale=Learned(0.02, 0.006), turn=Learned(-0.1, 0.01), bias={4: Learned(0.1, 0.08)}
)


def test_where_nothing_was_learned_the_tape_counts_and_where_nothing_was_taped_the_rest() -> None:
    assert with_tape(UNLEARNED, TAPED) == TAPED
    learned = SensorCalibration(
        scale=Learned(0.1, 0.01),
        yaw=Learned(0.001, 0.001),
        bias={2: Learned(0.3, 0.1)},
        antenna_x=Learned(0.1, 0.02),
    )
    assert with_tape(learned, UNLEARNED) == learned
    both = with_tape(learned, SensorCalibration(bias={4: Learned(0.1, 0.08)}))
    assert both.bias == {2: Learned(0.3, 0.1), 4: Learned(0.1, 0.08)}
    assert (both.yaw, both.antenna_x) == (learned.yaw, learned.antenna_x)


@pytest.mark.parametrize(
    ("value", "sigma", "stays"),
    [
        (0.03, 0.004, True),  # sharper, and as the tape says
        (0.03, 0.007, False),  # not as sharp
        (0.10, 0.004, True),  # 0.08 apart, of 3 x 0.0309
        (0.12, 0.004, False),  # 0.10 apart: something was changed since
    ],
)
def test_the_sharper_of_two_that_agree_counts_and_else_the_tape(
    value: float, sigma: float, stays: bool
) -> None:
    learned = SensorCalibration(scale=Learned(value, sigma))
    assert with_tape(learned, TAPED).scale == (learned.scale if stays else TAPED.scale)
