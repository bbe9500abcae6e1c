"""What module 1 answers: poses that one window allows, or why it names none."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import LINKTRACK, RangeModel, RangeNoise
from drslamd.slam.se2 import Array


class Verdict(Enum):
    """What one window could tell."""

    UNIQUE = "unique"
    AMBIGUOUS = "ambiguous"
    UNOBSERVABLE = "not enough motion"
    POOR_FIT = "ranges and odometry disagree"
    TOO_FEW = "too few ranges"


@dataclass(frozen=True)
class Hypothesis:
    """One minimum: a_T_b (3,), covariance (3, 3) of x, y, theta in frame a, and chi-squared."""

    a_T_b: Array
    covariance: Array
    chi2: float


@dataclass(frozen=True)
class RelativePoseEstimate:
    """Result of module 1; `hypotheses` is empty unless the verdict is UNIQUE or AMBIGUOUS."""

    verdict: Verdict
    hypotheses: tuple[Hypothesis, ...] = ()


@dataclass(frozen=True)
class PairNoise:
    """All that module 1 must know about the sensors of two robots."""

    ranges: RangeNoise
    a: OdometryNoise
    b: OdometryNoise
    model: RangeModel = LINKTRACK
