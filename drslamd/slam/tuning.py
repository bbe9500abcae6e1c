"""Constants of the estimator that no configuration has a key for, in one place.

A robot runs with the defaults. The laboratory changes one at a time to see what each piece brings.
"""

from __future__ import annotations

from dataclasses import dataclass

from drslamd.slam.closure_method import CONFIRM_US
from drslamd.slam.graph.thinning.time_cells import RECENT_S
from drslamd.slam.optimizer.banded.banded_optimizer import SCALE_TAILS
from drslamd.slam.optimizer.closures.gnc import BELIEVABLE
from drslamd.slam.range_model import LINKTRACK, RangeModel


@dataclass(frozen=True)
class Tuning:
    """Everything of this kind.

    Attributes:
        ranges: the model of a range.
        confirm_us: see `WindowRule.confirm_us`.
        scale_tails: see `banded_optimizer.SCALE_TAILS`.
        believable: see `gnc.BELIEVABLE`.
        recent_s: see `time_cells.RECENT_S`.
    """

    ranges: RangeModel = LINKTRACK
    confirm_us: int = CONFIRM_US
    scale_tails: float = SCALE_TAILS
    believable: float = BELIEVABLE
    recent_s: int = RECENT_S


DEFAULTS = Tuning()
