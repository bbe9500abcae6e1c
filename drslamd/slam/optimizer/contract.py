"""The contract of module 3: graph in, a computation out, an estimate from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group

Job = Callable[[], TeamEstimate]


class Optimizer(Protocol):
    """How one robot renews its estimate; `optimizer.algorithm` chooses one."""

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job | None:
        """The computation, which takes all that it needs along; None: nothing can be done yet.

        Args:
            graph: what this robot holds.
            group: what is connected to it.
            previous: its last estimate.
            public: lifted public poses of its neighbours, those that share the group's frame.
        """
