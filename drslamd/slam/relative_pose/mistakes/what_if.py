"""What if? One window that disagrees, solved again under each thing that people get wrong.

Module 1 says how well a window fits odometry as configured. Here the same ranges meet the odometry
that the robots would have had if the wheels of one of them were mounted otherwise than configured.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.slam import se2
from drslamd.slam.odometry import mounting
from drslamd.slam.odometry.mounting import (
    AS_CONFIGURED,
    COARSE_SCALES,
    CORRECTED,
    CURVES,
    LEARNED,
    LEAST_BEND,
    MIRRORED,
    SCALES,
    SIDES,
    TRACKS,
    Fault,
    Repair,
)
from drslamd.slam.relative_pose import solver
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_request import WindowRequest
from drslamd.slam.se2 import Array


class Case(NamedTuple):
    """Repairs of both robots of a pair that are tried together."""

    a: Repair = AS_CONFIGURED
    b: Repair = AS_CONFIGURED

    @property
    def kind(self) -> tuple[str, str]:
        """Cases of one kind differ in a factor only."""
        return self.a.fault.name, self.b.fault.name


MIRROR = Case(b=MIRRORED)
"""a mirrored and b mirrored are one world and its mirror image: the same ranges."""
CASES = (
    Case(),
    MIRROR,
    *(Case(a=repair) for repair in (*SIDES, *TRACKS, *SCALES, *CURVES)),
    *(Case(b=repair) for repair in (*SIDES, *TRACKS, *SCALES, *CURVES)),
    # a team that was configured from one file is wrong in the same way
    *(Case(repair, repair) for repair in COARSE_SCALES),
)

NEAR_FACTORS = (0.67, 0.8, 1.25, 1.5)
"""Whoever is further off than the factors of `SCALES` between them finds these better too."""


def _is_outpost(case: Case) -> bool:
    bends = [abs(repair.bend) for repair in case if repair.bend]
    if bends:
        return max(bends) == LEAST_BEND
    factors = [repair.turn for repair in case if repair.fault in LEARNED]
    return not factors or (len(factors) == 1 and factors[0] in NEAR_FACTORS)


OUTPOSTS = tuple(place for place, case in enumerate(CASES) if _is_outpost(case))
"""Places of the cases that a window is asked first. Where they find the configuration best, the
others change no verdict on 120 teams, healthy and faulty, and half of the time is saved."""


def is_learned(case: Case) -> bool:
    """Are these mistakes that module 3 learns?"""
    return all(repair.fault in (Fault.NONE, *LEARNED) for repair in case)


def is_corrected(case: Case) -> bool:
    """Are these mistakes that are taken out of a way which was told already?"""
    return all(repair.fault in (Fault.NONE, *CORRECTED) for repair in case)


def is_curve(case: Case) -> bool:
    """Is a wheel of one of the robots larger than the other?"""
    return Fault.CURVE in (case.a.fault, case.b.fault)


def is_like(one: Case, other: Case) -> bool:
    """Are the same robots wrong, by tracks or scales?"""
    whose = [[repair.fault is not Fault.NONE for repair in case] for case in (one, other)]
    return is_learned(one) and is_learned(other) and whose[0] == whose[1]


LEARNABLE = tuple(place for place, case in enumerate(CASES) if is_learned(case))
"""Places of the configuration, and of other tracks and scales."""
NEARBY = tuple(at for at, place in enumerate(LEARNABLE) if place in OUTPOSTS)
"""Places in `LEARNABLE` of those that are `OUTPOSTS`."""
BACKWARDS = tuple(
    place for place, case in enumerate(CASES) if place and not (is_learned(case) or is_curve(case))
)
"""Places of the cases of wheels that run backwards."""
BESIDE = tuple(place for place in OUTPOSTS if place and place not in BACKWARDS)
"""Those of the other `OUTPOSTS`."""
BEYOND = tuple(place for place in range(len(CASES)) if place not in OUTPOSTS)
"""Those of all that are none."""


def variants(found: Case) -> tuple[Case, ...]:
    """The same mistake a little smaller and larger, itself first; and where one robot is at fault,
    that it is its track, or its scale."""
    near = [Case(a, b) for a in found.a.variants() for b in found.b.variants()]
    if AS_CONFIGURED in found:
        near += [Case(a, found.b) for a in found.a.alike()]
        near += [Case(found.a, b) for b in found.b.alike()]
    return tuple(dict.fromkeys(near))


@dataclass(frozen=True)
class WindowTrack:
    """The 10 Hz track of one robot under a window.

    Attributes:
        poses: (k, 3) o_T_i.
        at: (n,) places of the measurements in it, in samples; reference: that of its time.
        half_track_m: 0 where wheels have no sides.
    """

    poses: Array
    at: Array
    reference: float
    half_track_m: float

    @staticmethod
    def of(end: PairEnd, request: WindowRequest) -> WindowTrack:
        at = end.grid(request.utime + request.window.t * SECOND_US)
        reference = float(end.grid(request.utime)[0])
        first, last = (int(np.floor(v)) for v in (min(at[0], reference), max(at[-1], reference)))
        last = min(last + 1, end.track.end - 1)
        poses = end.track.at_time(np.arange(first, last + 1))
        return WindowTrack(poses, at - first, reference - first, end.data.model.half_track_m)

    def repaired(self, repairs: Collection[Repair]) -> dict[Repair, Array]:
        """(n, 3) poses at the measurements, seen from that at the reference time; none where the
        wheels cannot be mounted so, or nothing is known of the way."""
        possible = [repair for repair in repairs if self.half_track_m > 0 or not repair.cross]
        if not possible:
            return {}
        paths = mounting.paths(possible, self.poses, self.half_track_m)
        poses = _at_places(paths, np.append(self.at, self.reference))
        seen = se2.between(poses[:, -1:], poses[:, :-1])
        each = zip(possible, seen, strict=True)
        return {repair: found for repair, found in each if np.isfinite(found).all()}


def _at_places(paths: Array, at: Array) -> Array:
    """(r, n, 3) paths (r, k, 3) at places (n,) in them, straight between two."""
    last = paths.shape[1] - 1
    at = np.clip(at, 0, last)
    low = at.astype(np.int64)
    here, beyond = paths[:, low], paths[:, np.minimum(low + 1, last)]
    share = (at - low)[:, None]
    # (what follows a pose may be unknown)
    return np.where(share == 0, here, (beyond - here) * share + here)


@dataclass(frozen=True)
class Question:
    """A window that disagrees, and the tracks under it."""

    window: Window
    a: WindowTrack
    b: WindowTrack

    @property
    def way_m(self) -> float:
        """How far the robot drove that drove less."""
        ways = (np.diff(stretch.poses[:, :2], axis=0) for stretch in (self.a, self.b))
        return min(float(np.nansum(np.hypot(*way.T))) for way in ways)

    def answer(
        self,
        cases: Sequence[Case],
        noise: PairNoise,
        delta: float,
        first: Sequence[int] = (),
        chance: float = 0.0,
    ) -> tuple[Array, float]:
        """`costs`, and `way_m`."""
        return self.costs(cases, noise, delta, first, chance), self.way_m

    def costs(
        self,
        cases: Sequence[Case],
        noise: PairNoise,
        delta: float,
        first: Sequence[int] = (),
        chance: float = 0.0,
    ) -> Array:
        """(cases,) chi-squared of the best pose under each of them, infinite where none fits.

        Args:
            first: places in `cases`; where none of these is better than place 0, the others are
                not asked, and as good as infinite; where one is, but by no more than `chance`, they
                are as good as place 0.
        """
        found = np.full(len(cases), np.inf)
        self._ask(found, cases, first or range(len(cases)), noise, delta)
        if first and found.min() < found[0]:
            others = [place for place in range(len(cases)) if place not in set(first)]
            if found.min() < found[0] - chance:
                self._ask(found, cases, others, noise, delta)
            else:
                found[others] = found[0]
        return found

    def _ask(
        self,
        found: Array,
        cases: Sequence[Case],
        places: Sequence[int],
        noise: PairNoise,
        delta: float,
    ) -> None:
        """Fill in what some of the cases cost, all of them at once."""
        # in an order that is the same in every process
        a = self.a.repaired(dict.fromkeys(cases[place].a for place in places))
        b = self.b.repaired(dict.fromkeys(cases[place].b for place in places))
        possible = {}
        for place in places:
            a_poses, b_poses = a.get(cases[place].a), b.get(cases[place].b)
            if a_poses is not None and b_poses is not None:
                possible[place] = replace(self.window, a_poses=a_poses, b_poses=b_poses)
        noises = [noise] * len(possible)
        found[list(possible)] = solver.least_chi2(list(possible.values()), noises, delta)


def ask(request: WindowRequest, a: PairEnd, b: PairEnd) -> Question:
    """What a computation needs, copied: tracks grow meanwhile."""
    return Question(request.window, WindowTrack.of(a, request), WindowTrack.of(b, request))
