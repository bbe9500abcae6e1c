"""What windows say for and against a mounting: the configured one, and those of `CASES`.

All of it is made of chi-squared of windows under each of these (`what_if.Question.costs`).
"""

from __future__ import annotations

import numpy as np

from drslamd.slam.chi_squared import evidence
from drslamd.slam.relative_pose.mistakes.what_if import (
    BACKWARDS,
    CASES,
    LEARNABLE,
    MIRROR,
    Case,
    is_curve,
    is_learned,
    is_like,
)
from drslamd.slam.relative_pose.range_fit import POOR_FIT
from drslamd.slam.se2 import Array

EXCLUDED = 20.0
"""By how much chi-squared of the newest three windows must be worse where wheels run backwards. Of
fifteen teams all are confirmed after 12 to 44 s (median 20 s), and of forty with wheels that run
backwards or count wrongly none is."""
WRONG, CLEAR = 60.0, 30.0
"""By how much chi-squared must fall, over that of a degree of freedom, for the configuration to be
wrong, and by how much the next kind must be worse, for wheels that run backwards to be named (so
much as well, of the newest `MOST_ASKED` windows, for it not to be believed). Of twenty-one such
robots all are, after 20 to 48 s, and in eighty pairs without such wheels none."""
BETTER, UNLIKE = 100.0, 40.0
"""Likewise for a track or a scale to begin with, and by how much all that is no track or scale of
the same robot must be worse. Of eighteen robots that count wrongly all begin near the truth after
24 to 72 s; of fifteen healthy pairs none begins elsewhere, of six with blocked sight one does."""
FITS = 0.7
"""Chi-squared per degree of freedom of windows that a track, a scale or a curve really explains: it
is 0.2 to 0.6, because noise is allowed for generously; more, where sight is blocked."""
MUCH = 0.6
"""Of chi-squared that is left where a track, a scale or a curve explains some of it."""
INDIFFERENT = -5.0
"""Who drives straight for long is the same in a mirror: then what is configured is believed. So is
it against wheels of unlike size: of six pairs with bent ways none is confirmed."""
SURE_FIT = 0.45
"""As `FITS`, of such a window: one with a burst of wrong ranges had 11 for the mirror image."""


def is_as_configured(costs: Array, freedom: float, is_mirror_told: bool) -> bool:
    """Do windows exclude that wheels run backwards, and is no other mistake better?

    Where nothing fits, as when sight is blocked, a track, a scale or a curve is better by chance.
    So they count only where the windows, each under the one that explains it best, the configured
    one among them, fit: of a mistake that is there each short window has an idea of its own.

    Args:
        costs: (windows, cases) chi-squared of up to three windows; freedom: degrees of all.
    """
    chi2 = costs.sum(axis=0)
    worse = chi2 - chi2[0]
    # (short ways hardly tell a slight curve from none)
    least = [INDIFFERENT if is_curve(case) else 0.0 for case in CASES]
    backwards = least_of_backwards(worse, is_mirror_told) / max(chi2[0] / freedom, 1.0)
    others = np.delete(np.arange(len(CASES)), BACKWARDS)
    explained = costs[:, others].min(axis=1).sum()
    explains = explained <= max(FITS * freedom, MUCH * chi2[0])
    is_none_better = bool((worse >= least).all())
    return bool(backwards >= EXCLUDED and (is_none_better or not explains))


def against_backwards(chi2: Array, freedom: int) -> float:
    """Evidence of one window against wheels that run backwards; none for them, where it fits badly.

    Args:
        chi2: (cases,); freedom: degrees of it.
    """
    best = float(chi2[0])
    if not np.isfinite(best):
        return 0.0
    least = min(evidence(float(chi2[place]) - best, best, freedom) for place in BACKWARDS)
    return least if best <= SURE_FIT * freedom else min(least, 0.0)


def against_configured(chi2: Array, freedom: int) -> float:
    """Evidence of one window for the best track or scale, against those that are configured.

    Args:
        chi2: (cases,); freedom: degrees of it.
    """
    best, configured = float(chi2[list(LEARNABLE)].min()), float(chi2[0])
    if not np.isfinite(configured):
        return 0.0
    return evidence(configured - best, best, freedom)


def least_of_backwards(worse: Array, is_mirror_told: bool) -> float:
    """The least of what windows have against wheels that run backwards."""
    places = (place for place in BACKWARDS if is_mirror_told or CASES[place] != MIRROR)
    return min(float(worse[place]) for place in places)


def winner(chi2: Array, freedom: float) -> tuple[Case | None, bool]:
    """Which of `CASES` explains windows, if any does, and whether only that one does.

    Args:
        chi2: (cases,) of all windows together; freedom: degrees of it.
    """
    best = int(np.argmin(chi2))
    level = float(chi2[best]) / freedom
    if level > POOR_FIT:
        return None, False
    worse = (chi2 - chi2[best]) / max(level, 1.0)
    case = CASES[best]
    others = min(by for by, other in zip(worse, CASES, strict=True) if other.kind != case.kind)
    if not is_learned(case):
        # sight that is blocked looks like a curve, and hardly like wheels that run backwards
        fits = level <= FITS or not is_curve(case)
        return (case, True) if fits and worse[0] >= WRONG and others >= CLEAR else (None, False)
    unlike = min(by for by, other in zip(worse, CASES, strict=True) if not is_like(other, case))
    is_start = level <= FITS and worse[0] >= BETTER and unlike >= UNLIKE
    return (case, bool(others >= UNLIKE)) if is_start else (None, False)
