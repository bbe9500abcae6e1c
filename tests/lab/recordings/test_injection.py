"""Faults put into recordings: as many, as large and as consistent as they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from edge_recordings import SIGMAS, edged
from lab.play import edge_run
from lab.recordings import injection
from lab.recordings.recording import EdgeRecording, Recording
from lab.score import metrics

from drslamd.slam.odometry.noise import OdometryNoise


def ranged() -> Recording:
    t = np.arange(0, 300, 0.1)
    rows = [
        np.column_stack([t, np.full(len(t), a), np.full(len(t), b), np.full(len(t), 4.0)])
        for a, b in ((0, 1), (1, 2), (2, 1))
    ]
    table = np.concatenate(rows)
    return Recording("made", {}, table[np.argsort(table[:, 0], kind="stable")])


def test_a_tenth_of_the_ranges_of_each_pair_is_in_bursts_and_each_pair_has_its_bias() -> None:
    wrong = injection.wronged(ranged(), 0.10, 3).ranges
    biases = []
    for pair in ({0, 1}, {1, 2}):
        rows = [set(row) == pair for row in wrong[:, 1:3].astype(int)]
        off = wrong[rows, 3] - 4.0
        bias = float(np.median(off))
        assert injection.BIAS_M[0] <= bias <= injection.BIAS_M[1]
        bursts = off - bias > 1e-9
        assert 0.10 <= bursts.mean() < 0.15
        assert (off[bursts] - bias >= injection.BURST_M[0] - 1e-9).all()
        assert (off[bursts] - bias <= injection.BURST_M[1] + 1e-9).all()
        biases.append(bias)
    assert abs(biases[0] - biases[1]) > 1e-3


def test_the_same_seed_gives_the_same_faults() -> None:
    one, same, other = (injection.wronged(ranged(), 0.1, seed).ranges for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_false_edges_are_as_many_as_asked_for(share: float) -> None:
    clean = edged()
    played, is_true = injection.with_false_edges(clean, share, 5)
    assert is_true.sum() == len(clean.edges)
    assert (~is_true).sum() == pytest.approx(share * len(clean.edges), abs=1)
    assert np.array_equal(played.edges[is_true], clean.edges)


def test_a_group_of_false_edges_agrees_with_itself() -> None:
    """Left alone, the five of a group would be kept: they are a fair trap."""
    clean = edged()
    rng = np.random.default_rng(2)
    t, pair = clean.edges[:, 0], np.array([0.0, 1.0])
    group = injection._group(rng, clean, t, pair)
    only = EdgeRecording("false", clean.trails, group, SIGMAS)
    chains = {r: edge_run._chain(only, trail) for r, trail in only.trails.items()}
    noise = OdometryNoise(0.03, 0.0026, 0.01, 0.0087)
    assert edge_run.consistent(only, chains, noise, 0.1).sum() >= 4


def test_a_misled_pair_has_nothing_but_false_edges_that_agree() -> None:
    made = injection.misled(edged(), np.array([0, 1]), 12, 3)
    assert len(made.edges) == 12
    true = metrics.relative(
        *(metrics.at_times(t.t, t.truth, made.edges[:, 0]) for t in made.trails.values())
    )
    assert np.hypot(*(made.edges[:, 3:] - true)[:, :2].T).min() > 0.5
    chains = {robot: edge_run._chain(made, trail) for robot, trail in made.trails.items()}
    noise = OdometryNoise(0.03, 0.003, 0.01, 0.01)
    assert edge_run.consistent(made, chains, noise, 0.01).sum() >= 11
    other = edged().edges + [0, 0, 1, 0, 0, 0]
    more = replace(edged(), edges=np.concatenate([edged().edges, other]))
    kept = injection.misled(more, np.array([0, 1]), 12, 3).edges
    assert np.array_equal(kept[kept[:, 2] == 2], other)
    assert len(kept) == len(other) + 12
