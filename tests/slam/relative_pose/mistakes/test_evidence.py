"""What windows say for and against a mounting.

Chi-squared of every case is made up; thresholds are those of the module.
"""

from __future__ import annotations

import numpy as np
import pytest
from mounting_costs import (
    AS_IT_IS,
    FIT,
    FREEDOM,
    LEFT,
    LITTLE,
    RIGHT,
    SCALE,
    TRACK,
    costs,
)

from drslamd.slam.chi_squared import LEVEL_FREEDOM
from drslamd.slam.odometry.mounting import COARSE_SCALES, CURVES, MIRRORED, SCALES, SIDES, TRACKS
from drslamd.slam.relative_pose.mistakes.evidence import (
    BETTER,
    CLEAR,
    EXCLUDED,
    FITS,
    INDIFFERENT,
    MUCH,
    UNLIKE,
    WRONG,
    against_configured,
    is_as_configured,
    winner,
)
from drslamd.slam.relative_pose.mistakes.what_if import (
    CASES,
    MIRROR,
    Case,
    is_curve,
    is_learned,
)
from drslamd.slam.relative_pose.range_fit import POOR_FIT

# who wins


@pytest.mark.parametrize("level", [0.5, 1.0, 2.0])
@pytest.mark.parametrize(
    ("worse", "next_worse", "wins"),
    [
        (WRONG + LITTLE, CLEAR + LITTLE, True),
        (WRONG - LITTLE, CLEAR + LITTLE, False),
        (WRONG + LITTLE, CLEAR - LITTLE, False),
    ],
)
def test_wheels_that_run_backwards_win_by_far_and_only_they(
    level: float, worse: float, next_worse: float, wins: bool
) -> None:
    """By multiples of what a degree of freedom scatters, where that is more than it should."""
    unit, fit = max(level, 1.0), level * FREEDOM
    found = winner(
        costs({LEFT: fit, AS_IT_IS: fit + worse * unit, RIGHT: fit + next_worse * unit}), FREEDOM
    )
    assert found == ((LEFT, True) if wins else (None, False))


@pytest.mark.parametrize("rival", [MIRROR, RIGHT, TRACK, Case(a=SIDES[0])])
def test_any_other_kind_makes_it_unclear(rival: Case) -> None:
    known = {LEFT: FIT, AS_IT_IS: FIT + WRONG + LITTLE}
    assert winner(costs({**known, rival: FIT + CLEAR - LITTLE}), FREEDOM) == (None, False)
    assert winner(costs({**known, rival: FIT + CLEAR + LITTLE}), FREEDOM) == (LEFT, True)


@pytest.mark.parametrize(("level", "wins"), [(POOR_FIT - 0.01, True), (POOR_FIT + 0.01, False)])
def test_what_does_not_fit_itself_is_no_explanation(level: float, wins: bool) -> None:
    found, _ = winner(costs({LEFT: level * FREEDOM}), FREEDOM)
    assert (found == LEFT) is wins


@pytest.mark.parametrize(
    ("worse", "unlike", "is_begun"),
    [
        (BETTER + LITTLE, UNLIKE + LITTLE, True),
        (BETTER - LITTLE, UNLIKE + LITTLE, False),
        (BETTER + LITTLE, UNLIKE - LITTLE, False),
    ],
)
@pytest.mark.parametrize("best", [TRACK, SCALE, Case(COARSE_SCALES[1], COARSE_SCALES[1])])
def test_a_track_or_a_scale_is_begun_with_where_nothing_unlike_it_fits(
    best: Case, worse: float, unlike: float, is_begun: bool
) -> None:
    found, _ = winner(
        costs({best: FIT, AS_IT_IS: FIT + worse, Case(a=SIDES[1]): FIT + unlike}), FREEDOM
    )
    assert found == (best if is_begun else None)


@pytest.mark.parametrize(
    ("rival", "is_unlike"),
    [
        (Case(b=SCALES[3]), False),
        (Case(b=TRACKS[1]), False),
        (Case(a=SCALES[3]), True),
        (Case(COARSE_SCALES[3], COARSE_SCALES[3]), True),
        (LEFT, True),
        (MIRROR, True),
    ],
)
def test_tracks_and_scales_of_the_same_robots_are_alike(rival: Case, is_unlike: bool) -> None:
    known = {TRACK: FIT, AS_IT_IS: FIT + BETTER + LITTLE, rival: FIT + LITTLE}
    found, is_clear = winner(costs(known), FREEDOM)
    assert found == (None if is_unlike else TRACK)
    # another track is the same mistake, a scale is another one
    assert is_clear is (rival.kind == TRACK.kind)


@pytest.mark.parametrize(("level", "is_begun"), [(FITS - 0.01, True), (FITS + 0.01, False)])
def test_a_track_or_a_scale_must_fit_well_itself(level: float, is_begun: bool) -> None:
    found, _ = winner(costs({SCALE: level * FREEDOM}), FREEDOM)
    assert found == (SCALE if is_begun else None)


@pytest.mark.parametrize(("level", "is_named"), [(FITS - 0.01, True), (FITS + 0.01, False)])
def test_a_curve_must_fit_well_itself_to_be_named(level: float, is_named: bool) -> None:
    case, is_clear = winner(costs({Case(b=CURVES[0]): level * FREEDOM}), FREEDOM)
    assert (case == Case(b=CURVES[0]), is_clear) == (is_named, is_named)


@pytest.mark.parametrize(("by", "confirms"), [(INDIFFERENT + 1, True), (INDIFFERENT - 1, False)])
def test_a_pair_is_not_confirmed_where_a_curve_is_better_by_more_than_chance(
    by: float, confirms: bool
) -> None:
    chi2 = costs({AS_IT_IS: FIT, Case(a=CURVES[2]): FIT + by})
    assert is_as_configured(chi2[None], FREEDOM, True) is confirms


def test_what_is_configured_wins_nothing() -> None:
    assert winner(costs({AS_IT_IS: 10.0}), FREEDOM) == (None, False)


def test_what_is_learned_are_tracks_and_scales_and_no_mistake_at_all() -> None:
    learned = [case for case in CASES if is_learned(case) or is_curve(case)]
    backwards = {MIRROR, *(Case(a=side) for side in SIDES), *(Case(b=side) for side in SIDES)}
    assert set(CASES) - set(learned) == backwards
    assert AS_IT_IS in learned
    assert not is_learned(Case(a=TRACKS[0], b=MIRRORED))


# what confirms the configuration


@pytest.mark.parametrize(
    ("case", "by", "is_told", "confirms"),
    [
        (LEFT, EXCLUDED + LITTLE, True, True),
        (LEFT, EXCLUDED - LITTLE, True, False),
        (LEFT, EXCLUDED - LITTLE, False, False),
        (Case(a=SIDES[1]), EXCLUDED - LITTLE, True, False),
        (MIRROR, EXCLUDED + LITTLE, True, True),
        (MIRROR, EXCLUDED - LITTLE, True, False),
        (MIRROR, EXCLUDED - LITTLE, False, True),
        (TRACK, LITTLE, True, True),
        (TRACK, -LITTLE, True, False),
        (MIRROR, -LITTLE, False, False),
    ],
)
def test_windows_must_exclude_wheels_that_run_backwards_and_find_no_other_mistake_better(
    case: Case, by: float, is_told: bool, confirms: bool
) -> None:
    """A robot that hardly drove is the same in a mirror, and is not asked about that."""
    known = costs({AS_IT_IS: FIT, case: FIT + by})
    assert is_as_configured(known[None], FREEDOM, is_told) is confirms


@pytest.mark.parametrize(
    ("level", "left", "confirms"),
    [
        # nothing explains what blocked sight does, whatever is a little better
        (2.0, MUCH + LITTLE, True),
        (2.0, MUCH - LITTLE, False),
        # what fits well explains it, and what fits well as configured is told from it
        (1.1, FITS / 1.1 + LITTLE, True),
        (1.1, FITS / 1.1 - LITTLE, False),
        (FITS - LITTLE, 0.9, False),
    ],
)
@pytest.mark.parametrize("case", [TRACK, SCALE, Case(a=CURVES[2])])
def test_where_nothing_fits_only_what_explains_it_speaks_against_the_configuration(
    case: Case, level: float, left: float, confirms: bool
) -> None:
    chi2 = level * FREEDOM
    known = costs({AS_IT_IS: chi2, case: left * chi2})
    assert is_as_configured(known[None], FREEDOM, True) is confirms


@pytest.mark.parametrize(("left", "confirms"), [(MUCH + LITTLE, True), (MUCH - LITTLE, False)])
def test_each_window_may_have_another_idea_of_what_is_wrong(left: float, confirms: bool) -> None:
    """Of three short windows none fits, and one mistake explains each; none explains all."""
    chi2 = 2.0 * FREEDOM / 3
    cases = (TRACK, SCALE, Case(a=SCALES[3]))
    elsewhere = {AS_IT_IS: chi2} | dict.fromkeys(cases, 0.9 * chi2)
    windows = np.array([costs({**elsewhere, case: left * chi2}) for case in cases])
    together = windows.sum(axis=0)
    assert together.min() > MUCH * together[0]
    assert is_as_configured(windows, FREEDOM, True) is confirms


@pytest.mark.parametrize("level", [0.5, 1.0, 3.0])
def test_windows_that_fit_badly_must_exclude_backwards_by_multiples_of_how_badly(
    level: float,
) -> None:
    chi2, unit = level * FREEDOM, max(level, 1.0)
    for by, confirms in ((EXCLUDED + LITTLE, True), (EXCLUDED - LITTLE, False)):
        known = costs({AS_IT_IS: chi2, LEFT: chi2 + by * unit})
        assert is_as_configured(known[None], FREEDOM, True) is confirms


# another track or scale


FREE = 30
"""Degrees of freedom of a window of 33 measurements."""


@pytest.mark.parametrize("other", [TRACK, SCALE, Case(COARSE_SCALES[0], COARSE_SCALES[0])])
def test_what_another_track_or_scale_fits_better_is_evidence_against_the_configuration(
    other: Case,
) -> None:
    """As many times as the level of noise, which the best fit tells, in units of log-likelihood."""
    best = 4.0
    known = costs({AS_IT_IS: best + 5.0, other: best})
    expected = (LEVEL_FREEDOM + FREE) * np.log(1 + 5.0 / (LEVEL_FREEDOM + best))
    assert against_configured(known, FREE) == pytest.approx(expected)


@pytest.mark.parametrize("other", [LEFT, MIRROR, Case(a=CURVES[0])])
def test_wheels_that_run_backwards_and_curves_are_no_such_evidence(other: Case) -> None:
    """The first have tests of their own, and short ways hardly tell a slight curve from none."""
    assert against_configured(costs({AS_IT_IS: 9.0, other: 4.0}), FREE) == 0.0


def test_nor_is_a_window_that_does_not_fit_as_configured_at_all() -> None:
    assert against_configured(costs({AS_IT_IS: np.inf, TRACK: 4.0}), FREE) == 0.0
    assert against_configured(costs({}, rest=np.inf), FREE) == 0.0
