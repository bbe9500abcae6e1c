"""`optimizer.algorithm = "closures"`: the paper's pose graph, solved exactly on every robot.

Odometry and kept closures alone, with the weights and the cost of `rbcd` and without its iterates:
the graph is replicated anyway. Closures that the whole of it contradicts count for nothing (`gnc`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import Chain
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.closures import gnc
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.factors import Numbering, chain_links
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class ClosureOptimizer:
    """Odometry and closures of the whole group, one exact solve.

    Attributes:
        believable: see `gnc.BELIEVABLE`.
    """

    believable: float = gnc.BELIEVABLE

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job | None:
        """See `Optimizer.job`; public poses are not needed."""
        places = factors.numbering(graph, group.members)
        chains = [
            graph.view.chains[robot].chain for robot in sorted({s.robot for s in group.members})
        ]
        is_known = (
            previous
            and not previous.leads_nowhere
            and {c.robot for c in chains} <= set(previous.trajectories)
        )
        edges, is_closure = closure_edges(graph, places)
        problem = _ClosureProblem(
            places=places,
            edges=edges,
            is_closure=is_closure,
            chains=chains,
            gauge=factors.gauge_place(graph, group, places),
            origin=graph.view.segment(group.frame).poses[0],
            start=factors.initial_poses(graph, group, previous, places) if is_known else None,
        )
        return partial(_solve, problem, group, self.believable)


@dataclass(frozen=True)
class _ClosureProblem:
    """A group as a pose graph.

    Attributes:
        is_closure: (m,) of the edges.
        gauge: the pose that is at `origin` (3,) in the frame of the team.
        start: (k, 3), None to start from the chordal relaxation.
    """

    places: Numbering
    edges: ComplexFactors
    is_closure: NDArray[np.bool_]
    chains: list[Chain]
    gauge: int
    origin: Array
    start: Array | None


def closure_edges(graph: PoseGraph, places: Numbering) -> tuple[ComplexFactors, NDArray[np.bool_]]:
    """All edges, and which of them are closures."""
    parts = [ComplexFactors.of(factors.closures(graph, places))]
    for robot, place in places.place.items():
        links = chain_links(graph.view.chains[robot], calibrated=False)
        numbered = BetweenFactors(place[links.i], place[links.j], links.measured, links.covariance)
        parts.append(ComplexFactors.of(numbered))
    edges = ComplexFactors.joined(parts)
    # a pose relative to itself says nothing
    used = (edges.i >= 0) & (edges.j >= 0) & (edges.i != edges.j)
    return edges.chosen(used), (np.arange(len(edges)) < len(parts[0]))[used]


def _solve(problem: _ClosureProblem, group: Group, believable: float) -> TeamEstimate:
    """Solve, carry the answer into the frame of the team, and sort it by robot."""
    places, count = problem.places, len(problem.places.n)
    answer, edges = gnc.solve(problem.edges, count, problem.is_closure, problem.start, believable)
    w_T_any = se2.compose(problem.origin, se2.inverse(answer.poses[problem.gauge]))
    poses = se2.compose(w_T_any[None], answer.poses)
    poses[:, 2] = se2.wrap(poses[:, 2])
    mine = {chain.robot: places.of_robot(chain.robot) for chain in problem.chains}
    # the cost counts an angle twice (`ComplexFactors.of`), which for a covariance it must not
    weighed = replace(edges, kappa=edges.kappa / 2)
    solver = PoseGraphSolver(weighed, count, problem.gauge)
    return TeamEstimate(
        frame=group.frame,
        trajectories={
            c.robot: Trajectory(c, places.n[mine[c.robot]], poses[mine[c.robot]])
            for c in problem.chains
        },
        joint=solver.joint_covariance(poses, [int(mine[c.robot][-1]) for c in problem.chains]),
        cost=answer.cost,
        iterations=answer.steps,
        converged=answer.converged,
    )
