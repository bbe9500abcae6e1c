"""`optimizer.algorithm = "closures"`: the paper's pose graph, solved exactly on every robot.

Odometry and kept closures alone, with the weights and the cost of `rbcd` and without its iterates:
the graph is replicated anyway. Closures that the whole of it contradicts count for nothing (`gnc`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from drslamd.conventions import Chain
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.closures import gnc
from drslamd.slam.optimizer.closures.claimed import WINDOW_N, WholeGraph
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.se2 import Array


@dataclass(frozen=True)
class ClosureOptimizer:
    """Odometry and closures of the whole group, one exact solve.

    Attributes:
        believable: see `gnc.BELIEVABLE`.
        window_n: see `WholeGraph.of`.
    """

    believable: float = gnc.BELIEVABLE
    window_n: int = WINDOW_N

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job | None:
        """See `Optimizer.job`; public poses are not needed."""
        whole = WholeGraph.of(graph, group, self.window_n)
        chains = [
            graph.view.chains[robot].chain for robot in sorted({s.robot for s in group.members})
        ]
        is_known = (
            previous
            and not previous.leads_nowhere
            and {c.robot for c in chains} <= set(previous.trajectories)
        )
        start = factors.initial_poses(graph, group, previous, whole.places) if is_known else None
        problem = _ClosureProblem(whole, chains, start)
        return partial(_solve, problem, group, self.believable)


@dataclass(frozen=True)
class _ClosureProblem:
    """A group as a pose graph.

    Attributes:
        start: (k, 3), None to start from the chordal relaxation.
    """

    whole: WholeGraph
    chains: list[Chain]
    start: Array | None


def _solve(problem: _ClosureProblem, group: Group, believable: float) -> TeamEstimate:
    """Solve, carry the answer into the frame of the team, and sort it by robot."""
    whole, places = problem.whole, problem.whole.places
    answer, weighed = gnc.solve(
        whole.edges, len(places.n), whole.errors.is_closure, problem.start, believable
    )
    poses = whole.in_frame(answer.poses)
    mine = {chain.robot: places.of_robot(chain.robot) for chain in problem.chains}
    return TeamEstimate(
        frame=group.frame,
        trajectories={
            c.robot: Trajectory(c, places.n[mine[c.robot]], poses[mine[c.robot]])
            for c in problem.chains
        },
        joint=whole.joint([int(mine[c.robot][-1]) for c in problem.chains], poses, weighed),
        cost=answer.cost,
        iterations=answer.steps,
        converged=answer.converged,
    )
