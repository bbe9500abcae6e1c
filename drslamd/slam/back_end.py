"""Module 3 as one robot runs it: the graph that it holds and the estimate that follows from it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from drslamd.config import Config
from drslamd.conventions import Chain, Segment
from drslamd.slam import settings
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.history import History
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.tuning import DEFAULTS, Tuning


class _Known(NamedTuple):
    """What a job knows: log entries that are held, robots that live, public poses of the peers."""

    inserted: int = -1
    living: frozenset[int] = frozenset()
    public: Mapping[int, PublicPoses] = {}


class BackEnd:
    """Graph and estimate.

    Attributes:
        history: where we were.
        group: segments that are connected to our current one, as the last job knew them.
        estimate: of that group; None while we are in none.
    """

    def __init__(self, config: Config, own: Chain, tuning: Tuning = DEFAULTS) -> None:
        self._own = own
        self._optimizer = settings.optimizer(config, own, tuning)
        self.graph = PoseGraph(tuning.recent_s)
        self.history = History()
        self.group: set[Segment] = set()
        self.estimate: TeamEstimate | None = None
        self._inserted = 0
        self._known = _Known()

    def insert(self, origin: Chain, entry: GraphEntry) -> None:
        self.graph.insert(origin, entry)
        self._inserted += 1

    def digest(self) -> int:
        """Equal on two robots of a group when both hold the same graph of it."""
        return self.graph.digest({segment.robot for segment in self.group})

    def trajectory(self, robot: int) -> Trajectory | None:
        """The solved keyframes of a robot, in the frame of the team."""
        return self.estimate.trajectories.get(robot) if self.estimate else None

    def begin(self, present: set[int], public: Mapping[int, PublicPoses]) -> Job | None:
        """Begin to renew the estimate; None when nothing is new or connected.

        An estimate that has not converged is renewed without any news.

        Args:
            present: robots that live.
            public: lifted public poses of the peers.
        """
        now = _Known(self._inserted, frozenset(present), dict(public))
        if not _is_news(self._known, now) and (not self.estimate or self.estimate.converged):
            return None
        self._known = now
        chain = self.graph.view.chains.get(self._own.robot)
        if chain is None:
            return None
        current = Segment(*self._own, int(chain.keyframes.segment[-1]))
        groups = [group for group in team_frame.groups(self.graph) if current in group]
        self.group = groups[0] if groups else set()
        frame = team_frame.gauge_segment(self.group, present)
        if frame is None:
            self.estimate = None
            return None
        same = {r: p for r, p in public.items() if (p.frame, p.frame_epoch) == frame.chain}
        return self._optimizer.job(self.graph, Group(self.group, frame), self.estimate, same)

    def on_solution(self, result: TeamEstimate) -> None:
        """Module 3 has answered."""
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


def _is_news(before: _Known, now: _Known) -> bool:
    """Does a job know anything that the one before it did not?"""
    same = (before.inserted, before.living, before.public.keys()) == (
        now.inserted,
        now.living,
        now.public.keys(),
    )
    # poses of the same keyframes compare equal, whatever they are
    return not same or any(before.public[k] is not poses for k, poses in now.public.items())
