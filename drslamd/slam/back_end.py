"""Module 3 as one robot runs it: the graph that it holds and the estimate that follows from it."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace
from typing import NamedTuple

from drslamd.config import Config
from drslamd.conventions import Chain, Segment
from drslamd.slam import settings
from drslamd.slam.graph import mirror_images, standing_points, team_frame
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.history import History
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.graph.thinning.graph_view import GraphView
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.rbcd import lifted_neighbours
from drslamd.slam.optimizer.rbcd.pose_exchange import PoseExchange
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import at_anchor
from drslamd.slam.revisions import Revisions
from drslamd.slam.tuning import DEFAULTS, Tuning

URGENT = 1e-4
"""Share of its cost that a move must bring for the next one to follow as soon as it is our turn:
when a team has just met, and for some moves after each closure that says something new."""

AT_ONCE = 16
"""Work (`Thinning.steps`) on the view of the graph in one go, about 3 ms: all of a small team. Of
fifty robots there are a thousand pairs, and nobody would read sensors for a fifth of a second."""


class _Known(NamedTuple):
    """What a job knows: log entries that are held, robots that live, moves of the neighbours."""

    inserted: int = -1
    living: frozenset[int] = frozenset()
    moves: int = 0


class BackEnd:
    """Graph and estimate.

    Attributes:
        history: where we were.
        group: segments and points that are connected to our current one, as the last job knew them.
        estimate: of that group; None while we are in none.
        beside: starts of peers whose group is solved while we are in none: we were in it once.
        onlooked: the estimate of that group.
        exchange: of public poses, with `rbcd`.
        looked_at: the graph as module 3 saw it last, at first empty: whoever else asks shall not
            cost a look.
    """

    def __init__(self, config: Config, own: Chain, tuning: Tuning = DEFAULTS) -> None:
        self._own = own
        self._optimizer = settings.optimizer(config, own, tuning)
        self._takes_turns = config.optimizer.algorithm == "rbcd"
        self._looks_back = config.optimizer.algorithm == "banded"
        self.exchange = PoseExchange(own)
        self.graph = PoseGraph(tuning.recent_s)
        self.history = History()
        self.revisions = Revisions()
        self.group: set[Segment] = set()
        self.estimate: TeamEstimate | None = None
        self.beside: Set[Chain] = frozenset()
        self.onlooked: TeamEstimate | None = None
        self._is_beside = False
        self._inserted = 0
        self._known = _Known()
        self._looks_for: _Known | None = None
        """The job for which the graph is being looked at."""
        self.looked_at = self.graph.view
        self._digested: tuple[GraphView, set[int], int] | None = None
        """What was digested last, and what came of it."""

    def insert(self, origin: Chain, entry: GraphEntry) -> None:
        self.graph.insert(origin, entry)
        self._inserted += 1

    def on_start(self, origin: Chain) -> None:
        """A robot speaks, perhaps for the first time since it began again."""
        self._inserted += self.graph.begin(origin)

    def digest(self) -> int:
        """Equal on two robots of a group when both hold the same graph of it."""
        return self.graph.digest(self._grouped)

    def said_digest(self) -> int:
        """The same of the graph as module 3 looked at it last: what is said each second shall not
        cost a look of its own, and without news it is the same. Whoever else looks, to answer a
        question, changes nothing of what is said."""
        view = self.looked_at
        known = self._digested
        if known is None or known[0] is not view or known[1] != self._grouped:
            known = self._digested = view, self._grouped, view.digest(self._grouped)
        return known[2]

    @property
    def _grouped(self) -> set[int]:
        return {segment.robot for segment in self.group}

    def trajectory(self, robot: int) -> Trajectory | None:
        """The solved keyframes of a robot, in the frame of the team."""
        return self.estimate.trajectories.get(robot) if self.estimate else None

    def hear(self, origin: Chain, message: PublicPoses) -> None:
        """A peer said its public poses, or asks for ours."""
        if not self._takes_turns:
            return
        self.exchange.hear(origin, message)
        if self.estimate is not None and origin == self.estimate.frame.chain:
            self.estimate = self._anchored(self.estimate)

    def begin(
        self, present: set[int], talking: Set[int] = frozenset(), utime: int = 0
    ) -> Job | None:
        """Begin to renew the estimate; None when nothing is new or connected, or while the graph
        is too large to be looked at in one go (`is_looking`).

        An estimate that is not final is renewed without any news: then all who hold the same
        come to the same, whatever each of them solved before. With `rbcd` it has to be our turn
        too.

        Args:
            present: robots that live.
            talking: those of them that hear us as we hear them.
        """
        now = self._begun(present, talking, utime)
        graph = self.graph.look(AT_ONCE) if now else None
        if now is None or graph is None:
            return None
        self.looked_at, self._looks_for = graph.view, None
        chain = graph.view.chains.get(self._own.robot)
        if chain is None:
            self._known = now
            return None
        current = Segment(*self._own, int(chain.keyframes.segment[-1]))
        group = self._group(current, graph, present)
        if group is None:
            self._known = now
            return None
        same = self.exchange.held(group.frame.chain)
        job = self._optimizer.job(graph, group, self.estimate or self.onlooked, same)
        if job is None:
            self.exchange.wait(utime)
            return None
        self._known = now
        return job

    @property
    def is_looking(self) -> bool:
        """Is the graph being looked at, and `begin` to be called again at once?"""
        return self._looks_for is not None

    def _begun(self, present: set[int], talking: Set[int], utime: int) -> _Known | None:
        """What the job knows that is due, if one is; the graph may be looked at for it already."""
        if self._looks_for is not None:
            return self._looks_for
        now = _Known(self._inserted, frozenset(present), self.exchange.news)
        solved = self.estimate or self.onlooked
        if now == self._known and (solved is None or solved.is_final):
            self.exchange.rest(utime)
            return None
        if self._takes_turns and not self.exchange.begin(self._neighbours(talking), utime):
            return None
        self._looks_for = now
        return now

    def _group(self, current: Segment, graph: PoseGraph, present: set[int]) -> Group | None:
        """What is connected to us, or to whom we were once; then there is no estimate."""
        members = team_frame.group_of(current, graph, self._looks_back)
        if not members and self.beside:
            members = team_frame.group_with(self.beside, graph)
        points: frozenset[Segment] = frozenset()
        mirrored: frozenset[Segment] = frozenset()
        if self._looks_back:
            members, mirrored = mirror_images.with_mirrored(current, members, graph)
            members, points = standing_points.with_points(current, members, graph)
        everything = members | points | mirrored
        self._is_beside = not self._is_in(everything)
        self.group = set() if self._is_beside else everything
        gauge = team_frame.gauge_segment(members, present)
        if gauge is None:
            self.estimate = self.onlooked = None
            return None
        return Group(members, gauge, points, mirrored)

    def _is_in(self, group: set[Segment]) -> bool:
        return any(segment.chain == self._own for segment in group)

    @property
    def is_urgent(self) -> bool:
        """Did the last move bring so much that the next one should not wait for its time?"""
        lifted = self.estimate.lifted if self.estimate else None
        return lifted is not None and lifted.gain > URGENT

    def _anchored(self, estimate: TeamEstimate) -> TeamEstimate:
        """Where the owner of the frame has the pose that anchors it now."""
        frame = estimate.frame.chain
        owner = self.exchange.held(frame).get(frame.robot)
        return at_anchor(estimate, owner) if owner else estimate

    def _neighbours(self, talking: Set[int]) -> list[Chain]:
        """With whom we share closures, of those that we can talk to."""
        robots = lifted_neighbours.robots(self.graph, self._own) & talking
        return [self.graph.chains[robot].chain for robot in robots]

    def on_solution(self, result: TeamEstimate, utime: int = 0) -> list[PublicPoses]:
        """Module 3 has answered; what must be said of it."""
        before = self.estimate or self.onlooked
        in_vain = 0 if result.converged else 1 + (before.in_vain if before else 0)
        result = replace(result, in_vain=in_vain) if in_vain else result
        own = result.trajectories.get(self._own.robot)
        if self._is_beside:
            self.estimate, self.onlooked = None, result
            return []
        self.estimate, self.onlooked = self._anchored(result), None
        result = self.estimate
        self.revisions.on_solution(result, self._own.robot)
        if bold := self.revisions.of_pairs:
            self.estimate = result = replace(result, boldness=bold)
        if narrower := result.narrower:
            held = self.revisions.no_narrower(narrower)
            self.estimate = result = replace(result, narrower=held)
        if own is not None:
            self.history.update(own)
        if result.lifted is None:
            return []
        return self.exchange.moved(result.frame.chain, result.lifted, utime)
