"""Faults put into recordings that came too clean: bursts and biases of ranges, false edges.

Sizes are those of real recordings: bursts where bodies block the way are positive and last 1.6 s in
the mean; modules that nobody calibrated are 0.19 to 0.49 m long, each pair by its own constant.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.recordings.recording import Array, EdgeRecording, Recording
from lab.score import metrics

BURST_S = 1.6
"""Mean of the exponential length of a burst."""
BURST_M = (0.3, 3.0)
BIAS_M = (0.19, 0.49)
GROUP = 5
"""False edges that agree with each other."""
GROUP_S = 10.0
"""Time within which such a group lies."""
ROOM_M = 8.0
"""False edges name places up to so far away in x and y."""


def wronged(recording: Recording, share: float, seed: int) -> Recording:
    """A copy with bursts on `share` of the ranges and a bias for every pair of modules."""
    rng = np.random.default_rng(seed)
    ranges = recording.ranges.copy()
    pairs = np.sort(ranges[:, 1:3], axis=1)
    for pair in np.unique(pairs, axis=0):
        rows = np.flatnonzero((pairs == pair).all(axis=1))
        rows = rows[np.argsort(ranges[rows, 0], kind="stable")]
        bias = rng.uniform(*BIAS_M)
        ranges[rows, 3] += bias + _bursts(rng, ranges[rows, 0], share)
    return replace(recording, name=f"{recording.name}, wronged by seed {seed}", ranges=ranges)


def _bursts(rng: np.random.Generator, t: Array, share: float) -> Array:
    """(k,) metres to add: bursts at random moments until they cover `share` of the ranges."""
    extra = np.zeros(len(t))
    while np.count_nonzero(extra) < share * len(t):
        start = rng.uniform(t[0], t[-1])
        size, length = rng.uniform(*BURST_M), rng.exponential(BURST_S)
        inside = (t >= start) & (t <= start + length)
        extra[inside] = size
    return extra


def with_false_edges(
    recording: EdgeRecording, share: float, seed: int
) -> tuple[EdgeRecording, Array]:
    """A copy with `share` as many false edges as true ones, and which (k,) are true.

    Half of them are random; half come in groups of five, each group by one wrong idea of where the
    other robot's odometry started, so that odometry confirms them to each other.
    """
    rng = np.random.default_rng(seed)
    rows = [recording.edges]
    for pair in np.unique(recording.edges[:, 1:3], axis=0):
        true = recording.edges[(recording.edges[:, 1:3] == pair).all(axis=1)]
        count = round(share * len(true))
        groups = round(count / 2 / GROUP)
        when = rng.choice(true[:, 0], count - groups * GROUP)
        rows.append(np.column_stack([when, np.tile(pair, (len(when), 1)), _places(rng, len(when))]))
        rows += [_group(rng, recording, true[:, 0], pair) for _ in range(groups)]
    edges = np.concatenate(rows)
    is_true = np.arange(len(edges)) < len(recording.edges)
    order = np.argsort(edges[:, 0], kind="stable")
    return replace(recording, edges=edges[order]), is_true[order]


def misled(recording: EdgeRecording, pair: Array, count: int, seed: int) -> EdgeRecording:
    """A copy in which all edges of one pair (2,) are `count` ones that agree, and are wrong."""
    others = recording.edges[(recording.edges[:, 1:3] != pair).any(axis=1)]
    true = recording.edges[(recording.edges[:, 1:3] == pair).all(axis=1)]
    false = _group(np.random.default_rng(seed), recording, true[:, 0], pair, count)
    edges = np.concatenate([others, false])
    return replace(recording, edges=edges[np.argsort(edges[:, 0], kind="stable")])


def _places(rng: np.random.Generator, count: int) -> Array:
    """(count, 3) anywhere."""
    most = np.array([ROOM_M, ROOM_M, np.pi])
    return np.asarray(rng.uniform(-most, most, (count, 3)))


def _group(
    rng: np.random.Generator, recording: EdgeRecording, t: Array, pair: Array, count: int = GROUP
) -> Array:
    """(count, 6) edges that agree, and are wrong; five within ten seconds."""
    start = rng.choice(t)
    when = np.sort(rng.uniform(start, min(start + GROUP_S * count / GROUP, t[-1]), count))
    a, b = (recording.trails[int(robot)] for robot in pair)
    a_poses = metrics.at_times(a.t, a.odometry, when)
    b_poses = metrics.at_times(b.t, b.odometry, when)
    first = _places(rng, 1)
    origin = metrics.compose(
        metrics.compose(a_poses[:1], first), metrics.relative(b_poses[:1], np.zeros((1, 3)))
    )
    poses = metrics.relative(a_poses, metrics.compose(origin, b_poses))
    metres, radians = recording.sigmas
    poses = poses + rng.normal(size=poses.shape) * [metres, metres, radians]
    return np.column_stack([when, np.tile(pair, (count, 1)), poses])
