"""`optimizer.algorithm = "closures"`: the paper's pose graph, solved exactly on every robot.

Odometry and kept closures alone, with the weights and the cost of `rbcd`, and with every iterate of
it left out: the graph is replicated anyway. Closures that the whole of it contradicts count for
nothing (`gnc`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from drslamd.config import Config
from drslamd.conventions import Chain
from drslamd.slam import se2
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import PublicPoses
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.closures import gnc
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.factors import Numbering, chain_links
from drslamd.slam.optimizer.problem import PoseEdges
from drslamd.slam.optimizer.rbcd.block_descent import ComplexEdges
from drslamd.slam.se2 import Array


class ClosureOptimizer:
    """Odometry and closures of the whole group, one exact solve."""

    def __init__(self, config: Config, own: Chain) -> None:
        """Nothing of either matters here."""

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job | None:
        """See `Optimizer.job`; public poses are not needed."""
        numbers = factors.numbering(graph, group.members, group.shift_us)
        chains = [graph.chains[robot].chain for robot in sorted({s.robot for s in group.members})]
        first = graph.segment_rows(group.frame)[0]
        gauge = int(numbers.of(graph.chains[group.frame.robot], first[:1])[0])
        start = None
        if previous and {c.robot for c in chains} <= set(previous.trajectories):
            start = np.zeros((len(numbers.n), 3))
            for segment, poses in team_frame.placed(graph, group, previous).items():
                rows = graph.chains[segment.robot].rows_of(segment.segment)
                start[numbers.place[segment.robot][rows]] = poses
        stated = _ClosureProblem(numbers, *_edges(graph, numbers), chains, gauge, first[2:], start)
        return partial(_solve, stated, group)


@dataclass(frozen=True)
class _ClosureProblem:
    """A group as a pose graph.

    Attributes:
        is_closure: (m,) of the edges.
        gauge: the pose that is at `origin` (3,) in the frame of the team.
        start: (k, 3), None to start from the chordal relaxation.
    """

    numbers: Numbering
    edges: ComplexEdges
    is_closure: NDArray[np.bool_]
    chains: list[Chain]
    gauge: int
    origin: Array
    start: Array | None


def _edges(graph: PoseGraph, numbers: Numbering) -> tuple[ComplexEdges, NDArray[np.bool_]]:
    """All edges, and which of them are closures."""
    parts = [ComplexEdges.of(factors.closures(graph, numbers))]
    for robot, place in numbers.place.items():
        links = chain_links(graph.chains[robot], calibrated=False)
        numbered = PoseEdges(place[links.i], place[links.j], links.measured, links.covariance)
        parts.append(ComplexEdges.of(numbered))
    edges = ComplexEdges.joined(parts)
    # a pose relative to itself says nothing
    used = (edges.i >= 0) & (edges.j >= 0) & (edges.i != edges.j)
    return edges.chosen(used), (np.arange(len(edges)) < len(parts[0]))[used]


def _solve(stated: _ClosureProblem, group: Group) -> TeamEstimate:
    """Solve, carry the answer into the frame of the team, and sort it by robot."""
    numbers, count = stated.numbers, len(stated.numbers.n)
    answer, edges = gnc.solve(stated.edges, count, stated.is_closure, stated.start)
    w_T_any = se2.compose(stated.origin, se2.inverse(answer.poses[stated.gauge]))
    poses = se2.compose(w_T_any[None], answer.poses)
    poses[:, 2] = se2.wrap(poses[:, 2])
    mine = {chain.robot: np.flatnonzero(numbers.robot == chain.robot) for chain in stated.chains}
    mine = {robot: at[np.argsort(numbers.n[at], kind="stable")] for robot, at in mine.items()}
    last = {robot: int(at[-1]) for robot, at in mine.items()}
    # the cost counts an angle twice (`ComplexEdges.of`), which for a covariance it must not
    weighed = replace(edges, kappa=edges.kappa / 2)
    covariances = PoseGraphSolver(weighed, count, stated.gauge).marginals(
        poses, list(last.values())
    )
    return TeamEstimate(
        group.frame,
        {c.robot: Trajectory(c, numbers.n[mine[c.robot]], poses[mine[c.robot]])
         for c in stated.chains},
        dict(zip(last, covariances, strict=True)),
        cost=answer.cost,
        iterations=answer.steps,
        converged=answer.converged,
    )  # fmt: skip
