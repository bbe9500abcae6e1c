"""Distances for the pose graph: the median of each second, if somebody moved since the last."""

from __future__ import annotations

from statistics import median

import numpy as np

from drslamd.conventions import SECOND_US, Chain
from drslamd.slam import se2
from drslamd.slam.graph.measurements import RangeMeasurement
from drslamd.slam.range_model import LINKTRACK, RangeModel
from drslamd.slam.relative_pose.pair_end import STILL_M, PairEnd, anchor, level
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.window_request import newest
from drslamd.slam.se2 import Array

EVERY_US = SECOND_US * 9 // 10
"""Timers of a second may be so uneven."""
STANDING_US = 10 * SECOND_US
"""Between two distances while nobody moves."""
MIN_SIGMA_M = 1e-3
"""The resolution in which the sigma of a range is sent."""


class RangeSampler:
    """Of one pair."""

    def __init__(self, sigma_m: float, model: RangeModel = LINKTRACK) -> None:
        """
        Args:
            sigma_m: of a range in the open.
        """
        self._sigma_m = max(sigma_m, MIN_SIGMA_M)
        self._model = model
        self._utime = 0
        self._place: Array | None = None

    def sample(
        self, ranges: RangeBuffer, a: PairEnd, b: PairEnd, peer: Chain, is_doubted: bool = False
    ) -> RangeMeasurement | None:
        """Take one measurement for the graph; None when there is nothing new to say.

        Args:
            is_doubted: is it doubtful that a robot stands whose odometry says so?
        """
        last = newest(ranges, a, b)
        if last is None or last - self._utime < EVERY_US:
            return None
        since = max(self._utime, last - SECOND_US, a.first_us, b.first_us)
        found = ranges.between(since, last).in_sight(self._model)
        if not len(found.utime):
            return None
        when = int(median(found.utime.tolist()))
        anchor_a, anchor_b = anchor(a, when), anchor(b, when)
        place = np.concatenate([a.pose(when)[:2], b.pose(when)[:2]])
        is_still = self._place is not None and np.abs(place - self._place).max() < STILL_M
        is_early = is_still and not is_doubted and last - self._utime < STANDING_US
        if anchor_a is None or anchor_b is None or is_early:
            return None
        self._utime, self._place = last, place
        q_a = se2.transform(anchor_a.keyframe_T_body, a.data.model.antenna).tolist()
        q_b = se2.transform(anchor_b.keyframe_T_body, b.data.model.antenna).tolist()
        metres = median(level(found.range_m, a.data.model, b.data.model).tolist())
        doubt = median(found.doubt_m.tolist())
        near = self._model.near_range_sigma(metres)
        return RangeMeasurement(
            a_n=anchor_a.n,
            peer=peer,
            b_n=anchor_b.n,
            q_a=(q_a[0], q_a[1]),
            q_b=(q_b[0], q_b[1]),
            range_m=metres,
            sigma_m=float(np.hypot(np.hypot(self._sigma_m, near), doubt)),
            turn_a=float(se2.wrap(anchor_a.keyframe_T_body[2])),
            turn_b=float(se2.wrap(anchor_b.keyframe_T_body[2])),
        )
