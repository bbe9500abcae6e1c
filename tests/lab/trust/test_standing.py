"""How things that stand are measured."""

from __future__ import annotations

import numpy as np
import pytest
from lab.play import virtual_team
from lab.trust import standing
from lab.trust.standing import DRIVERS, MOVED_M, Run, lines, recorded, row


def test_lines_say_the_median_and_the_worst() -> None:
    runs = [
        Run(5.0, 12.0, [0.1, 0.2], 0, 0, [1.0, 2.0]),
        Run(7.0, 20.0, [0.3], 2, 1, [3.0], 9.0, 0.25, 0.15, 0.4),
        Run(8.0, 30.0, [], 0, 0, []),
    ]
    said = "\n".join(lines("moved", runs))
    assert "two places or one: after 7 s (median), 8 s (most); one: 20 s, 30 s" in said
    assert "0.200 m off (median), 0.300 m (most); squared error by its covariance 2.00" in said
    assert "sigmas off): 2; headings: 1" in said
    assert "after 0 s (median), 9 s (most); drivers are off by at most 0.25 m in the 30 s" in said
    assert "(0.00 m, median), 0.40 m after these, 0.15 m in the 10 s before (0.00 m," in said


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
    moved = Run(known_s=12.0, wrong=2, dropped_s=9.0, worst_m=0.25, later_m=0.4)
    assert row("moved", 3, moved) == (
        "seed 3: 12 s, nobody knows it, m at the end, 2 wrong, 9 s, 0.25 m (before 0.00 m, later "
        "0.40 m)"
    )


def test_what_comes_later_than_it_has_to_be_dropped_is_told_apart(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Drivers that are off by the number of the second, of a run of 80 s."""

    class Idle:
        now = 0

        def run(self, second: int) -> None:
            self.now = second

    idle = Idle()
    monkeypatch.setattr(standing, "recorded", lambda *_: (None, np.zeros((2, 2))))
    monkeypatch.setattr(virtual_team, "start", lambda *_: idle)
    monkeypatch.setattr(standing, "_look", lambda *_: None)
    monkeypatch.setattr(standing, "apart_off", lambda *_: float(idle.now))
    run = standing.play("moved", 1, 80.0)
    assert (run.before_m, run.worst_m, run.later_m) == (40.0, 70.0, 79.0)
