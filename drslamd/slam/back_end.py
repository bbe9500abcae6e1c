"""Module 3 as one robot runs it: the graph that it holds and the estimate that follows from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from drslamd.config import Config
from drslamd.conventions import Chain, Segment
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.history import History
from drslamd.slam.graph.measurements import GraphEntry, PublicPoses
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.graph.thinning import Thinning
from drslamd.slam.optimizer.banded.banded_optimizer import BandedOptimizer
from drslamd.slam.optimizer.closures.closure_optimizer import ClosureOptimizer
from drslamd.slam.optimizer.contract import Job, Optimizer
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import RbcdOptimizer

OPTIMIZERS: dict[str, Callable[[Config, Chain], Optimizer]] = {
    "banded": BandedOptimizer,
    "closures": ClosureOptimizer,
    "rbcd": RbcdOptimizer,
}
"""By `optimizer.algorithm`."""


class BackEnd:
    """Graph and estimate."""

    def __init__(self, config: Config, own: Chain) -> None:
        self._own = own
        self._optimizer = OPTIMIZERS[config.optimizer.algorithm](config, own)
        self.graph = PoseGraph()
        self._thinning = Thinning(self.graph)
        self.history = History()
        """Where we were."""
        self.group: set[Segment] = set()
        self.estimate: TeamEstimate | None = None
        """Of the group that our current segment is in; None while it is in none."""
        self._inserted = 0
        self._known: tuple[int, set[int], Mapping[int, PublicPoses]] = (-1, set(), {})
        """What the last job knew: items inserted, robots that live, public poses of the peers."""

    def insert(self, origin: Chain, entry: GraphEntry) -> None:
        self.graph.insert(origin, entry)
        self._thinning.after(origin.robot)
        self._inserted += 1

    def digest(self) -> int:
        """Equal on two robots of a group when both hold the same graph of it."""
        return self.graph.digest({segment.robot for segment in self.group})

    def trajectory(self, robot: int) -> Trajectory | None:
        """The solved keyframes of a robot, in the frame of the team."""
        return self.estimate.trajectories.get(robot) if self.estimate else None

    def job(
        self, present: set[int], shift_us: dict[int, int], public: Mapping[int, PublicPoses]
    ) -> Job | None:
        """The computation that renews the estimate; None when nothing is new or connected.

        An estimate that has not converged is renewed without any news.

        Args:
            present: robots that live.
            shift_us: clock of each robot minus ours, us.
            public: lifted public poses of the peers.
        """
        if not self._is_news(present, public) and (not self.estimate or self.estimate.converged):
            return None
        self._known = (self._inserted, present, dict(public))
        items = self.graph.chains.get(self._own.robot)
        if items is None or not len(items.rows):
            return None
        current = Segment(*self._own, int(items.rows[-1, 1]))
        groups = [group for group in team_frame.groups(self.graph) if current in group]
        self.group = groups[0] if groups else set()
        frame = team_frame.gauge_segment(self.group, present)
        if frame is None:
            self.estimate = None
            return None
        same = {r: p for r, p in public.items() if (p.frame, p.frame_epoch) == frame.chain}
        group = Group(self.group, frame, {**shift_us, self._own.robot: 0})
        return self._optimizer.job(self.graph, group, self.estimate, same)

    def _is_news(self, present: set[int], public: Mapping[int, PublicPoses]) -> bool:
        inserted, lived, heard = self._known
        return (
            (inserted, lived, heard.keys()) != (self._inserted, present, public.keys())
            # poses of the same keyframes compare equal, whatever they are
            or any(heard[robot] is not poses for robot, poses in public.items())
        )

    def solved(self, result: TeamEstimate) -> None:
        self.estimate = result
        own = result.trajectories.get(self._own.robot)
        if own is not None:
            self.history.update(own)

    def public_poses(self) -> PublicPoses | None:
        """What neighbours must know of a relaxation: our poses that carry closures."""
        lifted = self.estimate.lifted if self.estimate else None
        if self.estimate is None or lifted is None or not len(lifted.carriers):
            return None
        rows = lifted.rows[np.searchsorted(lifted.n, lifted.carriers)]
        values = np.concatenate([lifted.anchor[None], rows])
        keyframes = tuple(int(n) for n in lifted.carriers)
        frame, rank = self.estimate.frame, len(lifted.anchor) // 2
        return PublicPoses(frame.robot, frame.epoch, rank, keyframes, values)
