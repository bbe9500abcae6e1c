"""What a robot's block hangs on: the public poses of its neighbours, and the closures to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import Chain
from drslamd.slam import se2
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.factors import between_factors
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.se2 import Array

OFF_SPHERE = 1e-2
"""A rotation whose length is wrong by more than rounding to 32 bits is not one."""


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
    n: Array
    rows: Array
    leaving: BetweenFactors
    arriving: BetweenFactors
    carriers: Array
    weights: Array


def robots(graph: PoseGraph, own: Chain) -> set[int]:
    """With whom we share closures that are kept."""
    return {
        (pair.b if pair.a == own else pair.a).robot
        for pair in graph.usable()
        if own in (pair.a, pair.b) and any(c.kept for _, c in pair.closures.values())
    }


def on_sphere(rows: Array) -> NDArray[np.bool_]:
    """Which of the rows (k, 2 r) have a rotation."""
    length = np.linalg.norm(rows[:, : rows.shape[1] // 2], axis=1)
    return np.asarray(np.abs(length - 1) < OFF_SPHERE)


def lifted_neighbours(
    graph: PoseGraph,
    data: ChainData,
    used: Array,
    public: Mapping[int, PublicPoses],
    rank: int,
) -> LiftedNeighbours:
    """Sort the kept closures of our own pairs by whether the other end is known.

    Args:
        used: (k,) rows of our chain that the block consists of.
        public: poses of that rank.
    """
    own = data.chain
    number = {int(n): k for k, n in enumerate(data.keyframes.n[used])}
    leaving: list[tuple[int, int, tuple[float, ...], Array]] = []
    arriving: list[tuple[int, int, tuple[float, ...], Array]] = []
    chains: list[Chain] = []
    keyframes: list[int] = []
    rows: list[Array] = []
    for pair in graph.usable():
        if own not in (pair.a, pair.b):
            continue
        leaves = pair.a == own
        other = pair.b if leaves else pair.a
        table = public[other.robot].table() if other.robot in public else {}
        for closure in pair.kept_closures():
            mine, far = (closure.a_n, closure.b_n) if leaves else (closure.b_n, closure.a_n)
            if mine not in number:
                continue
            row = -1
            if far in table and on_sphere(table[far][None])[0]:
                row = len(rows)
                chains.append(other)
                keyframes.append(far)
                rows.append(table[far])
            edge = (closure.a_T_b, se2.unpacked(closure.covariance))
            if leaves:
                leaving.append((number[mine], row, *edge))
            else:
                arriving.append((row, number[mine], *edge))
    away, back = between_factors(leaving), between_factors(arriving)
    stiff = _stiffness(away, back, len(used))
    carriers = np.unique(np.concatenate([away.i, back.j]))
    return LiftedNeighbours(
        tuple(chains),
        np.array(keyframes),
        np.array(rows, dtype=complex).reshape(-1, 2 * rank),
        away.chosen(away.j >= 0),
        back.chosen(back.i >= 0),
        data.keyframes.n[used][carriers],
        stiff[carriers],
    )


def _stiffness(leaving: BetweenFactors, arriving: BetweenFactors, count: int) -> Array:
    """(count, 2) of our rotations and positions, as far as closures hold them."""
    away, back = ComplexFactors.of(leaving), ComplexFactors.of(arriving)
    reach = away.shift.real**2 + away.shift.imag**2
    ends = np.concatenate([away.i, back.j])
    turn = np.concatenate([away.kappa + away.tau * reach, back.kappa])
    place = np.concatenate([away.tau, back.tau])
    # of no ends bincount makes integers
    return np.column_stack([np.bincount(ends, w, count) for w in (turn, place)]).astype(float)
