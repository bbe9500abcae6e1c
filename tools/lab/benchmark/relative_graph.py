"""Pose graphs that the team shares as relative poses in full precision, solved on every robot.

Every robot holds every edge, so robots that hold the same reach the same answer without exchanging
an iterate. Edges that have not arrived yet are missing; what is connected to us by those that have
is solved meanwhile.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.conventions import MAX_ROBOT_ID, Chain
from drslamd.slam.graph.measurements import RelativePoses
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.se2 import Array, Index

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


def solve(graph: PoseGraph, own: Chain) -> SolvedPoses | None:
    """The least cost of all relative poses of current chains; None while we have none.

    Keyframes of one number are taken for poses of one time. That is only an order of elimination:
    where it is not so the answer is the same and takes longer.
    """
    parts = [
        _keyed(origin.chain, batch)
        for _, origin in sorted(graph.chains.items())
        for _, relative in sorted(origin.relative.items())
        for batch in relative
        if graph.chains.get(batch.chain.robot, origin).chain == batch.chain
    ]
    if not parts:
        return None
    edges = ComplexFactors.joined(parts)
    keys, ends = np.unique(np.concatenate([edges.i, edges.j]), return_inverse=True)
    i, j = np.split(ends, 2)
    label = components(i, j, len(keys))
    ours = np.flatnonzero(keys % ROBOTS == own.robot)
    if not len(ours):
        return None
    inside = label == label[ours[0]]
    place, keys = np.cumsum(inside) - 1, keys[inside]
    numbered = replace(edges, i=place[i], j=place[j])
    # a pose relative to itself says nothing
    numbered = numbered.chosen(inside[i] & (i != j))
    answer = PoseGraphSolver(numbered, len(keys)).solve()
    return SolvedPoses(keys % ROBOTS, keys // ROBOTS, answer.poses, answer.cost, answer.converged)


def _keyed(origin: Chain, batch: RelativePoses) -> ComplexFactors:
    """Ends are named by one number for each keyframe; these sort by n, then by robot."""
    a, b = np.array(batch.a_n, dtype=np.int64), np.array(batch.b_n, dtype=np.int64)
    return ComplexFactors.relative(a * ROBOTS + origin.robot, b * ROBOTS + batch.chain.robot, batch)


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
