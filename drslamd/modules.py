"""The three modules as a robot runs them: what is due becomes a computation, what came of it news.

By the clock each looks once in a while. Until the team knows of a pair nothing waits for the clock:
what module 1 found goes to module 2 at once, a pair that is connected to the team and to module 3.
"""

from __future__ import annotations

from collections.abc import Callable

from drslamd.events import Effect
from drslamd.gossip.team import Team
from drslamd.jobs import CONSISTENCY, OPTIMIZER, RELATIVE_POSE, WHAT_IF, Job, Jobs
from drslamd.slam.back_end import BackEnd
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.standing import Standing


class Modules:
    """Of one robot."""

    def __init__(
        self,
        front: FrontEnd,
        back: BackEnd,
        team: Team,
        jobs: Jobs,
        neighbours: Callable[[int], list[PeerInRange]],
    ) -> None:
        self._front, self._back, self._team, self._jobs = front, back, team, jobs
        self._neighbours = neighbours
        self._is_awaited = False

    @property
    def pauses(self) -> tuple[Callable[[int], list[Effect]], ...]:
        """After which sensors are read before anything else is begun (`Timers`): what comes each
        second takes a small team 8 ms in one go, of which these parts take about a third each."""
        return self.consistency, self.optimize

    def on_odometry(self, robot: int, utime: int) -> list[Effect]:
        """A peer said where its wheels went: the next window of a pair that nobody knows of."""
        pair = self._front.pairs.get(robot)
        if pair is None or pair.is_told:
            return []
        return [*self.relative_poses(utime, robot), *self.what_if(utime, robot)]

    def _peers(self, utime: int, only: int | None) -> list[PeerInRange]:
        return [p for p in self._neighbours(utime) if only in (None, p.chain.robot)]

    def relative_poses(self, utime: int, only: int | None = None) -> list[Effect]:
        """Module 1: a window of ranges and both odometries, for all pairs that we own.

        Args:
            only: with this robot.
        """
        if self._jobs.is_resting(RELATIVE_POSE, utime):
            return []
        peers, graph = self._peers(utime, only), self._back.graph
        found = self._front.module1(peers, graph, self._back.estimate, utime)
        return list(self._jobs.begin_windows(found, self._front.solve))

    def what_if(self, utime: int, only: int | None = None) -> list[Effect]:
        """Is a pair mounted as configured? Where windows disagree: which mistake explains it?

        Args:
            only: as in `relative_poses`.
        """
        if not self._jobs.is_free(WHAT_IF, utime):
            return []
        peers, back = self._peers(utime, only), self._back
        asked = self._front.what_if(peers, back.graph, back.estimate, utime)
        return [self._jobs.begin(Job(WHAT_IF, (w.pair,), (w.request,)), w.run) for w in asked]

    def consistency(self, utime: int, only: PairTracker | None = None) -> list[Effect]:
        """Module 2: which of a pair's closures belong together.

        Args:
            only: of this pair; of all where it is None.
        """
        return [
            self._jobs.begin(Job(CONSISTENCY, (pair,)), run)
            for pair, run in self._front.module2(self._back.graph, self._back.estimate, only)
        ]

    def optimize(self, utime: int) -> list[Effect]:
        """Module 3: the team's pose graph."""
        if not self._jobs.is_free(OPTIMIZER, utime):
            return []
        run = self._back.begin(self._team.present(utime), set(self._team.living(utime)), utime)
        return [self._jobs.begin(Job(OPTIMIZER), run)] if run else []

    def optimize_soon(self, utime: int) -> list[Effect]:
        """Module 3 now, or as soon as it has done what it does: its answer is waited for."""
        self._is_awaited = not self._jobs.is_free(OPTIMIZER, utime)
        return self.optimize(utime)

    def place(self, standing: Standing, neighbours: list[PeerInRange], utime: int) -> list[Effect]:
        """After a hole in our odometry: where do ranges place us? And where is what stands?"""
        carrier, is_free = self._team.robot_of_uwb, self._jobs.is_free
        asked = standing.asked(neighbours, carrier, is_free, utime)
        begun: list[Effect] = [
            self._jobs.begin(Job(name, told=told), run) for name, run, told in asked
        ]
        return [*begun, *(self.optimize_soon(utime) if self._is_awaited else [])]
