"""Self-calibration over restarts: what this start uses, and what the next one should know."""

from __future__ import annotations

import math
from collections.abc import Collection

from drslamd.slam.calibration.sensor_calibration import (
    CHANGED_ANTENNA_M,
    CHANGED_BIAS_M,
    CHANGED_SCALE,
    CHANGED_TURN,
    CHANGED_YAW,
    MOST_ANTENNA_M,
    MOST_BIAS_M,
    MOST_SCALE_ERROR,
    MOST_TURN,
    MOST_YAW_RATE,
    NOTHING,
    UNLEARNED,
    SensorCalibration,
    is_value,
)
from drslamd.slam.calibration.taped import with_tape
from drslamd.slam.graph.estimate import Learned, TeamEstimate

NEWS_BIAS_M = 0.05
"""A bias that moved by more is worth a write; a card that is written to wears."""
NEWS_SCALE = 0.01
"""Likewise."""
NEWS_YAW = math.radians(0.02)
"""Likewise, rad/m."""
SHARPER = 0.8
"""A sigma that shrank by a fifth is worth a write."""


class CalibrationStore:
    """The constants of one start.

    Attributes:
        used: taken out of all that this start measures.
        latest: what the next start should know.
    """

    def __init__(
        self, kept: SensorCalibration, is_used: bool, taped: SensorCalibration = UNLEARNED
    ) -> None:
        """
        Args:
            kept: of the start before this one; is_used: may it be?
            taped: measured by a person, and always used.
        """
        known = with_tape(kept, taped)
        self.used = known if is_used else taped
        self.latest = known
        self._kept, self._saved = known, known

    def update(self, estimate: TeamEstimate | None, own: int, owned: Collection[int]) -> None:
        """Module 3 has spoken.

        Args:
            owned: peers of the pairs that robot `own` owns.
        """
        if estimate is None or not estimate.converged or estimate.correction(own).is_mirrored:
            return
        used, kept, latest = self.used, self._kept, self.latest
        biases = dict(latest.bias)
        for peer in owned:
            rest = estimate.bias_m.get((min(own, peer), max(own, peer)), NOTHING)
            now = Learned(used.bias_to(peer).value + rest.value, rest.sigma)
            if _is_better(now, kept.bias_to(peer), CHANGED_BIAS_M, MOST_BIAS_M):
                biases[peer] = now
        rest, turned = estimate.scale.get(own, NOTHING), estimate.yaw.get(own, NOTHING)
        keep = (1 - used.scale.value) * (1 - rest.value)
        scale = Learned(1 - keep, rest.sigma)
        yaw = Learned(used.yaw.value + turned.value, turned.sigma)
        is_better_scale = _is_better(scale, kept.scale, CHANGED_SCALE, MOST_SCALE_ERROR)
        is_better_yaw = _is_better(yaw, kept.yaw, CHANGED_YAW, MOST_YAW_RATE)
        longer = estimate.turn.get(own, NOTHING)
        turn = Learned((1 + used.turn.value) * (1 + longer.value) - 1, longer.sigma)
        antenna = [
            Learned(before.value + more.value, more.sigma)
            for before, more in zip(
                (used.antenna_x, used.antenna_y),
                estimate.antenna_m.get(own, (NOTHING, NOTHING)),
                strict=True,
            )
        ]
        is_better_turn = _is_better(turn, kept.turn, CHANGED_TURN, MOST_TURN)
        places = zip(antenna, (kept.antenna_x, kept.antenna_y), strict=True)
        is_better_antenna = all(
            _is_better(now, before, CHANGED_ANTENNA_M, MOST_ANTENNA_M) for now, before in places
        )
        self.latest = SensorCalibration(
            scale=scale if is_better_scale else latest.scale,
            yaw=yaw if is_better_yaw else latest.yaw,
            bias=biases,
            turn=turn if is_better_turn else latest.turn,
            antenna_x=antenna[0] if is_better_antenna else latest.antenna_x,
            antenna_y=antenna[1] if is_better_antenna else latest.antenna_y,
        )

    def on_saved(self) -> None:
        """The latest constants are on their way to the disk."""
        self._saved = self.latest

    def is_news(self) -> bool:
        """Is what is known now worth a write?"""
        before, now = self._saved, self.latest
        return (
            _has_moved(before.scale, now.scale, NEWS_SCALE)
            or _has_moved(before.yaw, now.yaw, NEWS_YAW)
            or _has_moved(before.turn, now.turn, NEWS_SCALE)
            or _has_moved(before.antenna_x, now.antenna_x, NEWS_BIAS_M)
            or _has_moved(before.antenna_y, now.antenna_y, NEWS_BIAS_M)
            or any(_has_moved(before.bias_to(p), b, NEWS_BIAS_M) for p, b in now.bias.items())
        )


def _is_better(now: Learned, kept: Learned, change: float, most: float) -> bool:
    """Does this start know more than the one before it did, seen from now?"""
    return is_value(now, most) and now.sigma < math.hypot(kept.sigma, change)


def _has_moved(before: Learned, now: Learned, step: float) -> bool:
    return abs(now.value - before.value) > step or now.sigma < SHARPER * before.sigma
