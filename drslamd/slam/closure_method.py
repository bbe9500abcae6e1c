"""Two ways from a window to a believed closure, one of which is chosen at the start.

`drslamd` is this project's own. `paper` is what the paper prints: windows of tau samples, algorithm
1, and a closure as soon as two agree. What differs between them is here, and nothing else asks
which of them it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.slam.calibration.window_calibration import PairCalibration, calibrated_window
from drslamd.slam.consistency.pair import Agreement
from drslamd.slam.relative_pose import algorithm_1, solver
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_request import WindowRule

POINTS = 60
"""Measurements of one window after binning; more would only repeat the slow range bias."""
CONFIRM_US = 2 * SECOND_US
"""See `WindowRule.confirm_us`."""
AGREEMENT = Agreement(least=5, outnumber=2, confirms=True, decides=10.0)
PAPER_AGREEMENT = Agreement(least=2, outnumber=0, confirms=False)


class PairWindow(NamedTuple):
    """A window of one pair, and what is known of its sensors."""

    window: Window
    noise: PairNoise
    known: PairCalibration


@dataclass(frozen=True)
class ClosureMethod:
    """One way.

    Attributes:
        rule: which window is looked at.
        solve: module 1 on windows of several pairs, which may use what was learned of the sensors.
        agreement: which sets of closures are believed.
        uses_calibration: does what is learned serve modules 1 and 2, over restarts too?
    """

    rule: WindowRule
    solve: Callable[[Sequence[PairWindow]], list[RelativePoseEstimate]]
    agreement: Agreement
    uses_calibration: bool


def drslamd_method(
    longest_us: int, delta: float, uses_calibration: bool, confirm_us: int = CONFIRM_US
) -> ClosureMethod:
    """Long windows, every minimum, honest noise.

    Args:
        delta: step of the coarse search, rad.
    """

    def solve(windows: Sequence[PairWindow]) -> list[RelativePoseEstimate]:
        better = [calibrated_window(*window) for window in windows]
        return solver.solve_all([w for w, _ in better], [noise for _, noise in better], delta)

    bin_us = max(GRID_US, longest_us // POINTS)
    rule = WindowRule(longest_us, bin_us, confirm_us, drops_blocked=True)
    return ClosureMethod(rule, solve, AGREEMENT, uses_calibration)


def paper_method(tau: int, range_sigma: float, delta: float) -> ClosureMethod:
    """Algorithm 1 and equations (1) to (3) as printed.

    Args:
        tau: samples at 10 Hz.
        range_sigma: m.
        delta: step of the coarse search, rad.
    """

    def solve(windows: Sequence[PairWindow]) -> list[RelativePoseEstimate]:
        return [algorithm_1.solve(window, range_sigma, delta) for window, _, _ in windows]

    rule = WindowRule(tau * GRID_US, bin_us=GRID_US, confirm_us=0, drops_blocked=False)
    return ClosureMethod(rule, solve, PAPER_AGREEMENT, uses_calibration=False)
