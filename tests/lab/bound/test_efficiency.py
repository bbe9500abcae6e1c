"""Our errors beside the bound, in a short drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.bound import efficiency
from lab.bound.efficiency import ROWS, UNITS, Team
from lab.reproduce.experiment import SCENE
from lab.reproduce.tally import Tally


def test_efficiency_is_variance_over_mean_square_error() -> None:
    tally = Tally()
    metres, radians = np.array([0.3, 0.4]), np.radians([1.0, 2.0])
    errors = metres, np.degrees(radians)
    told = metres / 2, np.degrees(radians) * 0.75
    efficiency._put(tally, "x", (metres**2 / 2, radians**2 / 4), told, errors)
    assert efficiency.of(tally, "x/m") == pytest.approx(0.5)
    assert efficiency.of(tally, "x/deg") == pytest.approx(0.25)
    assert efficiency.on_same_data(tally, "x/m") == pytest.approx(0.25)
    assert efficiency.on_same_data(tally, "x/deg") == pytest.approx(0.5625)
    assert np.isnan(efficiency.of(tally, "y/m"))


def test_a_team_of_three_is_the_papers_and_a_larger_one_ranges_less_often() -> None:
    assert Team(3, 0.3).scene == SCENE
    assert Team(8, 0.0).scene == replace(SCENE, robots=8, range_hz=10)
    assert len({team.name for team in efficiency.TEAMS}) == 4


@pytest.mark.slow
def test_every_row_of_a_team_stands_beside_its_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    short = replace(SCENE, seconds=45.0, speed=0.5, range_hz=10)
    monkeypatch.setattr(efficiency, "SCENE", short)
    team = Team(3, 0.0)
    tally = efficiency.run(team, 2)
    for row in ROWS:
        for unit in UNITS:
            assert 0.05 < efficiency.of(tally, f"{team.name}/{row}/{unit}") < 5, (row, unit)
    # three pairs, once a second from 20 s on
    assert tally[f"{team.name}/hindsight/m/bound"].n == 3 * 24
    assert tally[f"{team.name}/first pose/m/bound"].n == 2
