"""Pose graphs that the team shares as relative poses in full precision, solved on every robot.

Every robot holds every edge, so robots that hold the same reach the same answer without exchanging
an iterate. Edges that have not arrived yet are missing; what is connected to us by those that have
is solved meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain as joined

import numpy as np

from drslamd.conventions import MAX_ROBOT_ID, Chain
from drslamd.slam.chordal import PoseGraph
from drslamd.slam.items import RelativePoses
from drslamd.slam.pose_graph import TeamGraph
from drslamd.slam.problem import Index
from drslamd.slam.rbcd import ComplexEdges
from drslamd.slam.se2 import Array

ROBOTS = MAX_ROBOT_ID + 1


@dataclass(frozen=True)
class SolvedPoses:
    """What is connected to us.

    Attributes:
        robot, n: (k,) whose keyframe each pose is, and which; in the order of n, then of robots.
        poses: (k, 3), in any frame.
    """

    robot: Index
    n: Index
    poses: Array
    cost: float
    converged: bool


def solve(graph: TeamGraph, own: Chain) -> SolvedPoses | None:
    """The least cost of all relative poses of current chains; None while we have none.

    Keyframes of one number are taken for poses of one time. That is only an order of elimination:
    where it is not so the answer is the same and takes longer.
    """
    batches = [
        (origin.chain, batch)
        for _, origin in sorted(graph.chains.items())
        for _, relative in sorted(origin.relative.items())
        for batch in relative
        if graph.chains.get(batch.chain.robot, origin).chain == batch.chain
    ]
    if not batches:
        return None
    keys, ends = np.unique(
        np.concatenate([_keys(batches, origin=True), _keys(batches, origin=False)]),
        return_inverse=True,
    )
    i, j = np.split(ends, 2)
    label = components(i, j, len(keys))
    ours = np.flatnonzero(keys % ROBOTS == own.robot)
    if not len(ours):
        return None
    inside = label == label[ours[0]]
    place = np.cumsum(inside) - 1
    used = inside[i]
    edges = _edges(batches, place[i], place[j]).chosen(used)
    keys = keys[inside]
    answer = PoseGraph(edges, len(keys)).solve()
    return SolvedPoses(keys % ROBOTS, keys // ROBOTS, answer.poses, answer.cost, answer.converged)


def _keys(batches: list[tuple[Chain, RelativePoses]], origin: bool) -> Index:
    """(m,) one number for the keyframe at one end of each edge; they sort by n, then by robot."""
    counts = [len(batch.a_n) for _, batch in batches]
    robots = np.repeat([a.robot if origin else batch.chain.robot for a, batch in batches], counts)
    n = joined.from_iterable(batch.a_n if origin else batch.b_n for _, batch in batches)
    return np.asarray(np.fromiter(n, np.int64) * ROBOTS + robots)


def _edges(batches: list[tuple[Chain, RelativePoses]], i: Index, j: Index) -> ComplexEdges:
    x, y, theta, tau, kappa = (
        np.fromiter(joined.from_iterable(getattr(batch, name) for _, batch in batches), float)
        for name in ("x", "y", "theta", "tau", "kappa")
    )
    # the square of the complex difference is that of the angle, to first order
    return ComplexEdges(i, j, np.exp(1j * theta), x + 1j * y, kappa, tau)


def components(i: Index, j: Index, count: int) -> Index:
    """(count,) for each vertex the lowest one that edges (m,) connect it to."""
    label = np.arange(count)
    while True:
        low = np.minimum(label[i], label[j])
        new = label.copy()
        np.minimum.at(new, label[i], low)
        np.minimum.at(new, label[j], low)
        while (new[new] != new).any():
            new = new[new]
        if (new == label).all():
            return label
        label = new
