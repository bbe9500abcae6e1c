"""What a robot's block hangs on: the public poses of its neighbours, and the closures to them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import Chain
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.se2 import Array, Index

OFF_SPHERE = 1e-2
"""A rotation whose length is wrong by more than rounding to 32 bits is not one."""


class SharedClosures(NamedTuple):
    """m closures between us and one other robot, all in one direction.

    Attributes:
        leaves: do they lead from our keyframes to those of the other, or back?
        mine, far: (m,) keyframes at both ends.
        measured: (m, 3) pose of the end in the start; covariance: (m, 3, 3).
    """

    other: Chain
    leaves: bool
    mine: Index
    far: Index
    measured: Array
    covariance: Array

    def chosen(self, which: Array) -> SharedClosures:
        columns = (self.mine, self.far, self.measured, self.covariance)
        return SharedClosures(self.other, self.leaves, *(column[which] for column in columns))


@dataclass(frozen=True)
class LiftedNeighbours:
    """The lifted poses that this robot's closures lead to.

    Attributes:
        chains, n: (m,) whose keyframes they are; rows: (m, 2 r).
        leaving: edges from our poses (i) to rows (j); arriving: from rows (i) to our poses (j).
        carriers: (k,) our keyframes that carry closures, to whomever.
        weights: (k, 2) how stiffly closures hold rotation and position of these, 1 and 1/m^2.
    """

    chains: tuple[Chain, ...]
    n: Index
    rows: Array
    leaving: BetweenFactors
    arriving: BetweenFactors
    carriers: Index
    weights: Array


def robots(graph: PoseGraph, own: Chain) -> set[int]:
    """With whom we share closures that are kept."""
    return {closures.other.robot for closures in shared_closures(graph, own)}


def shared_closures(graph: PoseGraph, own: Chain) -> list[SharedClosures]:
    """All of ours that are kept."""
    out = []
    for pair in graph.view.pairs:
        table = pair.closures
        if own not in (pair.a, pair.b) or not len(table):
            continue
        leaves = pair.a == own
        a_n, b_n = table.a_n.astype(np.int64), table.b_n.astype(np.int64)
        mine, far = (a_n, b_n) if leaves else (b_n, a_n)
        other = pair.b if leaves else pair.a
        out.append(SharedClosures(other, leaves, mine, far, table.a_T_b, table.covariance))
    return out


def on_sphere(rows: Array) -> NDArray[np.bool_]:
    """Which of the rows (k, 2 r) have a rotation."""
    length = np.linalg.norm(rows[:, : rows.shape[1] // 2], axis=1)
    return np.asarray(np.abs(length - 1) < OFF_SPHERE)


def lifted_neighbours(
    shared: Iterable[SharedClosures], n: Index, public: Mapping[int, PublicPoses], rank: int
) -> LiftedNeighbours:
    """Sort our closures by whether the other end is known.

    Args:
        n: (k,) our keyframes that the block consists of, ascending.
        public: poses of that rank.
    """
    chains: list[Chain] = []
    keyframes, rows = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 2 * rank), dtype=complex)]
    away, back = [BetweenFactors.none()], [BetweenFactors.none()]
    for every in shared:
        closures = every.chosen(np.isin(every.mine, n))
        known, found = _known(closures, public, rank)
        row = np.full(len(known), -1)
        row[known] = len(chains) + np.arange(len(found))
        mine, pose = np.searchsorted(n, closures.mine), (closures.measured, closures.covariance)
        if closures.leaves:
            away.append(BetweenFactors(mine, row, *pose))
        else:
            back.append(BetweenFactors(row, mine, *pose))
        chains += [closures.other] * len(found)
        keyframes.append(closures.far[known])
        rows.append(found)
    leaving, arriving = BetweenFactors.joined(away), BetweenFactors.joined(back)
    stiff = _stiffness(leaving, arriving, len(n))
    carriers = np.unique(np.concatenate([leaving.i, arriving.j]))
    return LiftedNeighbours(
        tuple(chains),
        np.concatenate(keyframes),
        np.concatenate(rows),
        leaving.chosen(leaving.j >= 0),
        arriving.chosen(arriving.i >= 0),
        n[carriers],
        stiff[carriers],
    )


def _known(
    closures: SharedClosures, public: Mapping[int, PublicPoses], rank: int
) -> tuple[NDArray[np.bool_], Array]:
    """Which of the far ends (m,) are known, and the lifted poses of these."""
    poses = public.get(closures.other.robot)
    if poses is None or not poses.keyframes:
        nothing = np.zeros((0, 2 * rank), dtype=complex)
        return np.zeros(len(closures.far), dtype=bool), nothing
    held, values = np.array(poses.keyframes), poses.values[1:]
    at = np.minimum(np.searchsorted(held, closures.far), len(held) - 1)
    known = (held[at] == closures.far) & on_sphere(values)[at]
    return known, values[at[known]]


def _stiffness(leaving: BetweenFactors, arriving: BetweenFactors, count: int) -> Array:
    """(count, 2) of our rotations and positions, as far as closures hold them."""
    away, back = ComplexFactors.of(leaving), ComplexFactors.of(arriving)
    reach = away.shift.real**2 + away.shift.imag**2
    ends = np.concatenate([away.i, back.j])
    turn = np.concatenate([away.kappa + away.tau * reach, back.kappa])
    place = np.concatenate([away.tau, back.tau])
    # of no ends bincount makes integers
    return np.column_stack([np.bincount(ends, w, count) for w in (turn, place)]).astype(float)
