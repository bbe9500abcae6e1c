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
        learns_scatter: do closures claim what ranges were seen to scatter, or what is configured?
        scale_tails: see `banded_optimizer.SCALE_TAILS`.
        has_cauchy_priors: have biases and scales heavy tails, or those of Gauss?
        believable: see `gnc.BELIEVABLE`.
        recent_s: see `time_cells.RECENT_S`.
    """

    ranges: RangeModel = LINKTRACK
    confirm_us: int = CONFIRM_US
    learns_scatter: bool = True
    scale_tails: float = SCALE_TAILS
    has_cauchy_priors: bool = True
    believable: float = BELIEVABLE
    recent_s: int = RECENT_S


DEFAULTS = Tuning()
