"""What was to be reached, and whether it was: one check per line of the promise."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

from lab.bound import efficiency
from lab.reproduce import printed
from lab.reproduce.table2 import EPSILONS, TAUS
from lab.reproduce.tally import Tally
from lab.reproduce.window_columns import TAUS as WINDOW_TAUS

HALF = 0.5
BEST_M, BEST_DEG = 0.20, 2.0
"""Wanted of this system where the paper has its best row."""
BEST_ROW = (50, 0.5)
LIKE_PRINTED = 1.5
CALIBRATED = 0.15
LIKE_LEAST, FEW_ROUNDS = 1.1, 40
"""Of DPGO: joint ATE against that of its minimum, rounds until it is near it."""


@dataclass(frozen=True)
class Check:
    """One promise: what was reached (None: nothing was measured), what was wanted."""

    name: str
    reached: float | None
    wanted: str
    ok: bool

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def at_most(name: str, reached: float, limit: float) -> Check:
    return Check(name, _number(reached), f"<= {limit:.3g}", reached <= limit)


def at_least(name: str, reached: float, limit: float) -> Check:
    return Check(name, _number(reached), f">= {limit:.3g}", reached >= limit)


def within(name: str, reached: float, low: float, high: float) -> Check:
    return Check(name, _number(reached), f"{low:.3g} ... {high:.3g}", low <= reached <= high)


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value


def checks(total: Tally) -> list[Check]:
    """All of them, for the rows that were computed."""
    return [
        *_data(total),
        *_shape(total),
        *_optimised(total),
        *_beaten(total),
        *_honest(total),
        *efficient(total),
    ]


def _data(total: Tally) -> list[Check]:
    """Is odometry as wrong as the paper's?"""
    out = []
    for unit, (wanted, _) in zip(("m", "deg"), printed.TABLE_3["odometry"], strict=True):
        low, high = wanted * (1 - CALIBRATED), wanted * (1 + CALIBRATED)
        reached = total[f"odometry/{unit}"].mean
        out.append(within(f"odometry alone, {unit}", reached, low, high))
    return out


def _shape(total: Tally) -> list[Check]:
    """Does the paper's column behave like the paper?"""
    out = []
    for tau in WINDOW_TAUS:
        for unit in ("m", "deg"):
            both = total[f"table1/{tau}/both/{unit}"].mean
            for part in ("nls", "coarse"):
                alone = total[f"table1/{tau}/{part}/{unit}"].mean
                words = f"paper, tau {tau}: coarse + NLS against {part} alone, {unit}"
                out.append(at_most(words, both, alone))
    for one, more in pairwise(WINDOW_TAUS):
        for unit in ("m", "deg"):
            short, long = (total[f"table1/{tau}/both/{unit}"].mean for tau in (one, more))
            out.append(at_most(f"paper, tau {more} against {one}, {unit}", long, short))
    for tau, epsilon in _computed(total):
        name = f"table2/{tau}/{epsilon}"
        for unit in ("m", "deg"):
            before, there, after = (
                total[f"{name}/{when}/{unit}"].mean for when in ("before", "there", "after")
            )
            row = f"paper, tau {tau}, epsilon {epsilon}"
            if epsilon is not None:
                raw = total[f"table2/{tau}/None/before/{unit}"].mean
                out.append(at_most(f"{row}: PCM lowers the error, {unit}", before, raw))
            words = f"{row}: DPGO lowers it again"
            out.append(at_most(f"{words}, where closures were kept, {unit}", there, before))
            out.append(at_most(f"{words}, at all pose times, {unit}", after, before))
    for unit, wanted in zip(("m", "deg"), printed.TABLE_2[BEST_ROW][3:], strict=True):
        words = f"paper, DPGO at tau 50, epsilon 0.5, {unit}"
        reached = total[f"table2/{BEST_ROW[0]}/{BEST_ROW[1]}/after/{unit}"].mean
        out.append(within(words, reached, wanted / LIKE_PRINTED, wanted * LIKE_PRINTED))
    return out


def _optimised(total: Tally) -> list[Check]:
    """Does DPGO, as the daemon runs it, come to its minimum and say no more than printed?"""
    out = []
    for tau, epsilon in _computed(total):
        row = f"table2/{tau}/{epsilon}"
        words = f"paper, tau {tau}, epsilon {epsilon}: DPGO in turns"
        least, rounds = (total[f"{row}/{name}"].mean for name in ("least/ate", "rounds"))
        ate = total[f"{row}/ate"].mean
        out.append(at_most(f"{words}, joint ATE against the minimum's", ate, LIKE_LEAST * least))
        out.append(at_most(f"{words}, rounds to within 1 % of the minimum", rounds, FEW_ROUNDS))
    said = "table4/paper/1/bytes"
    if said in total:
        most = 1e6 * printed.TABLE_4_MB["1"]
        out.append(at_most("paper, three daemons at 1 Hz, bytes", total[said].mean, most))
    return out


def _computed(total: Tally) -> list[tuple[int, float | None]]:
    return [
        (tau, epsilon)
        for tau in TAUS
        for epsilon in EPSILONS
        if f"table2/{tau}/{epsilon}/after/m" in total
    ]


def _beaten(total: Tally) -> list[Check]:
    """Is this system at most half as wrong, at every row?"""
    localised = total["drslamd/localised"].mean
    out = [at_least("drslamd, share of poses localised in one frame", localised, 1.0)]
    for tau, epsilon in _computed(total):
        for unit in ("m", "deg"):
            paper = total[f"table2/{tau}/{epsilon}/after/{unit}"].mean
            ours = total[f"drslamd/after/{unit}"].mean
            row = f"tau {tau}, epsilon {epsilon}, {unit}"
            out.append(
                at_most(f"drslamd against half of the paper's row {row}", ours, HALF * paper)
            )
    for unit, limit in (("m", BEST_M), ("deg", BEST_DEG)):
        out.append(at_most(f"drslamd, final, {unit}", total[f"drslamd/after/{unit}"].mean, limit))
    return out


def _honest(total: Tally) -> list[Check]:
    """Are claimed covariances true?"""
    short = f"table1/{WINDOW_TAUS[0]}/drslamd"
    words = "closures at tau 10 not marked ambiguous"
    if total[f"{short}/claim/below"].n:
        out = _claims(total, f"{short}/claim", words)
    else:
        asked = total[f"{short}/unique"].n
        name = f"{words}: none among {asked} windows"
        out = [Check(name, None, "98 % of them honest", asked > 0)]
    nees, published = total["drslamd/claim/nees"].mean, "drslamd/published"
    published_nees = total[f"{published}/nees"].mean
    inside = total[f"{published}/inside"].mean
    return [
        *out,
        *_claims(total, "drslamd/claim", "closures of the daemon's windows"),
        within("closures: NEES per degree of freedom", nees, 0.8, 1.25),
        within("published poses: NEES per degree of freedom", published_nees, 0.8, 1.25),
        within("published poses: share inside the 95 % ellipse", inside, 0.90, 0.99),
    ]


def _claims(total: Tally, name: str, words: str) -> list[Check]:
    """Squared errors of closures against what they claim."""
    below, wild = total[f"{name}/below"].mean, total[f"{name}/wild"].mean
    return [
        at_least(f"{words}: squared Mahalanobis <= 14.2", below, 0.98),
        at_most(f"{words}: squared Mahalanobis > 50", wild, 0.0),
    ]


def efficient(total: Tally) -> list[Check]:
    """Is the mean square error near the Cramer-Rao bound, for the teams that were played?"""
    return [
        at_least(
            f"{team.robots} robots, {team.loss:.0%} loss, {row}, {unit}: efficiency, same data",
            efficiency.on_same_data(total, f"{team.name}/{row}/{unit}"),
            efficiency.LEAST[team.loss],
        )
        for team in efficiency.TEAMS
        for row in efficiency.ROWS[:2]
        for unit in efficiency.UNITS
        if f"{team.name}/{row}/{unit}/bound" in total
    ]
