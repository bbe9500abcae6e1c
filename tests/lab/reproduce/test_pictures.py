"""Pictures of tools/reproduce: which of them are drawn, and which window is called ambiguous."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.recordings.recording import Array
from lab.reproduce import experiment, pictures
from lab.reproduce.tally import Tally
from reproduce_totals import good


def valleys(*depths: float) -> Array:
    """A cost of 10 with minima of these depths, far from each other."""
    cost = np.full((64, 64), 10.0)
    for k, depth in enumerate(depths):
        cost[20 * k + 5, 20 * k + 5] = 10.0 - depth
    return cost


def test_a_map_is_the_more_ambiguous_the_deeper_its_second_valley_is() -> None:
    assert pictures.rivalry(valleys(9.0, 8.0)) == pytest.approx(1 / 2)
    assert pictures.rivalry(valleys(9.0, 9.0)) == pytest.approx(1.0)
    assert pictures.rivalry(valleys(9.0, 5.0, 8.5)) == pytest.approx(1 / 1.5)


def test_residuals_are_least_near_the_true_pose() -> None:
    trial = experiment.trial(experiment.TYPICAL_SEED)
    window = trial.window((0, 1), 200, 200)
    assert window is not None
    angles, cost = pictures.mean_residuals(window)
    i, j = np.unravel_index(int(np.argmin(cost)), cost.shape)
    x, y, theta = trial.true_pairs(0, 1)[200]
    off = np.array([angles[i] - np.arctan2(y, x), angles[j] - theta])
    assert np.abs((off + np.pi) % (2 * np.pi) - np.pi).max() < 0.3


def test_sweeps_are_drawn_once_they_were_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for others in ("heat_maps", "panels"):
        monkeypatch.setattr(pictures, others, lambda data, path: None)
    assert pictures.draw(good(), tmp_path) == ["heat-maps.png", "panels.png"]
    assert not list(tmp_path.iterdir())
    total = Tally()
    total.add("sweep/delta/0.1/paper/m", 1.0)
    assert pictures.draw(total, tmp_path)[2:] == ["sweeps.png"]
    assert (tmp_path / "sweeps.png").read_bytes().startswith(b"\x89PNG")
