"""What two robots measured between them, held against where they say that they were.

The residual of a range is the distance of the two antennas on the published paths minus what was
measured. Its constant part is the bias of the pair's modules, which every robot learns for itself
and nobody publishes: the median over some minutes stands for it. What scatters around it says how
well poses and ranges agree now.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drslamd.slam import se2
from drslamd.slam.graph.measurements import ClosureMeasurement, RangeMeasurement
from drslamd.slam.se2 import Array
from drslamd.view.scene.rows import Rows

RESIDUALS = 600
"""Of one pair, over which its bias is taken: five to ten minutes."""
LATELY_S = 20.0
"""Over which the scatter is taken."""
FEWEST = 3
"""Ranges of late, without which no scatter is said."""
CLOSURES = 256
"""Of one pair: more than are said in forty minutes."""
KEPT = 720
"""Scatters of one pair, `APART_S` apart: an hour."""
APART_S = 5.0


class Scatter(NamedTuple):
    """Of the ranges of one pair at a time, m."""

    t: float
    rms_m: float
    bias_m: float


@dataclass(frozen=True)
class ClosureSeen:
    """One closure as the page draws it.

    Attributes:
        t: when it was last heard of, s.
        kept: False when it was withdrawn, because it contradicts others.
        ends: where the two robots were, (x, y) each, by their paths.
        off_m: how far the second end is from where the closure says that it was.
    """

    number: int
    t: float
    kept: bool
    ends: tuple[tuple[float, float], tuple[float, float]]
    off_m: float


class PairSeen:
    """Of a robot that measures and the one that it measures to, or both ways for ranges."""

    def __init__(self) -> None:
        self.closures: OrderedDict[tuple[int, int], ClosureSeen] = OrderedDict()
        """By the robot that says it, and its number."""
        self._residuals: deque[tuple[float, float]] = deque(maxlen=RESIDUALS)
        self._past = Rows(KEPT, 3)
        self._latest: Scatter | None = None

    @property
    def past(self) -> Array:
        """(k, 3) scatters: time, rms, bias."""
        return self._past.values

    def add_residual(self, t: float, residual_m: float) -> None:
        self._residuals.append((t, residual_m))

    def add_closure(self, origin: int, seen: ClosureSeen) -> None:
        """Keep it, in the place of what was said of it before."""
        key = origin, seen.number
        self.closures.pop(key, None)
        self.closures[key] = seen
        if len(self.closures) > CLOSURES:
            self.closures.popitem(last=False)

    def forget_closures(self, origin: int) -> None:
        """The robot that said them has another start."""
        for key in [key for key in self.closures if key[0] == origin]:
            del self.closures[key]

    def scatter(self, t: float) -> Scatter | None:
        """How well ranges and paths agree now; None where too little was measured of late."""
        residuals = np.array(self._residuals).reshape(-1, 2)
        lately = residuals[residuals[:, 0] > t - LATELY_S, 1]
        if len(lately) < FEWEST:
            return None
        bias = float(np.median(residuals[:, 1]))
        rms = float(np.sqrt(np.mean((lately - bias) ** 2)))
        return Scatter(t, rms, bias)

    def renew(self, t: float) -> Scatter | None:
        """The scatter, if it is news; it is kept for the slider."""
        now = self.scatter(t)
        if now is None or (self._latest and now[1:] == self._latest[1:]):
            return None
        self._latest = now
        self._past.append(np.array(now), APART_S)
        return now


def residual(r: RangeMeasurement, w_T_a: Array, w_T_b: Array) -> float:
    """Distance of the antennas by the paths, minus what was measured, m."""
    a, b = (se2.transform(p, np.array(q)) for p, q in ((w_T_a, r.q_a), (w_T_b, r.q_b)))
    return float(np.hypot(*(a - b))) - r.range_m


def closure_seen(c: ClosureMeasurement, t: float, w_T_a: Array, w_T_b: Array) -> ClosureSeen:
    """A closure beside the paths."""
    said = se2.transform(w_T_a, np.array(c.a_T_b[:2]))
    off = float(np.hypot(*(said - w_T_b[:2])))
    (xa, ya), (xb, yb) = w_T_a[:2].tolist(), w_T_b[:2].tolist()
    return ClosureSeen(c.number, t, c.kept, ((xa, ya), (xb, yb)), off)
