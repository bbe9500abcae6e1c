"""When a pair is believed to be mounted as configured, and when a mistake is named.

Chi-squared of every case is made up; thresholds are those of the module.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from mounting_costs import (
    AS_IT_IS,
    FAR,
    FIT,
    GOOD,
    LEFT,
    LITTLE,
    SCALE,
    TRACK,
    costs,
)
from slam_scenes import Array

from drslamd.slam.chi_squared import LEVEL_FREEDOM
from drslamd.slam.odometry.mounting import CURVES
from drslamd.slam.relative_pose.estimate import Verdict
from drslamd.slam.relative_pose.mistakes.evidence import (
    BETTER,
    CLEAR,
    EXCLUDED,
    FITS,
    INDIFFERENT,
    SURE_FIT,
    WRONG,
    against_backwards,
)
from drslamd.slam.relative_pose.mistakes.mounting_search import (
    APART_US,
    BY_CHANCE,
    CONTESTED,
    FEWEST_ASKED,
    MANY,
    MOST,
    MOST_ASKED,
    QUICKLY_US,
    RECENT,
    SHARED,
    SLIGHTLY,
    STEADILY,
    STEADY,
    SURELY,
    WATCHED,
    MountingSearch,
)
from drslamd.slam.relative_pose.mistakes.what_if import (
    BACKWARDS,
    CASES,
    MIRROR,
    OUTPOSTS,
    Case,
    is_learned,
    variants,
)
from drslamd.slam.relative_pose.range_fit import POOR_FIT


def test_a_pair_is_confirmed_once_and_for_all() -> None:
    for best in (LEFT, TRACK):
        search = MountingSearch()
        assert not search.is_confirmed
        assert not ask(search, {AS_IT_IS: GOOD}, rest=GOOD + EXCLUDED)
        assert search.is_confirmed
        for _ in range(MOST_ASKED):
            assert not ask(search, {best: GOOD})
        assert search.is_confirmed
        assert search.found is None


def ask(
    search: MountingSearch, known: dict[Case, float], rest: float = FAR, is_told: bool = True
) -> bool:
    """One window of 33 measurements."""
    return search.on_costs(costs(known, rest), 33, is_told)


def test_the_newest_windows_together_exclude_what_one_alone_does_not() -> None:
    """Each says a little more than a third of what is asked for."""
    search, each = MountingSearch(), EXCLUDED / FEWEST_ASKED + LITTLE
    for asked in range(1, FEWEST_ASKED + 1):
        ask(search, {AS_IT_IS: GOOD, LEFT: GOOD + each})
        assert search.is_confirmed is (asked == FEWEST_ASKED)
    later = MountingSearch()
    # what came before them does not count
    for _ in range(FEWEST_ASKED):
        ask(later, {AS_IT_IS: GOOD, LEFT: GOOD})
    for asked in range(1, FEWEST_ASKED + 1):
        ask(later, {AS_IT_IS: GOOD, LEFT: GOOD + each})
        assert later.is_confirmed is (asked == FEWEST_ASKED)
    vague = MountingSearch()
    for _ in range(MOST_ASKED - 1):
        ask(vague, {AS_IT_IS: GOOD, LEFT: GOOD + each - 2 * LITTLE})
    assert not vague.is_confirmed


@pytest.mark.parametrize(("by", "confirms"), [(INDIFFERENT + 1, True), (INDIFFERENT - 1, False)])
def test_who_is_the_same_in_a_mirror_for_long_is_believed_as_configured(
    by: float, confirms: bool
) -> None:
    """So much better in all windows together, which are worth less than their number."""
    worth = FEWEST_ASKED + (MOST_ASKED - FEWEST_ASKED) / SHARED
    search = MountingSearch()
    for asked in range(1, MOST_ASKED + 1):
        ask(search, {AS_IT_IS: GOOD, MIRROR: GOOD + by / worth})
        assert search.is_confirmed is (confirms and asked == MOST_ASKED)
    assert search.found is None


@pytest.mark.parametrize(
    ("by", "fit", "confirms"),
    [
        (CLEAR + LITTLE, GOOD, False),
        (CLEAR - LITTLE, GOOD, True),
        # where nothing fits, as when sight is blocked, another track is better by chance
        (CLEAR + LITTLE, 2 * FITS * 30, True),
    ],
)
def test_nor_is_that_believed_while_something_else_explains_what_it_does_not(
    by: float, fit: float, confirms: bool
) -> None:
    """Of two robots one counts wrongly, and windows do not tell which: nothing is found. The same
    in a mirror is what is configured."""
    worth = FEWEST_ASKED + (MOST_ASKED - FEWEST_ASKED) / SHARED
    search = MountingSearch()
    for _ in range(MOST_ASKED):
        either = {TRACK: fit, SCALE: fit, Case(a=TRACK.b): fit, Case(a=SCALE.b): fit}
        as_it_is = fit + by / worth
        ask(search, {AS_IT_IS: as_it_is, MIRROR: as_it_is, **either})
        assert search.found is None
    assert search.is_confirmed is confirms
    assert search.is_undecided is not confirms


def test_who_would_rather_run_backwards_on_one_side_is_not_undecided_about_a_track() -> None:
    search = MountingSearch()
    either = {LEFT: GOOD, Case(a=LEFT.b): GOOD}
    for _ in range(MOST_ASKED):
        ask(search, {AS_IT_IS: GOOD + CLEAR, MIRROR: GOOD + CLEAR, **either})
    assert search.found is None
    assert not search.is_confirmed
    assert not search.is_undecided


# what is found


def test_a_mistake_is_found_after_windows_enough_and_what_was_before_is_forgotten() -> None:
    search = MountingSearch()
    for _ in range(RECENT):
        search.on_verdict(Verdict.POOR_FIT)
    for asked in range(1, FEWEST_ASKED + 1):
        assert ask(search, {LEFT: GOOD}) is (asked == FEWEST_ASKED)
        assert search.found == (LEFT if asked == FEWEST_ASKED else None)
    assert search.is_clear
    # of wheels that run backwards nothing is believed
    assert not search.is_confirmed
    assert search.poor == 0
    assert not search.disagrees


def test_with_a_track_or_a_scale_the_pair_is_believed() -> None:
    search = MountingSearch()
    for _ in range(FEWEST_ASKED):
        ask(search, {TRACK: GOOD, SCALE: GOOD + LITTLE})
    assert search.found == TRACK
    assert search.is_confirmed
    assert not search.is_clear


def test_all_windows_decide_and_those_beyond_the_third_count_for_less() -> None:
    """By so much each that six of them name it, and five do not."""
    worth = FEWEST_ASKED + 3 / SHARED
    each = WRONG / worth + LITTLE
    assert each * (FEWEST_ASKED + 2 / SHARED) < WRONG
    search = MountingSearch()
    for asked in range(1, 7):
        ask(search, {LEFT: GOOD, AS_IT_IS: GOOD + each})
        assert (search.found == LEFT) is (asked == 6)


def test_degrees_of_freedom_are_those_of_measurements_less_the_three_of_a_pose() -> None:
    level = POOR_FIT * 30
    for chi2, is_found in ((level - 1.0, True), (level + 1.0, False)):
        search = MountingSearch()
        for _ in range(FEWEST_ASKED):
            ask(search, {LEFT: chi2})
        assert (search.found == LEFT) is is_found


# a mistake that was found is refined


def of_variants(found: Case, best: Case, chi2: float = GOOD) -> Array:
    return np.array([chi2 if case == best else chi2 + 30 for case in variants(found)])


def begun() -> MountingSearch:
    search = MountingSearch()
    for _ in range(FEWEST_ASKED):
        ask(search, {TRACK: GOOD})
    assert search.cases == variants(TRACK)
    return search


def test_a_mistake_is_refined_by_as_many_windows_as_found_it() -> None:
    search, better = begun(), variants(TRACK)[3]
    for asked in range(1, FEWEST_ASKED + 1):
        changed = search.on_costs(of_variants(TRACK, better), 33, True)
        assert changed is (asked == FEWEST_ASKED)
        assert search.found == (better if changed else TRACK)
    # and again from there
    assert search.cases == variants(better)
    for _ in range(FEWEST_ASKED):
        changed = search.on_costs(of_variants(better, better), 33, True)
    assert not changed
    assert search.found == better
    assert search.is_confirmed


@pytest.mark.parametrize(
    ("better_by", "poor", "is_left"),
    [
        (EXCLUDED - LITTLE, 0, False),
        (EXCLUDED + LITTLE, 0, True),
        (LITTLE, MANY - 1, False),
        (LITTLE, MANY, True),
    ],
)
def test_the_first_windows_with_a_repair_must_clearly_prefer_another_unless_they_disagree(
    better_by: float, poor: int, is_left: bool
) -> None:
    """Factors are coarse, and counts may be taken for a track though every window fits."""
    search, better = begun(), variants(TRACK)[-1]
    for _ in range(poor):
        search.on_verdict(Verdict.POOR_FIT)
    costs = of_variants(TRACK, better)
    costs[0] = GOOD + better_by / FEWEST_ASKED
    changed = [search.on_costs(costs, 33, True) for _ in range(FEWEST_ASKED)]
    assert changed == [False, False, is_left]
    assert search.found == (better if is_left else TRACK)


@pytest.mark.parametrize("place", [3, -1])
def test_a_track_may_turn_out_to_be_a_scale_and_then_nothing_is_clear(place: int) -> None:
    search, better = begun(), variants(TRACK)[place]
    assert (better.kind != TRACK.kind) is (place == -1)
    for _ in range(FEWEST_ASKED):
        search.on_costs(of_variants(TRACK, better), 33, True)
    assert search.found == better
    assert search.is_clear is (place == 3)


@pytest.mark.parametrize(("level", "stays"), [(0.99, True), (1.01, False)])
def test_a_mistake_with_which_windows_do_not_fit_after_all_was_none(
    level: float, stays: bool
) -> None:
    search = begun()
    for asked in range(1, FEWEST_ASKED + 1):
        changed = search.on_costs(of_variants(TRACK, TRACK, 30 * level), 33, True)
        assert changed is (asked == FEWEST_ASKED and not stays)
    assert search.found == (TRACK if stays else None)
    assert search.is_confirmed is stays
    assert search.is_clear is stays
    assert search.cases == (variants(TRACK) if stays else CASES)


# when it is asked


def test_a_new_pair_is_asked_every_case_there_is() -> None:
    assert MountingSearch().cases == CASES


@pytest.mark.parametrize(
    ("poor", "awaits", "is_due"),
    [
        (0, False, False),
        (0, True, True),
        (MANY - 1, False, False),
        (MANY, False, True),
    ],
)
def test_it_is_asked_where_windows_disagree_or_a_pair_waits_to_be_believed(
    poor: int, awaits: bool, is_due: bool
) -> None:
    search = MountingSearch()
    for _ in range(poor):
        search.on_verdict(Verdict.POOR_FIT)
    assert search.is_due(0, awaits) is is_due
    search.is_confirmed = True
    assert not search.is_due(0, awaits)


@pytest.mark.parametrize(("poor", "is_short"), [(MANY - 1, True), (MANY, False)])
def test_where_windows_agree_some_cases_may_spare_the_others(poor: int, is_short: bool) -> None:
    search = MountingSearch()
    for _ in range(poor):
        search.on_verdict(Verdict.POOR_FIT)
    assert bool(search.asked_first) is is_short
    search.found = TRACK
    assert not search.asked_first


@pytest.mark.parametrize(("apart_us", "is_due"), [(APART_US - 1, False), (APART_US, True)])
def test_windows_that_are_asked_are_some_seconds_apart(apart_us: int, is_due: bool) -> None:
    search = MountingSearch()
    for _ in range(MANY):
        search.on_verdict(Verdict.POOR_FIT)
    search.begin(1_000, False)
    assert search.is_due(1_000 + apart_us, False) is is_due


@pytest.mark.parametrize(
    ("apart_us", "is_due"), [(QUICKLY_US - 1, False), (QUICKLY_US, True), (APART_US, True)]
)
def test_a_pair_that_waits_for_nothing_else_is_asked_about_every_window(
    apart_us: int, is_due: bool
) -> None:
    search = MountingSearch()
    search.begin(1_000, True)
    assert search.is_due(1_000 + apart_us, True) is is_due
    assert search.is_due(1_000 + apart_us, False) is False
    search.is_confirmed = True
    assert not search.is_due(1_000 + apart_us, True)


# one window that is sure, or a few

FREE = 30
"""Degrees of freedom of a window of 33 measurements."""
BEST = 0.9 * SURE_FIT * FREE


def excluding(by: float, place: int = 1, best: float = BEST) -> Array:
    """A window with so much evidence against one kind of wheels that run backwards."""
    worse = (LEVEL_FREEDOM + best) * np.expm1(by / (LEVEL_FREEDOM + FREE))
    return costs({AS_IT_IS: best, CASES[place]: best + worse})


def confirms(*windows: Array, is_told: bool = True) -> bool:
    """Is a pair confirmed by these windows, asked quickly?"""
    search = MountingSearch()
    search.begin(0, True)
    search.begin(QUICKLY_US, True)
    for window in windows:
        assert not search.on_costs(window, FREE + 3, is_told)
    return search.is_confirmed


@pytest.mark.parametrize("place", BACKWARDS)
@pytest.mark.parametrize(("by", "is_sure"), [(SURELY + LITTLE, True), (SURELY - LITTLE, False)])
def test_one_window_may_exclude_wheels_that_run_backwards(
    place: int, by: float, is_sure: bool
) -> None:
    assert against_backwards(excluding(by, place), FREE) == pytest.approx(by)
    assert confirms(excluding(by, place)) is is_sure


@pytest.mark.parametrize(
    ("by", "count", "is_sure"),
    [
        (STEADILY + LITTLE, STEADY, True),
        (STEADILY + LITTLE, STEADY - 1, False),
        (STEADILY - LITTLE, STEADY + 2, False),
    ],
)
def test_so_may_a_few_in_a_row(by: float, count: int, is_sure: bool) -> None:
    assert confirms(*[excluding(by)] * count) is is_sure


@pytest.mark.parametrize(("by", "is_sure"), [(LITTLE, True), (-LITTLE, False)])
def test_a_window_must_outweigh_what_ever_spoke_for_wheels_that_run_backwards(
    by: float, is_sure: bool
) -> None:
    """Mountings do not change: however long ago it was."""
    mirrored = costs({AS_IT_IS: 40.0, MIRROR: BEST})
    contrary = -against_backwards(mirrored, FREE)
    between = [excluding(0.0)] * 20
    assert confirms(mirrored, *between, excluding(SURELY + contrary + by)) is is_sure


def test_a_window_for_wheels_that_run_backwards_speaks_against_those_beside_it() -> None:
    mirrored = costs({AS_IT_IS: 40.0, MIRROR: BEST})
    assert against_backwards(mirrored, FREE) < -10
    assert not confirms(mirrored, *[excluding(STEADILY + LITTLE)] * (STEADY - 1))


@pytest.mark.parametrize(("level", "says"), [(SURE_FIT - LITTLE, 20.0), (SURE_FIT + LITTLE, 0.0)])
def test_a_window_that_does_not_fit_well_is_never_sure(level: float, says: float) -> None:
    found = against_backwards(excluding(20.0, best=level * FREE), FREE)
    assert found == pytest.approx(says)
    assert against_backwards(np.full(len(CASES), np.inf), FREE) == 0.0


@pytest.mark.parametrize("case", [TRACK, SCALE, Case(a=CURVES[0])])
@pytest.mark.parametrize(("by", "is_sure"), [(2 - LITTLE, True), (2 + LITTLE, False)])
def test_nor_is_one_that_another_mistake_explains_better(
    case: Case, by: float, is_sure: bool
) -> None:
    assert confirms(costs({AS_IT_IS: BEST, case: BEST - by})) is is_sure


@pytest.mark.parametrize("is_told", [True, False])
def test_who_is_sure_is_confirmed_where_both_robots_drove(is_told: bool) -> None:
    assert confirms(excluding(20.0), is_told=is_told) is is_told


def unlike(by: float, case: Case = TRACK) -> Array:
    """A window with so much evidence for another track or scale."""
    best = 4.0
    worse = (LEVEL_FREEDOM + best) * np.expm1(by / (LEVEL_FREEDOM + FREE))
    return costs({AS_IT_IS: best + worse, case: best}, rest=best + worse)


def sure(watched: int = WATCHED) -> MountingSearch:
    """One window has confirmed it alone, and so many after it have said nothing."""
    search = MountingSearch()
    search.begin(0, True)
    search.begin(QUICKLY_US, True)
    search.on_costs(excluding(20.0), FREE + 3, True)
    for later in range(watched):
        search.begin(QUICKLY_US + later, False)
        search.on_costs(unlike(0.0), FREE + 3, True)
    search.begin(APART_US, False)
    return search


def test_who_was_confirmed_by_one_window_is_asked_until_several_do_so_together() -> None:
    search = sure()
    assert (search.is_confirmed, search.is_provisional) == (True, True)
    assert not search.is_due(2 * APART_US - 1, False)
    assert search.is_due(2 * APART_US, False)
    assert not ask(search, {AS_IT_IS: GOOD}, rest=GOOD + EXCLUDED)
    assert (search.is_confirmed, search.is_provisional) == (True, False)
    assert not search.is_due(3 * APART_US, False)


@pytest.mark.parametrize("case", [TRACK, SCALE, LEFT, Case(a=CURVES[0])])
@pytest.mark.parametrize(("by", "is_left"), [(EXCLUDED - LITTLE, True), (EXCLUDED + LITTLE, False)])
def test_nothing_is_left_of_that_where_a_later_window_has_a_much_better_explanation(
    case: Case, by: float, is_left: bool
) -> None:
    """The first window may fit in a wrong valley."""
    search = sure()
    assert ask(search, {AS_IT_IS: GOOD + by, case: GOOD}) is not is_left
    assert (search.is_confirmed, search.is_provisional) == (is_left, is_left)
    assert search.found is None


@pytest.mark.parametrize(
    ("windows", "is_contested"),
    [
        ((CONTESTED / 2 + LITTLE, CONTESTED / 2), True),
        ((CONTESTED / 2 - LITTLE, CONTESTED / 2), False),
        ((CONTESTED, 0.0, 0.0), False),
    ],
)
def test_the_newest_two_windows_contest_what_one_alone_confirmed(
    windows: tuple[float, ...], is_contested: bool
) -> None:
    """The pair stays connected: module 3 may be learning that track."""
    search = sure()
    for by in windows:
        search.on_costs(unlike(by), FREE + 3, True)
    assert search.is_contested is is_contested
    assert search.is_confirmed


def test_what_several_windows_confirmed_is_not_contested() -> None:
    search = sure()
    ask(search, {AS_IT_IS: GOOD}, rest=GOOD + EXCLUDED)
    assert not search.is_provisional
    for _ in range(2):
        search.on_costs(unlike(CONTESTED), FREE + 3, True)
    assert not search.is_contested


def test_windows_of_that_time_are_asked_about_tracks_and_no_longer_about_backwards() -> None:
    """What confirms the pair once more, should it come to that, is as much as before."""
    search = sure(watched=0)
    search.begin(APART_US + QUICKLY_US, False)
    search.on_costs(excluding(-3.0), FREE + 3, True)
    search.begin(2 * APART_US, False)
    assert ask(search, {AS_IT_IS: GOOD + EXCLUDED + LITTLE, TRACK: GOOD})
    assert not search.is_confirmed
    search.begin(2 * APART_US + QUICKLY_US, True)
    search.on_costs(excluding(SURELY + LITTLE), FREE + 3, True)
    assert search.is_confirmed


def test_a_pair_that_one_window_confirmed_is_watched_for_a_while() -> None:
    """Each second, by tracks and scales alone; every few seconds by all that may win."""
    search, utime, whole_at = sure(watched=0), APART_US, APART_US
    assert not search.is_due(utime + QUICKLY_US - 1, False)
    for watched in range(WATCHED):
        utime += QUICKLY_US
        assert search.is_due(utime, False), watched
        search.begin(utime, False)
        question = Asked({})
        told: Any = search.question(cast(Any, question), cast(Any, None), 0.1)()
        if utime - whole_at >= APART_US:
            assert told == (OUTPOSTS, BY_CHANCE)
            whole_at = utime
        else:
            assert np.isfinite(told[0]).tolist() == [is_learned(case) for case in CASES]
            assert question.first == {
                CASES[place] for place in OUTPOSTS if is_learned(CASES[place])
            }
        search.on_costs(unlike(0.0), FREE + 3, True)
    assert search.is_provisional
    assert not search.is_due(utime + QUICKLY_US, False)


@pytest.mark.parametrize(("asked", "is_due"), [(MOST_ASKED - 1, True), (MOST_ASKED, False)])
def test_what_so_many_windows_leave_open_is_no_longer_asked_each_second(
    asked: int, is_due: bool
) -> None:
    """A track is better by more than chance, and by less than what names it."""
    search, last = MountingSearch(), (asked - 1) * APART_US
    for k in range(asked):
        search.begin(k * APART_US, True)
        better = {TRACK: GOOD, AS_IT_IS: GOOD + CLEAR / 5, MIRROR: GOOD + CLEAR / 5}
        assert not ask(search, better)
    assert not search.is_confirmed
    assert search.is_due(last + QUICKLY_US, True) is is_due
    assert search.is_due(last + APART_US, True)


def test_what_several_windows_say_finds_a_mistake_after_that() -> None:
    search = sure()
    for _ in range(FEWEST_ASKED - 1):
        ask(search, {AS_IT_IS: GOOD + BETTER, TRACK: GOOD})
    assert ask(search, {AS_IT_IS: GOOD + BETTER, TRACK: GOOD})
    assert search.found == TRACK


class Asked:
    """A window that is asked: what each case costs, and which were asked."""

    window = range(FREE + 3)
    way_m = 5.0

    def __init__(self, known: dict[Case, float]) -> None:
        self.known, self.asked = known, list[Case]()
        self.first: set[Case] = set()

    def costs(
        self, cases: Any, noise: Any, delta: float, first: Any = (), chance: float = 0.0
    ) -> Array:
        self.asked += cases
        assert chance == (BY_CHANCE if first else 0.0)
        self.first = {cases[at] for at in first}
        return np.array([self.known.get(case, FAR) for case in cases])

    def answer(self, cases: Any, noise: Any, delta: float, first: Any, chance: float) -> Any:
        return first, chance


@pytest.mark.parametrize(
    ("known", "asked"),
    [
        ({MIRROR: BEST + 1}, 1 + len(BACKWARDS)),
        ({}, len(OUTPOSTS)),
        ({TRACK: BEST + SLIGHTLY - LITTLE}, len(OUTPOSTS)),
        ({TRACK: BEST + SLIGHTLY + LITTLE}, len(CASES)),
        ({TRACK: BEST - LITTLE}, len(CASES)),
    ],
)
def test_a_quick_question_asks_no_more_than_it_takes_to_know_whether_a_window_is_sure(
    known: dict[Case, float], asked: int
) -> None:
    search, question = MountingSearch(), Asked({AS_IT_IS: BEST, **known})
    search.begin(0, True)
    search.begin(QUICKLY_US, True)
    found, way_m = search.question(cast(Any, question), cast(Any, None), 0.1)()
    assert (len(question.asked), way_m) == (asked, 5.0)
    assert len(set(question.asked)) == asked
    is_better = bool(known) and min(known.values()) < BEST + SLIGHTLY
    search.on_costs(found, FREE + 3, True)
    assert search.is_confirmed is (MIRROR not in known and not is_better)
    # what was asked quickly decides nothing else
    assert not any(search.on_costs(costs({LEFT: FIT}), FREE, True) for _ in range(FEWEST_ASKED))


@pytest.mark.parametrize(("is_sure", "chance"), [(False, 0.0), (True, BY_CHANCE)])
def test_chance_spares_cases_only_once_a_window_has_confirmed_the_pair(
    is_sure: bool, chance: float
) -> None:
    search = sure() if is_sure else MountingSearch()
    search.begin(2 * APART_US, True)
    told: Any = search.question(cast(Any, Asked({})), cast(Any, None), 0.1)()
    assert told == (OUTPOSTS, chance)


@pytest.mark.parametrize(
    ("found", "poor", "is_due"),
    [(TRACK, MANY, True), (TRACK, MANY - 1, False), (LEFT, MANY, False)],
)
def test_what_was_compared_is_asked_about_again_only_where_it_can_be_refined_and_does_not_fit(
    found: Case, poor: int, is_due: bool
) -> None:
    search = MountingSearch()
    for _ in range(FEWEST_ASKED):
        ask(search, {found: GOOD})
    assert search.found == found
    for _ in range(FEWEST_ASKED if found == TRACK else 0):
        assert search.is_due(0, False)
        assert not search.on_costs(of_variants(found, found), 33, True)
    for _ in range(poor):
        search.on_verdict(Verdict.POOR_FIT)
    assert search.is_due(0, False) is is_due


# what windows say


@pytest.mark.parametrize(
    ("verdict", "counts"),
    [
        (Verdict.UNIQUE, True),
        (Verdict.AMBIGUOUS, True),
        (Verdict.UNOBSERVABLE, False),
        (Verdict.TOO_FEW, False),
    ],
)
def test_windows_that_say_nothing_do_not_count(verdict: Verdict, counts: bool) -> None:
    search = MountingSearch()
    for _ in range(RECENT):
        search.on_verdict(Verdict.POOR_FIT)
    search.on_verdict(verdict)
    assert search.poor == RECENT - counts


@pytest.mark.parametrize(("poor", "disagrees"), [(MOST - 1, False), (MOST, True)])
def test_a_pair_disagrees_where_most_of_its_last_windows_do(poor: int, disagrees: bool) -> None:
    search = MountingSearch()
    for k in range(3 * RECENT):
        search.on_verdict(Verdict.UNIQUE if k % RECENT >= poor else Verdict.POOR_FIT)
    assert search.disagrees is disagrees


@pytest.mark.parametrize(("asked", "is_puzzled"), [(MOST_ASKED - 1, False), (MOST_ASKED, True)])
def test_nobody_knows_why_once_all_windows_were_asked_in_vain(asked: int, is_puzzled: bool) -> None:
    """Nothing fits, and what is configured not better than its mirror image."""
    search = MountingSearch()
    for _ in range(MOST):
        search.on_verdict(Verdict.POOR_FIT)
    for _ in range(asked):
        ask(search, {MIRROR: FAR / 2})
    assert search.is_puzzled is is_puzzled
    fits = MountingSearch()
    for _ in range(asked):
        ask(fits, {MIRROR: FAR / 2})
    assert not fits.is_puzzled


def test_the_constants_are_in_an_order_that_makes_sense() -> None:
    assert 0 < MANY < MOST < RECENT
    assert FEWEST_ASKED + 3 < MOST_ASKED
