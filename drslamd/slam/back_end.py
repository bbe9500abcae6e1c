"""Module 3 as one robot runs it: the graph that it holds and the estimate that follows from it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from drslamd.config import Config
from drslamd.conventions import Chain, Segment
from drslamd.gossip.messages import GraphEntry
from drslamd.slam import banded, team_frame
from drslamd.slam.pose_graph import TeamGraph
from drslamd.slam.problem import Calibration, Problem
from drslamd.slam.team_frame import TeamEstimate, Trajectory


class BackEnd:
    """Graph and estimate."""

    def __init__(self, config: Config, own: Chain) -> None:
        self._config = config
        self._own = own
        self.graph = TeamGraph()
        self.group: set[Segment] = set()
        self.estimate: TeamEstimate | None = None
        """Of the group that our current segment is in; None while it is in none."""
        self._changed = True
        self._present: set[int] = set()

    def insert(self, origin: Chain, entry: GraphEntry) -> None:
        self.graph.insert(origin, entry)
        self._changed = True

    def digest(self) -> int:
        """Equal on two robots of a group when both hold the same graph of it."""
        return self.graph.digest({segment.robot for segment in self.group})

    def trajectory(self, robot: int) -> Trajectory | None:
        """The solved keyframes of a robot, in the frame of the team."""
        return self.estimate.trajectories.get(robot) if self.estimate else None

    def job(self, present: set[int], shift_us: dict[int, int]) -> Callable[[], TeamEstimate] | None:
        """The computation that renews the estimate; None when nothing is new or connected.

        Args:
            present: robots that live.
            shift_us: clock of each robot minus ours, us.
        """
        if not self._changed and present == self._present:
            return None
        self._changed, self._present = False, present
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
        bias_sigma = self._config.relative_pose.range_bias_sigma_m
        problem, start, robots, pairs = team_frame.build(
            self.graph, self.group, frame, shift_us, bias_sigma, self.estimate, with_ranges=True
        )
        return partial(solve, problem, start, frame, robots, pairs)

    def solved(self, result: TeamEstimate) -> None:
        self.estimate = result


def solve(
    problem: Problem,
    start: Calibration,
    frame: Segment,
    robots: list[int],
    pairs: list[tuple[int, int]],
) -> TeamEstimate:
    """The exact solution, with the uncertainty of everybody's latest pose."""
    last = team_frame.last_poses(problem)
    solution = banded.solve(problem, start, tuple(last.values()))
    return team_frame.estimate(problem, solution, frame, robots, pairs)
