"""Modules 2 and 3 on relative poses of which some are false."""

from __future__ import annotations

import pytest
from edge_recordings import edged
from lab.play import edge_run
from lab.recordings import injection
from lab.score import metrics


@pytest.mark.parametrize("optimizer", ["rbcd", "closures"])
def test_true_edges_survive_and_false_ones_do_not_even_in_groups(optimizer: str) -> None:
    played, is_true = injection.with_false_edges(edged(), 0.4, 1)
    result, kept = edge_run.run(played, optimizer=optimizer)
    assert kept[is_true].mean() > 0.95
    assert is_true[kept].mean() > 0.97
    assert result.is_one_team
    truth = {r: metrics.at_times(x.t, x.truth, result.final[r].t) for r, x in played.trails.items()}
    poses = {r: path.poses for r, path in result.final.items()}
    frames = {r: path.frame for r, path in result.final.items()}
    errors = metrics.team_errors(metrics.aligned(poses, truth, frames), truth)
    assert errors["team"]["ate_rmse_m"] < 0.05
