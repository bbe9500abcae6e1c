"""What the system does without one of its pieces, for the table of what each of them brings.

Where a configuration has a key for a piece, that key turns it off; else a constant or function of
the module that holds it is exchanged for as long as the measurement takes. Nothing on a robot reads
these switches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from drslamd.slam.optimizer.banded import banded_optimizer, normal_equations
from drslamd.slam.optimizer.banded.normal_equations import System
from drslamd.slam.optimizer.closures import gnc
from drslamd.slam.optimizer.problem import Index
from drslamd.slam.relative_pose import pair_window, window_noise
from lab.recordings.recording import Array


@dataclass(frozen=True)
class Piece:
    """How to do without it.

    Attributes:
        instead: what is then done.
        section, keys: of the configuration.
        exchanged: (owner, name, value) for what no configuration has a key for.
    """

    instead: str
    section: str = ""
    keys: str = ""
    exchanged: tuple[tuple[Any, str, Any], ...] = ()

    @property
    def toml(self) -> str:
        return f"[{self.section}]\n{self.keys}\n" if self.section else ""


def _hold_tightly(system: System, unknowns: Index, error: Array, sigma: Array) -> None:
    """Gauss's prior in the place of Cauchy's."""
    system.add_gaussian_prior(unknowns, error, sigma**-2.0)


def _measured(values: Array, sigmas: Array, prior: Array) -> Any:
    return banded_optimizer._measured(values, sigmas, prior**-2.0)


def _as_configured(
    errors: Array, sigmas: Array, pair: Index, pairs: int, configured: float
) -> Array:
    """What ranges scatter, when nobody looks."""
    return np.ones(pairs)


PIECES = {
    "self-calibration": Piece(
        "windows know nothing of what module 3 has learned",
        section="relative_pose",
        keys="self_calibration = false",
    ),
    "range-scatter": Piece(
        "closures claim what the configured sigma of ranges says",
        exchanged=((banded_optimizer, "scatter_ratios", _as_configured),),
    ),
    "nlos": Piece("the power of the first path is not looked at", "relative_pose", "nlos_db = 0.0"),
    "long-windows": Piece("windows of 30 s", "relative_pose", "window_max_s = 30.0"),
    "wide-scale": Piece("odometry scale has a sigma of 3 %", "odometry", "scale_sigma = 0.03"),
    "cauchy-priors": Piece(
        "Gauss's priors with the configured sigmas on bias and scale",
        exchanged=(
            (System, "add_cauchy_prior", _hold_tightly),
            (banded_optimizer, "CAUCHY_TAILS", 1.0),
            (banded_optimizer, "_loosely", _measured),
        ),
    ),
    "closure-dating": Piece(
        "a window names the pose at its end",
        exchanged=((pair_window, "CONFIRM_US", 0),),
    ),
    "short-range-doubt": Piece(
        "short ranges are trusted like others",
        exchanged=((window_noise, "NEAR_BIAS_M", 0.0),),
    ),
    "strong-signals": Piece(
        "what biases do at short range is not an unknown",
        exchanged=((banded_optimizer, "NEAR_BIAS_SIGMA_M", 1e-6),),
    ),
    "gnc": Piece(
        "`closures` believes whatever module 2 kept",
        exchanged=((gnc, "BELIEVABLE", math.inf),),
    ),
    "robust-ranges": Piece(
        "module 3 squares the errors of ranges, whatever their size",
        exchanged=((normal_equations, "ROBUST_SIGMAS", 1e6),),
    ),
}
"""By the name on the command line."""


@contextmanager
def without(piece: Piece) -> Iterator[None]:
    """Exchange what the piece names, and put it back afterwards."""
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in piece.exchanged]
    try:
        for owner, name, value in piece.exchanged:
            setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)
