"""Windows of a pair that disagree again and again: which mistake explains them all?

Three windows that hardly share data are asked `what_if`; the sums of their chi-squared decide. Only
a clear winner that fits is named. Where there is none only the robots that may be at fault are.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.slam.relative_pose.estimate import Verdict
from drslamd.slam.relative_pose.range_fit import POOR_FIT
from drslamd.slam.relative_pose.what_if import CASES, Case
from drslamd.slam.se2 import Array

RECENT = 10
"""Windows that are remembered."""
MANY = 7
"""So many of them must disagree, or the pair counts as one that agrees."""
FEW = 3
"""Only so many of them may, or what was found stays."""
APART_US = 8 * SECOND_US
"""Between two windows that are asked."""
ASKED = 3
"""Windows that decide."""
CLEAR = 100.0
"""How many times the best chi-squared per degree of freedom the next kind must be worse: at 0.5 m/s
this names three of four faults after a minute, and none wrongly."""

_SAID = (Verdict.UNIQUE, Verdict.AMBIGUOUS, Verdict.POOR_FIT)


class _Answer(NamedTuple):
    utime: int
    costs: Array
    freedom: int


class MountingSearch:
    """Of one pair.

    Attributes:
        found: the clear winner of late; None while there is none.
    """

    def __init__(self) -> None:
        self.found: Case | None = None
        self._fits: deque[bool] = deque(maxlen=RECENT)
        self._answers: deque[_Answer] = deque(maxlen=ASKED)
        self._asked_at: int | None = None

    def on_verdict(self, verdict: Verdict) -> None:
        """Module 1 has answered, with what is known of the mountings."""
        if verdict in _SAID:
            self._fits.append(verdict is not Verdict.POOR_FIT)

    @property
    def poor(self) -> int:
        """How many windows of late disagree."""
        return len(self._fits) - sum(self._fits)

    @property
    def is_puzzled(self) -> bool:
        """Do they, and no mistake explains it?"""
        return self.disagrees and self.found is None and len(self._answers) == ASKED

    @property
    def disagrees(self) -> bool:
        """Do ranges and odometries of the pair contradict each other again and again?"""
        return self.poor >= MANY

    def is_due(self, utime: int) -> bool:
        """Is it time to ask?"""
        is_late = self._asked_at is None or utime - self._asked_at >= APART_US
        return self.disagrees and self.found is None and is_late

    def begin(self, utime: int) -> None:
        """A window is asked now."""
        self._asked_at = utime

    def on_costs(self, utime: int, costs: Array, measurements: int) -> None:
        """`what_if.Question.costs` of a window at `utime` are known."""
        self._answers.append(_Answer(utime, costs, measurements - 3))
        self.found = self._winner()
        if self.found is not None:
            # windows with the repair speak for themselves
            self._fits.clear()
            self._answers.clear()

    def _winner(self) -> Case | None:
        if len(self._answers) < ASKED:
            return None
        total = np.sum([answer.costs for answer in self._answers], axis=0)
        freedom = sum(answer.freedom for answer in self._answers)
        best = int(np.argmin(total))
        others = [total[k] for k, case in enumerate(CASES) if case.kind != CASES[best].kind]
        level = total[best] / freedom
        if not best or level > POOR_FIT or (min(others) - total[best]) < CLEAR * max(level, 1.0):
            return None
        return CASES[best]
