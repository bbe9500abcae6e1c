"""What a person measured with a tape, beside what earlier starts learned by driving.

Both say the same constants of the same configuration, so one of them is used and never both. The
sharper one is, while the two agree. Where they do not, something was changed since it was learned,
and the tape is right.
"""

from __future__ import annotations

import math

from drslamd.slam.calibration.sensor_calibration import (
    CHANGED_BIAS_M,
    CHANGED_SCALE,
    CHANGED_TURN,
    SensorCalibration,
)
from drslamd.slam.graph.estimate import Learned

AGREE_SIGMAS = 3.0


def with_tape(kept: SensorCalibration, taped: SensorCalibration) -> SensorCalibration:
    """Everything that is known when a robot starts.

    Args:
        kept: learned before.
        taped: scale, turns and biases, as far as they were measured.
    """
    biases = {
        peer: _better(kept.bias_to(peer), taped.bias_to(peer), CHANGED_BIAS_M)
        for peer in {**kept.bias, **taped.bias}
    }
    return SensorCalibration(
        scale=_better(kept.scale, taped.scale, CHANGED_SCALE),
        yaw=kept.yaw,
        bias=biases,
        turn=_better(kept.turn, taped.turn, CHANGED_TURN),
        antenna_x=kept.antenna_x,
        antenna_y=kept.antenna_y,
    )


def _better(kept: Learned, taped: Learned, change: float) -> Learned:
    if not math.isfinite(taped.sigma):
        return kept
    apart = abs(kept.value - taped.value)
    agrees = apart <= AGREE_SIGMAS * math.hypot(kept.sigma, taped.sigma, change)
    return kept if agrees and kept.sigma < taped.sigma else taped
