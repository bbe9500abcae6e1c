"""How much a range weighs against odometry: by how long odometry stays good.

Ranges of one pair share their errors from one second to the next. Wheels turn a robot wrongly
within seconds, and need what each single range says. What a gyro says stays good for minutes, and
over minutes the mean of ranges counts, which is less sure than if each had its own error
(`RangeModel.correlated_ratio`). A weight of its own for each pair would ask for how its ranges
scatter about a solution, and so for another solution; one number needs the graph alone.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from drslamd.conventions import is_node
from drslamd.slam.se2 import Array

STEADY = 1.35
"""Of how many times its sigma a range weighs between robots with a gyro: over minutes the mean of
ranges is about twice as unsure as they scatter, and they scatter by two thirds of what is
configured for any room."""


def widths(pairs: Sequence[tuple[int, int]], by_gyro: Collection[int]) -> Array:
    """(pairs,) see `Problem.width`.

    Args:
        by_gyro: robots whose heading a gyro gives; modules that no robot carries stand still.
    """
    steady = [all(robot in by_gyro or is_node(robot) for robot in pair) for pair in pairs]
    return np.where(steady, STEADY, 1.0)
