"""What the system does without one of its pieces, for the table of what each of them brings.

Where a configuration has a key for a piece, that key turns it off; else a constant of the estimator
is another one (`drslamd.slam.tuning`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.tuning import DEFAULTS, Tuning


@dataclass(frozen=True)
class Piece:
    """How to do without it.

    Attributes:
        instead: what is then done.
        section, keys: of the configuration.
        tuning: of the estimator.
    """

    instead: str
    section: str = ""
    keys: str = ""
    tuning: Tuning = DEFAULTS

    @property
    def toml(self) -> str:
        return f"[{self.section}]\n{self.keys}\n" if self.section else ""


def _ranges(**constants: float) -> Tuning:
    return Tuning(ranges=replace(LINKTRACK, **constants))


PIECES = {
    "self-calibration": Piece(
        "windows know nothing of what module 3 has learned",
        "relative_pose",
        "self_calibration = false",
    ),
    "nlos": Piece("the power of the first path is not looked at", "relative_pose", "nlos_db = 0.0"),
    "long-windows": Piece("windows of 30 s", "relative_pose", "window_max_s = 30.0"),
    "wide-scale": Piece("odometry scale has a sigma of 3 %", "odometry", "scale_sigma = 0.03"),
    "narrow-priors": Piece(
        "biases and scales are believed to be anything that is configured",
        tuning=Tuning(ranges=replace(LINKTRACK, spread_share=1.0, team_share=1.0), scale_tails=1.0),
    ),
    "closure-dating": Piece("a window names the pose at its end", tuning=Tuning(confirm_us=0)),
    "short-range-doubt": Piece(
        "short ranges are trusted like others", tuning=_ranges(near_sigma_m=0.0)
    ),
    "near-range-bias": Piece(
        "what biases do at short range is not an unknown", tuning=_ranges(near_bias_sigma_m=1e-6)
    ),
    "gnc": Piece("`closures` believes whatever module 2 kept", tuning=Tuning(believable=math.inf)),
    "robust-ranges": Piece(
        "module 3 squares the errors of ranges, whatever their size",
        tuning=_ranges(cauchy_sigmas=1e6),
    ),
}
"""By the name on the command line."""
