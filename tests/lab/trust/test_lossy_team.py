"""How a team is measured that drives past modules while messages are lost."""

from __future__ import annotations

import numpy as np
from lab.trust.lossy_team import Live, lines, play, recorded


def test_modules_stand_and_measure_nothing() -> None:
    recording = recorded(robots=3, modules=2, seed=1, seconds=4.0)
    assert sorted(recording.trails) == [0, 1, 2]
    assert set(recording.ranges[:, 1].tolist()) == {0.0, 1.0, 2.0}
    assert {3.0, 4.0} <= set(recording.ranges[:, 2].tolist())


def test_errors_of_all_seeds_are_one_root_mean_square() -> None:
    pairs = [
        (Live(0.1, 0.3, 3, 2), Live(0.1, 0.3, 3, 2)),
        (Live(0.7, 0.4, 3, 1), Live(0.7, 1, 3, 2)),
    ]
    said = "\n".join(lines(0.3, pairs))
    assert "all poses: 0.500 m, 0.500 m at 30% loss, 1.00 times" in said
    assert "second half: 0.354 m, 0.738 m at 30% loss, 2.09 times" in said
    assert "2 seeds; at least 1 of the modules were known at the end" in said


def test_who_has_not_met_yet_has_no_error() -> None:
    live = play(recorded(robots=2, modules=1, seed=1, seconds=3.0), 1, 0.3, 1)
    assert np.isnan([live.ate_m, live.late_m]).all()
    assert (live.robots, live.known) == (0, 0)
