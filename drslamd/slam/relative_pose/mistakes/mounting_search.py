"""Is a pair mounted as configured, and if its windows say no, which mistake explains them all?

Several windows are asked `what_if`; the sums of their chi-squared decide. Short windows fit wheels
that run backwards as well as wheels as configured, so a pair is believed only once its windows
exclude that: then it is confirmed, for mountings do not change; by one window alone until a later
one contradicts it. If they disagree again and again, a clear winner that fits is named. Track and
scale look much alike in a window: where one of them wins and it is not clear which, nothing is
named, and module 3 begins at the best of them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.slam.relative_pose.estimate import PairNoise, Verdict
from drslamd.slam.relative_pose.mistakes import what_if
from drslamd.slam.relative_pose.mistakes.evidence import (
    CLEAR,
    EXCLUDED,
    FITS,
    INDIFFERENT,
    against_backwards,
    against_configured,
    is_as_configured,
    least_of_backwards,
    winner,
)
from drslamd.slam.relative_pose.mistakes.what_if import (
    BACKWARDS,
    CASES,
    LEARNABLE,
    NEARBY,
    OUTPOSTS,
    Case,
    is_corrected,
    is_learned,
)
from drslamd.slam.se2 import Array

RECENT = 10
"""Windows that are remembered."""
MANY = 4
"""So many of them must disagree, or the pair counts as one that agrees."""
MOST = 7
"""Where so many do, no new closure is believed."""
APART_US = 4 * SECOND_US
"""Between two windows that are asked; a window is up to a minute long."""
MOVED_M = 1.0
"""A robot that drove less in a window looks the same in a mirror."""
FEWEST_ASKED, MOST_ASKED = 3, 12
"""Windows that decide."""
SHARED = 3
"""So many windows beyond the third are worth one: they share most of their data."""
QUICKLY_US = SECOND_US * 9 // 10
"""Between two windows that are asked quickly, while a pair waits for nothing else."""
SURELY = 7.0
"""Evidence (`chi_squared.evidence`) of a window against wheels that run backwards that confirms a
pair. A world whose wheels do is the mirror image of one whose do not: of 210 healthy pairs one ever
has 4.3 for the mirror image, eight more than 2.8."""
STEADILY, STEADY = 5.5, 3
"""So is the mean of that of so many: of the same pairs one ever has 3.1."""
SLIGHTLY = -2.0
"""By how much a track, a scale or a curve may seem better in such a window: chance."""
WATCHED = 16
"""So many windows after the one that confirmed a pair are asked, one a second: short windows hide a
track or a scale, and what is said meanwhile is doubtful as soon as they no longer do."""
CONTESTED = 15.0
"""Evidence of the two newest windows for a track or a scale that makes a pair doubtful which one
window confirmed. Tracks that are 30 % off have it one to three seconds later; of thirty-seven
healthy pairs one ever has more than 14, and two where sensors are as wrong as configured."""
BY_CHANCE = 4.0
"""Likewise the best of those that are asked first, for the others to be spared, once a window has
confirmed the pair: two sigmas of the one number in which it differs."""
_SAID = (Verdict.UNIQUE, Verdict.AMBIGUOUS, Verdict.POOR_FIT)


class _Answer(NamedTuple):
    costs: Array
    freedom: int


class MountingSearch:
    """Of one pair.

    Attributes:
        found: what explains the windows of late; None while nothing does.
        is_clear: is it that and nothing else?
        is_confirmed: did windows exclude what would look like the configuration?
        is_provisional: did one window do that alone, and not yet several together?
    """

    def __init__(self) -> None:
        self.found: Case | None = None
        self.is_clear = False
        self.is_confirmed = False
        self.is_provisional = False
        self._is_rather_another = False
        """Would all windows that are asked rather have a mistake?"""
        self._fits: deque[bool] = deque(maxlen=RECENT)
        self._answers: deque[_Answer] = deque(maxlen=MOST_ASKED)
        self._asked_at: int | None = None
        self._asked_quickly_at: int | None = None
        self._is_quick = False
        self._recent: deque[float] = deque(maxlen=STEADY - 1)
        self._worst = 0.0
        """Evidence against wheels that run backwards: of late, and the least ever."""
        self._unlike: deque[float] = deque(maxlen=2)
        """Evidence of windows of late against a track and a scale as configured."""
        self._watched = 0
        self._is_compared = False
        """Were windows with the repair asked whether it is the best of its like?"""

    def on_verdict(self, verdict: Verdict) -> None:
        """Module 1 has answered, with what is known of the mountings."""
        if verdict in _SAID:
            self._fits.append(verdict is not Verdict.POOR_FIT)

    @property
    def cases(self) -> Sequence[Case]:
        """What the next window is asked."""
        return CASES if self.found is None else what_if.variants(self.found)

    @property
    def asked_first(self) -> Sequence[int]:
        """The places of those that may spare the others; none where windows disagree."""
        spares = self.found is None and self.poor < MANY
        return OUTPOSTS if spares else ()

    @property
    def poor(self) -> int:
        """How many windows of late disagree."""
        return len(self._fits) - sum(self._fits)

    @property
    def is_puzzled(self) -> bool:
        """Do they, and no mistake explains it?"""
        return self.disagrees and self.found is None and len(self._answers) == MOST_ASKED

    @property
    def disagrees(self) -> bool:
        """Do ranges and odometries of the pair contradict each other again and again?"""
        return self.poor >= MOST

    @property
    def is_undecided(self) -> bool:
        """Does no mistake explain its windows clearly, and would they rather have another track,
        scale or curve than none?"""
        is_open = self.found is None and not self.is_confirmed
        return is_open and self._is_rather_another and len(self._answers) == MOST_ASKED

    @property
    def is_contested(self) -> bool:
        """Did one window confirm what others would rather have with another track or scale?"""
        return self.is_provisional and sum(self._unlike) >= CONTESTED

    def is_due(self, utime: int, awaits: bool) -> bool:
        """Is it time to ask?

        Args:
            awaits: would the pair be believed if it was confirmed?
        """
        return self._is_due(utime, awaits) or self._is_quickly_due(utime, awaits)

    def _is_due(self, utime: int, awaits: bool) -> bool:
        is_late = self._asked_at is None or utime - self._asked_at >= APART_US
        is_doubtful = self.poor >= MANY or awaits or self.is_provisional
        is_open = self.found is None and not self._is_final and is_doubtful
        is_doubtful = self.poor >= MANY or not self._is_compared
        is_vague = self.found is not None and is_learned(self.found) and is_doubtful
        return is_late and (is_open or is_vague)

    def _is_quickly_due(self, utime: int, awaits: bool) -> bool:
        last = self._asked_quickly_at
        is_late = last is None or utime - last >= QUICKLY_US
        # what so many windows leave open is asked rarely from then on
        is_open = awaits and not self.is_confirmed and len(self._answers) < MOST_ASKED
        is_new = self.is_provisional and self._watched < WATCHED
        return is_late and self.found is None and (is_open or is_new)

    @property
    def _is_final(self) -> bool:
        return self.is_confirmed and not self.is_provisional

    def _confirm(self, is_as_configured: bool) -> None:
        """Several windows together have answered."""
        if is_as_configured:
            self.is_confirmed, self.is_provisional = True, False

    def begin(self, utime: int, awaits: bool) -> None:
        """A window is asked now."""
        self._is_quick = not self._is_due(utime, awaits)
        self._asked_quickly_at = utime
        if not self._is_quick:
            self._asked_at = utime

    @property
    def _enough(self) -> float:
        """Evidence that confirms the pair, of the newest window."""
        is_known = len(self._recent) == STEADY - 1
        steadily = STEADY * STEADILY - sum(self._recent) if is_known else SURELY
        return min(SURELY, steadily) - self._worst

    def question(
        self, question: what_if.Question, noise: PairNoise, delta: float
    ) -> Callable[[], tuple[Array, float]]:
        """What is to be computed of that window: for `on_costs`, and how far the robot drove that
        drove less, m."""
        if self._is_quick and not self.is_provisional:
            return partial(_asked_quickly, question, noise, delta, self._enough)
        if self._is_quick:
            return partial(_watched, question, noise, delta)
        chance = BY_CHANCE if self.is_provisional else 0.0
        return partial(question.answer, self.cases, noise, delta, self.asked_first, chance)

    def on_costs(self, costs: Array, measurements: int, is_mirror_told: bool) -> bool:
        """`what_if.Question.costs` of a window are known. Is another mounting believed than before?

        Args:
            is_mirror_told: did both robots drive so that mirrored wheels would show?
        """
        if self.found is None:
            self._weigh(costs, measurements - 3, is_mirror_told)
        if self._is_quick:
            return False
        self._answers.append(_Answer(costs, measurements - 3))
        if self.found is not None:
            return self._refine(self.found)
        if self.is_provisional and costs.min() <= costs[0] - EXCLUDED:
            # one window may fit in a wrong valley
            self.is_confirmed = self.is_provisional = False
            return True
        newest = list(self._answers)[-FEWEST_ASKED:]
        together = np.array([n.costs for n in newest])
        self._confirm(is_as_configured(together, sum(n.freedom for n in newest), is_mirror_told))
        asked = len(self._answers)
        if asked < FEWEST_ASKED:
            return False
        worth = FEWEST_ASKED + (asked - FEWEST_ASKED) / SHARED
        total = worth * np.mean([answer.costs for answer in self._answers], axis=0)
        freedom = worth * float(np.mean([answer.freedom for answer in self._answers]))
        if asked == MOST_ASKED:
            is_other = total.min() <= min(total[0] - CLEAR, FITS * freedom)
            is_backwards = least_of_backwards(total - total[0], True) < INDIFFERENT
            self._confirm(not (is_other or is_backwards))
            self._is_rather_another = bool(is_other) and int(total.argmin()) not in BACKWARDS
        case, is_clear = winner(total, freedom)
        # whatever happens to a mounting that was right is something else
        if case is None or self._is_final:
            return False
        self.found, self.is_clear, self._is_compared = case, is_clear, False
        self.is_confirmed, self.is_provisional = is_corrected(case), False
        # windows with the repair speak for themselves
        self._fits.clear()
        self._answers.clear()
        return True

    def _weigh(self, costs: Array, freedom: int, is_mirror_told: bool) -> None:
        """What one window says by itself."""
        is_watched = self._is_quick and self.is_provisional
        self._watched = self._watched + 1 if self.is_provisional else 0
        self._unlike.append(against_configured(costs, freedom))
        if is_watched or not is_mirror_told:
            return
        found = against_backwards(costs, freedom)
        is_alone = found >= self._enough and bool((costs - costs[0] >= SLIGHTLY).all())
        if is_alone and not self.is_confirmed:
            self.is_confirmed = self.is_provisional = True
        self._recent.append(found)
        self._worst = min(self._worst, found)

    def _refine(self, found: Case) -> bool:
        """Is it a little more, or less, or another mistake of the same robots? The first windows
        with the repair are asked, whose factors are coarse, and those that disagree."""
        total = np.sum([answer.costs for answer in self._answers], axis=0)
        if len(self._answers) < FEWEST_ASKED:
            return False
        freedom = sum(answer.freedom for answer in self._answers)
        self._answers.clear()
        if total.min() > freedom:
            # not even what is allowed for explains it: it was something else
            self.found, self.is_clear, self.is_confirmed = None, False, False
            return True
        is_better = self.poor >= MANY or total.min() <= total[0] - EXCLUDED
        self._is_compared = True
        if not is_better:
            return False
        self.found = what_if.variants(found)[int(np.argmin(total))]
        self.is_clear = self.is_clear and self.found.kind == found.kind
        return self.found != found


def _asked_quickly(
    question: what_if.Question, noise: PairNoise, delta: float, enough: float
) -> tuple[Array, float]:
    """Of the cases so many as it takes to know whether this window alone confirms the pair."""
    costs = np.full(len(CASES), np.inf)

    def ask(places: Sequence[int]) -> None:
        costs[list(places)] = question.costs([CASES[place] for place in places], noise, delta)

    ask((0, *BACKWARDS))
    if against_backwards(costs, len(question.window) - 3) >= enough:
        ask(what_if.BESIDE)
        if SLIGHTLY <= costs.min() - costs[0] < 0:
            ask(what_if.BEYOND)
    return costs, question.way_m


def _watched(question: what_if.Question, noise: PairNoise, delta: float) -> tuple[Array, float]:
    """Of the cases those that `against_configured` looks at, and nothing else does then."""
    costs, cases = np.full(len(CASES), np.inf), [CASES[place] for place in LEARNABLE]
    costs[list(LEARNABLE)] = question.costs(cases, noise, delta, NEARBY, BY_CHANCE)
    return costs, question.way_m
