"""Pose graphs that the team shares as relative poses in full precision, solved on every robot.

Every robot holds every edge, so robots that hold the same reach the same answer without exchanging
an iterate. Edges that have not arrived yet are missing; what is connected to us by those that have
is solved meanwhile.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drslamd.conventions import MAX_ROBOT_ID
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.se2 import Array, Index
from lab.benchmark.over_messages.relative_poses import RelativePoses

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


def solve(held: Mapping[tuple[int, int], RelativePoses], own: int) -> SolvedPoses | None:
    """The least cost of all relative poses that we hold; None while none leads to us.

    Args:
        held: by origin and number in its log.
        own: our robot.

    Keyframes of one number are taken for poses of one time. That is only an order of elimination:
    where it is not so the answer is the same and takes longer.
    """
    if not held:
        return None
    # in one order, whichever came first
    edges = ComplexFactors.joined([_keyed(origin, held[origin, k]) for origin, k in sorted(held)])
    keys, ends = np.unique(np.concatenate([edges.i, edges.j]), return_inverse=True)
    i, j = np.split(ends, 2)
    label = components(i, j, len(keys))
    ours = np.flatnonzero(keys % ROBOTS == own)
    if not len(ours):
        return None
    inside = label == label[ours[0]]
    place, keys = np.cumsum(inside) - 1, keys[inside]
    numbered = replace(edges, i=place[i], j=place[j])
    # a pose relative to itself says nothing
    numbered = numbered.chosen(inside[i] & (i != j))
    answer = PoseGraphSolver(numbered, len(keys)).solve()
    return SolvedPoses(keys % ROBOTS, keys // ROBOTS, answer.poses, answer.cost, answer.converged)


def _keyed(origin: int, poses: RelativePoses) -> ComplexFactors:
    """Ends are named by one number for each keyframe; these sort by n, then by robot."""
    edges = poses.edges
    i, j = edges["a_n"].astype(np.int64), edges["b_n"].astype(np.int64)
    x, y, theta = (edges[name].astype(float) for name in ("x", "y", "theta"))
    tau, kappa = edges["tau"].astype(float), edges["kappa"].astype(float)
    i, j = i * ROBOTS + origin, j * ROBOTS + poses.peer
    return ComplexFactors(i, j, np.exp(1j * theta), x + 1j * y, kappa, tau)


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
