"""Where a robot stands: its pose now, what that is worth, and what speaks against it."""

from __future__ import annotations

from collections.abc import Callable

from drslamd.config import Config
from drslamd.gossip.team import Team
from drslamd.slam.back_end import BackEnd
from drslamd.slam.doubt import Doubt, Partners, doubt_of, doubted_partners
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.estimate import PoseNow
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.pose_now import pose_now
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relocation.relocation import Found
from drslamd.whereabouts import NOWHERE, Whereabouts, likely_speeds, whereabouts


class Standing:
    """Of one robot."""

    def __init__(self, config: Config, team: Team, front: FrontEnd, back: BackEnd) -> None:
        self._most_mps, self._robot = config.wheels.max_speed_mps, team.own.robot
        self._namesakes, self._front, self._back = team.namesakes, front, back
        self._ranges_solve = config.optimizer.algorithm == "banded"

    def pose(self) -> PoseNow | None:
        """Our latest pose in the frame of the team; None while we are not localised."""
        estimate, front = self._back.estimate, self._front
        if estimate is None:
            return None
        found = pose_now(estimate, self._robot, front.reckoning.track, front.model.noise)
        if found is None:
            return None
        return found._replace(covariance=found.covariance * self._back.revisions.boldness)

    def whereabouts(self, utime: int) -> Whereabouts:
        """What that pose is worth now; nothing while another robot lives under our id."""
        if self._namesakes.is_own_id_used(utime):
            return NOWHERE
        track, gap_m = self._front.reckoning.track, self._front.watch.gap_m
        by_ranges = self._front.relocation.by_ranges(utime)
        return whereabouts(
            self.pose(), track, self._most_mps, self._doubt(), utime, gap_m, by_ranges
        )

    def relocate(self, neighbours: list[PeerInRange], utime: int) -> Callable[[], Found] | None:
        """After a hole in our odometry, see `Relocation.look`; only where module 3 then goes on by
        ranges, not where it would have nothing but that closure."""
        if not self._ranges_solve:
            return None
        front, back = self._front, self._back
        track = front.reckoning.track
        return front.relocation.look(
            neighbours, front.ranges, track, back.graph, back.estimate, self._speed, utime
        )

    def _speed(self) -> float:
        return likely_speeds(self._front.reckoning.track, self._most_mps)[0]

    def on_relocated(self, found: Found, utime: int) -> bool:
        """See `Relocation.on_found`."""
        data = self._back.graph.chains.get(self._robot)
        own = PairEnd(self._front.reckoning.track, data) if data is not None else None
        return self._front.relocation.on_found(found, own, utime)

    def is_doubted(self) -> tuple[bool, bool]:
        """Does odometry of ours, or of anybody, say less than what was ranged?"""
        own = self._doubt() is not None
        partners = doubted_partners(self._robot, self._back.estimate, self._front.watch.doubted)
        return own, own or bool(partners)

    def _doubt(self) -> Doubt | None:
        estimate, front = self._back.estimate, self._front
        watch = Partners(front.watch.looked_at, front.watch.doubted)
        windows = front.partners_by_windows(estimate.trajectories if estimate else ())
        return doubt_of(self._robot, estimate, watch, windows, self._back.revisions.boldness)
