"""How things that stand are measured."""

from __future__ import annotations

import numpy as np
import pytest
from lab.trust.standing import DRIVERS, MOVED_M, Run, lines, recorded, row


def test_lines_say_the_median_and_the_worst() -> None:
    runs = [
        Run(5.0, 12.0, [0.1, 0.2], 0, 0, [1.0, 2.0]),
        Run(7.0, 20.0, [0.3], 2, 1, [3.0], 9.0, 0.25, 0.15),
        Run(8.0, 30.0, [], 0, 0, []),
    ]
    said = "\n".join(lines("moved", runs))
    assert "two places or one: after 7 s (median), 8 s (most); one: 20 s, 30 s" in said
    assert "0.200 m off (median), 0.300 m (most); squared error by its covariance 2.00" in said
    assert "sigmas off): 2; headings: 1" in said
    assert "after 0 s (median), 9 s (most); drivers are off by at most 0.25 m from then" in said
    assert "(0.00 m, median), 0.15 m in the 10 s before (0.00 m, median)" in said


@pytest.mark.parametrize(("what", "robots"), [("robot", 3), ("module", 2), ("moved", 2)])
def test_what_stands_is_a_robot_or_a_module_that_measures_nothing(what: str, robots: int) -> None:
    recording, stands = recorded(what, 1, 4.0)
    assert len(recording.trails) == robots
    assert (DRIVERS in recording.ranges[:, 2]) is True
    assert bool((recording.ranges[:, 1] == DRIVERS).any()) is (what == "robot")
    moved = float(np.hypot(*(stands[-1] - stands[0])))
    assert moved == pytest.approx(MOVED_M if what == "moved" else 0.0)


def test_a_row_says_how_one_run_went() -> None:
    assert row("robot", 3, Run(known_s=12.0, off_m=[0.1, 0.2])) == (
        "seed 3: 12 s, 0.100, 0.200 m at the end, 0 wrong"
    )
    assert row("moved", 3, Run(known_s=12.0, wrong=2, dropped_s=9.0, worst_m=0.25)) == (
        "seed 3: 12 s, nobody knows it, m at the end, 2 wrong, 9 s, 0.25 m (before 0.00 m)"
    )
