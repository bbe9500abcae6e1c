"""Where a robot stands: its pose now, what that is worth, and what speaks against it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

from drslamd.config import Config
from drslamd.gossip.team import Team
from drslamd.jobs import JOINING, POINTS, RELOCATION
from drslamd.sensors.rhythm import Rhythm
from drslamd.slam import settings
from drslamd.slam.back_end import BackEnd
from drslamd.slam.doubt import Doubt, Partners, doubt_of, doubted_partners
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.points.point_targets import point_targets
from drslamd.slam.points.points import Answer
from drslamd.slam.points.site import Site, site_of
from drslamd.slam.pose_now import pose_now
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relocation.last_place import LastPlace, last_place
from drslamd.slam.relocation.question import Found, is_vague
from drslamd.whereabouts import NOWHERE, VALID_US, Whereabouts, likely_speeds, whereabouts

ODD_TURN = 0.1
"""A fraction; less is no more wrong over a link than its noise."""


class Asked(NamedTuple):
    """A computation, by the name of its module, and who gets what comes out and the time."""

    module: str
    run: Callable[[], object]
    told: Callable[[Any, int], bool]


class _Kept(NamedTuple):
    """A pose and all that it follows from: a track only grows, so its end stands for it, and an
    estimate for what solutions moved by, which is counted with each."""

    estimate: TeamEstimate
    noise: OdometryNoise
    end: int
    pose: PoseNow | None

    def follows(self, estimate: TeamEstimate, noise: OdometryNoise, end: int) -> bool:
        return self.estimate is estimate and self.noise is noise and self.end == end


class Standing:
    """Of one robot."""

    def __init__(
        self, config: Config, team: Team, front: FrontEnd, back: BackEnd, rhythm: Rhythm
    ) -> None:
        """
        Args:
            rhythm: of the wheels.
        """
        self._most_mps, self._robot = config.wheels.max_speed_mps, team.own.robot
        self._namesakes, self._front, self._back = team.namesakes, front, back
        self._rhythm = rhythm
        self.survey = settings.survey(config)
        self._ranges_solve = config.optimizer.algorithm == "banded"
        self._kept: _Kept | None = None

    def pose(self) -> PoseNow | None:
        """Our latest pose in the frame of the team; None while we are not localised."""
        estimate, front = self._back.estimate, self._front
        if estimate is None:
            return None
        track, noise = front.reckoning.track, front.model.noise
        if self._kept is None or not self._kept.follows(estimate, noise, track.end):
            found = pose_now(estimate, self._robot, track, noise)
            if found is not None:
                covariance = found.covariance * self._back.revisions.boldness
                found = found._replace(covariance=covariance)
            self._kept = _Kept(estimate, noise, track.end, found)
        return self._kept.pose

    def whereabouts(self, utime: int) -> Whereabouts:
        """What that pose is worth now; nothing while another robot lives under our id."""
        if self._namesakes.is_own_id_used(utime):
            return NOWHERE
        track, gap_m = self._front.reckoning.track, self._front.watch.gap_m
        by_ranges, estimate = self._front.relocation.by_ranges(utime), self._back.estimate
        is_point = estimate is not None and self._robot in estimate.points
        most, pose = self._most_mps, self.pose()
        placed = self._front.relocation.placed(estimate, track) if estimate is not None else None
        is_placed = placed is not None and _turns_less(placed, pose)
        if is_placed:
            pose = placed
        elif pose is not None and is_vague(pose.covariance) and self._comes_back(pose, utime):
            pose = None
        doubt, valid_us = self._doubt(), self._rhythm.valid_us
        found = whereabouts(pose, track, most, doubt, utime, gap_m, by_ranges, is_point, valid_us)
        return replace(found, is_placed=is_placed and not found.is_old)

    def _comes_back(self, pose: PoseNow, utime: int) -> bool:
        """Were we just placed, after a hole or after a start?"""
        relocation, resumption = self._front.relocation, self._front.resumption
        has_place = relocation.is_lost and relocation.by_ranges(utime) is not None
        return utime - pose.utime <= VALID_US and (has_place or resumption.is_settling(utime))

    def site(self) -> Site | str | None:
        """The frame of the site, or why there is none; None where no module has coordinates."""
        return site_of(self._back.estimate, self.survey) if self.survey else None

    def asked(
        self,
        neighbours: list[PeerInRange],
        carrier: Callable[[int], int | None],
        is_free: Callable[[str, int], bool],
        utime: int,
    ) -> Iterator[Asked]:
        """Where ranges place us after a hole in our odometry, and where what stands is; only where
        module 3 then goes on by ranges, not where it would have nothing but those closures.

        Args:
            carrier: says which robot carries a UWB module; is_free: is a computation of that name?
        """
        if not self._ranges_solve:
            return
        front, back = self._front, self._back
        track = front.reckoning.track
        found = front.relocation.look(
            neighbours, front.ranges, track, back.graph, back.estimate, self._speed, utime
        )
        if found and is_free(RELOCATION, utime):
            yield Asked(RELOCATION, found, self.on_relocated)
        yield from self._resumed(neighbours, is_free, utime)
        if is_free(JOINING, utime):
            connected = [robot for robot, pair in front.pairs.items() if pair.connected]
            joined = front.joiner.look(back.graph, back.estimate, connected, utime)
            if joined:
                yield Asked(JOINING, joined, front.joiner.on_found)
        own = self._own_end()
        if own is None or not front.points.is_due(utime) or not is_free(POINTS, utime):
            return
        targets = point_targets(
            front.ranges.fresh(utime), neighbours, carrier, back.graph, back.estimate, utime
        )
        places = front.points.look(
            targets, front.ranges, own, back.graph, back.estimate, carrier, utime
        )
        if places:
            yield Asked(POINTS, places, self._on_places)

    def _resumed(
        self, neighbours: list[PeerInRange], is_free: Callable[[str, int], bool], utime: int
    ) -> Iterator[Asked]:
        """Where ranges place us after a start of our own."""
        front, back, own = self._front, self._back, self._own_end()
        team = back.estimate or back.onlooked
        found = front.resumption.look(neighbours, front.ranges, own, back.graph, team, utime)
        back.beside = front.resumption.beside
        if found and is_free(RELOCATION, utime):
            yield Asked(RELOCATION, found, self.on_resumed)

    def last_place(self, neighbours: list[PeerInRange], utime: int) -> LastPlace | None:
        """What the next start should know of this place."""
        estimate, where = self._back.estimate, self.whereabouts(utime)
        if estimate is None or where.pose is None:
            return None
        return last_place(estimate, where.pose, neighbours, self._speed())

    def _own_end(self) -> PairEnd | None:
        data = self._back.graph.chains.get(self._robot)
        track = self._front.reckoning.track
        return PairEnd(track, data) if data is not None and len(track) > 1 else None

    def _on_places(self, answers: list[Answer], utime: int) -> bool:
        """See `Points.on_found`."""
        front, back = self._front, self._back
        return front.points.on_found(
            answers, front.ranges, self._own_end(), back.graph, back.estimate
        )

    def _speed(self) -> float:
        return likely_speeds(self._front.reckoning.track, self._most_mps)[0]

    def on_relocated(self, found: Found, utime: int) -> bool:
        """See `Relocation.on_found`."""
        return self._front.relocation.on_found(found, self._own_end(), utime)

    def on_resumed(self, found: Found, utime: int) -> bool:
        """See `Resumption.on_found`."""
        return self._front.resumption.on_found(found, self._own_end(), utime)

    def is_doubted(self) -> tuple[bool, bool]:
        """Does odometry of ours, or of anybody, say less than what was ranged?"""
        own = self._doubt() is not None
        partners = doubted_partners(self._robot, self._back.estimate, self._front.watch.doubted)
        return own, own or bool(partners)

    @property
    def turns_otherwise(self) -> bool:
        """Are our turns others than our wheels say, by a tenth at least?"""
        estimate = self._back.estimate
        return (
            estimate is not None
            and estimate.converged
            and abs(estimate.correction(self._robot).longer) >= ODD_TURN
        )

    def _doubt(self) -> Doubt | None:
        estimate, front = self._back.estimate, self._front
        watch = Partners(front.watch.looked_at, front.watch.doubted)
        solved = estimate.trajectories if estimate else ()
        windows, mountings = front.partners_by_windows(solved)
        boldness = self._back.revisions.boldness
        return doubt_of(self._robot, estimate, watch, windows, mountings, boldness)


def _turns_less(one: PoseNow, other: PoseNow | None) -> bool:
    """Is its heading known better?"""
    return other is None or bool(one.covariance[2, 2] < other.covariance[2, 2])
