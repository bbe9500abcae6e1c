"""One thing that may stand: looked for until it has one place, told, watched, and let go.

What is said of it are a closure without a heading, and then ranges: those that led to its place,
and one a second while the robot moves. Whether it still stands there, ranges of the last seconds
say: a node that somebody moves is noticed as soon as they do not fit for some seconds, and it is
looked for anew as if it had never been seen. Where ranges fitted for long, what was measured stays
true: the place that it has left stays in the graph, and a range to the next one says that it was
left. Else it may never have stood there, and its closure is withdrawn. Meanwhile no range is said
that may be to another place, or the team would bend until all of them fit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from statistics import median
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US, Chain, is_node
from drslamd.slam import se2
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement, RangeMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.points.point_search import Passing, PlaceCandidate, PlaceFound, search
from drslamd.slam.range_model import RangeModel, RangeNoise
from drslamd.slam.relative_pose.pair_end import STILL_M, PairEnd, anchor
from drslamd.slam.relative_pose.range_buffer import RangeBuffer, TimedRanges
from drslamd.slam.relative_pose.window import binned
from drslamd.slam.se2 import Array

LOOK_US = 2 * SECOND_US
"""Between two searches."""
SPAN_US = 60 * SECOND_US
"""The longest way that is looked at."""
BINS = 60
"""Points that a way is condensed to, see `window_request`."""
LEAST_BIN_S = 0.1
AGREE_M = 0.5
"""Two searches that name places so near, one after the other, name one place."""
EVERY_US = SECOND_US * 9 // 10
"""Timers of a second may be so uneven."""
SAID_AT_ONCE = 40
"""Ranges that led to a place, told with it: 1.2 kB."""
OFF_SIGMAS, OFF_M = 3.0, 0.4
"""A range that is off by more of both does not fit."""
HELD_SIGMAS, HELD_M = 2.0, 0.25
"""A range that is off by more of both is not said."""
MOST_BIAS_M = 0.15
"""What a bias is known to as soon as a place is."""
PROVEN_S = 15
"""So many seconds of ranges that fit make a place one that was right: what lies on the other side
of the way does not fit for long."""
NEXT_SIGMA_M = 10.0
"""Of the range that says that a place was left: it may still be carried about."""
OFF_S = 6
"""So many seconds more in which ranges do not fit than in which they do: longer than a burst."""


class Target(NamedTuple):
    """What is looked for.

    Attributes:
        chain, n: the keyframe by which it is named: of a robot that stands, or of a node, of which
            that number is chosen when its place is told.
        since_us: on our clock it has stood at least since then.
        arm_m: of the antenna of a robot, whose heading nobody knows.
    """

    chain: Chain
    n: int = -1
    since_us: int = 0
    arm_m: float = 0.0


class Sensors(NamedTuple):
    """What is believed of ranges."""

    noise: RangeNoise
    model: RangeModel


class PointTracker:
    """Of one module.

    Attributes:
        target: what it is taken for.
        found: what the last search said, None before the first.
        told: the closure that says where it stands; None while none is.
    """

    def __init__(self, target: Target, sensors: Sensors) -> None:
        self.target, self._sensors = target, sensors
        self.found: PlaceFound | None = None
        self.told: ClosureMeasurement | None = None
        self._looked = self._sampled = 0
        self._since = target.since_us
        self._before: Array | None = None
        self._place: Array | None = None
        self._off, self._fits, self._is_held = 0, 0, False
        self._closures: list[ClosureMeasurement] = []
        self._ranges: list[RangeMeasurement] = []

    # where is it?

    def look(
        self, own: PairEnd, ranges: RangeBuffer, utime: int
    ) -> Callable[[], tuple[PlaceFound, int]] | None:
        """A search that is due: what it says, and for which time of our clock."""
        if self.told is not None or utime - self._looked < LOOK_US or ranges.newest is None:
            return None
        self._looked = utime
        last = min(own.last_us, ranges.newest)
        seen = self._seen(own, ranges, last)
        if len(seen.utime) < 2:
            return None
        span_s = (seen.utime[-1] - seen.utime[0]) / SECOND_US
        seconds = (seen.utime - last) / SECOND_US
        width = max(LEAST_BIN_S, span_s / BINS)
        t, metres, counts = binned(seconds, seen.range_m, width)
        first = np.cumsum(counts) - counts
        passing = Passing(
            t=t,
            range_m=metres,
            doubt_m=seen.doubt_m[first],
            poses=se2.between(own.poses(last), own.poses(last + t * SECOND_US)),
            antenna=own.data.model.antenna,
        )
        noise, model = self._sensors
        return partial(_searched, passing, own, noise, model, last)

    def _seen(self, own: PairEnd, ranges: RangeBuffer, last: int) -> TimedRanges:
        first = max(own.first_us, last - SPAN_US, self._since)
        return ranges.between(first, last).in_sight(self._sensors.model)

    def is_certain(self, found: PlaceFound, own: PairEnd, when: int) -> bool:
        """A search has ended: is there one place, as at the time before?"""
        self.found = found
        if self.told is not None or found.verdict:
            self._before = None
            return False
        (body,) = own.poses(when)
        place, before = se2.transform(body, found.candidates[0].place), self._before
        self._before = place
        return before is not None and bool(np.hypot(*(place - before)) < AGREE_M)

    def say(self, n: int, own: PairEnd, ranges: RangeBuffer, when: int, number: int) -> bool:
        """Tell that place as keyframe n of what stands there, by a closure of this number."""
        at = anchor(own, when)
        if at is None or self.found is None:
            return False
        self.target = self.target._replace(n=n)
        best = self.found.candidates[0]
        self.told = self._closure(best, at.n, at.keyframe_T_body, number)
        self._closures.append(self.told)
        if is_node(self.target.chain.robot):
            self._say_how(own, ranges, when)
        return True

    def _closure(
        self, best: PlaceCandidate, n: int, k_T_body: Array, number: int
    ) -> ClosureMeasurement:
        """
        Args:
            n: our keyframe, and where the body was, seen from it.
        """
        x, y = se2.transform(k_T_body, best.place).tolist()
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = best.covariance + self.target.arm_m**2 * np.eye(2)
        covariance[2, 2] = NO_HEADING
        return ClosureMeasurement(
            number=number,
            kept=True,
            a_n=n,
            peer=self.target.chain,
            b_n=self.target.n,
            a_T_b=(x, y, 0.0),
            covariance=se2.packed(se2.turned(covariance, k_T_body[2])),
        )

    # what goes into our log

    def tell(self) -> list[ClosureMeasurement]:
        """Closures, and withdrawals."""
        out, self._closures = self._closures, []
        return out

    def tell_ranges(self) -> list[RangeMeasurement]:
        """Ranges to it."""
        out, self._ranges = self._ranges, []
        return out

    def _say_how(self, own: PairEnd, ranges: RangeBuffer, when: int) -> None:
        """The ranges that led to its place, evenly over the way."""
        seen = self._seen(own, ranges, when)
        starts = np.unique(seen.utime // SECOND_US)
        for second in starts[-SAID_AT_ONCE:].tolist():
            inside = (seen.utime // SECOND_US) == second
            self._say(own, seen.chosen(inside))

    def sample(self, own: PairEnd, ranges: RangeBuffer) -> None:
        """The range of this second, once the place is told and while we move."""
        is_pair = not is_node(self.target.chain.robot)  # (whose ranges are said anyway)
        if self.told is None or ranges.newest is None or is_pair or self._is_held:
            return
        last = min(own.last_us, ranges.newest)
        if last - self._sampled >= EVERY_US:
            self._say(own, ranges.between(max(last - SECOND_US, own.first_us), last))

    def _say(self, own: PairEnd, found: TimedRanges) -> None:
        found = found.in_sight(self._sensors.model)
        if not len(found.utime):
            return
        when = int(median(found.utime.tolist()))
        at, place = anchor(own, when), own.pose(when)[:2]
        is_still = self._place is not None and np.hypot(*(place - self._place)) < STILL_M
        if at is None or is_still or when <= self._sampled:
            return
        self._sampled, self._place = when, place
        noise, model = self._sensors
        metres, doubt = median(found.range_m.tolist()), median(found.doubt_m.tolist())
        near = float(model.near_range_sigma(metres))
        x, y = se2.transform(at.keyframe_T_body, own.data.model.antenna).tolist()
        self._ranges.append(
            RangeMeasurement(
                a_n=at.n,
                peer=self.target.chain,
                b_n=self.target.n,
                q_a=(x, y),
                q_b=(0.0, 0.0),
                range_m=metres,
                sigma_m=float(np.sqrt(noise.sigma**2 + near**2 + doubt**2)),
                turn_a=float(se2.wrap(at.keyframe_T_body[2])),
            )
        )

    # is it still there?

    def watch(self, estimate: TeamEstimate, own: PairEnd, ranges: RangeBuffer) -> bool:
        """Once a second: has it been moved?"""
        misfit = self._misfit(estimate, own, ranges) if self.told is not None else None
        if misfit is None:
            return False
        metres, sigmas = misfit
        is_off = metres > OFF_M and sigmas > OFF_SIGMAS
        self._off = max(0, self._off + (1 if is_off else -1))
        self._is_held = self._off > 0 or (metres > HELD_M and sigmas > HELD_SIGMAS)
        self._fits += not self._is_held
        return self._off >= OFF_S

    def is_outdated(self, graph: PoseGraph) -> bool:
        """Has somebody found a node at another place since?"""
        known = graph.nodes.get(self.target.chain.robot)
        return self.told is not None and known is not None and known.keyframes.n[-1] > self.target.n

    @property
    def is_proven(self) -> bool:
        """Did it stand where it was told, sure enough?"""
        return is_node(self.target.chain.robot) and self._fits >= PROVEN_S

    def leave(self, own: PairEnd, ranges: RangeBuffer, utime: int) -> None:
        """It does not stand there any more: say so, and look for it anew."""
        if not self.is_proven:
            self.let_go(utime)
            return
        last, since = min(own.last_us, ranges.newest or 0), len(self._ranges)
        self._sampled, self._place = 0, None
        self._say(own, ranges.between(max(last - SECOND_US, own.first_us), last))
        said = self._ranges[since:]
        self._ranges[since:] = [
            replace(one, b_n=self.target.n + 1, sigma_m=NEXT_SIGMA_M) for one in said
        ]
        if said:
            self.begin_again(utime)
        else:
            self.let_go(utime)

    def let_go(self, utime: int) -> None:
        """It never stood there, or is something else: withdraw what was told, begin again."""
        if self.told is not None:
            self._closures.append(replace(self.told, kept=False))
        self.begin_again(utime)

    def begin_again(self, utime: int) -> None:
        """Look for it as if it had never been seen."""
        self.told = self.found = self._before = None
        self._since, self._off, self._fits, self._is_held = utime, 0, 0, False

    def _misfit(
        self, estimate: TeamEstimate, own: PairEnd, ranges: RangeBuffer
    ) -> tuple[float, float] | None:
        """By how many metres, and sigmas, the ranges of the last second do not fit; None where that
        cannot be said."""
        robot, number = own.data.chain.robot, self.target.chain.robot
        solved, there = estimate.trajectories.get(robot), estimate.everybody.get(number)
        joint = estimate.joint_of(robot, number)
        if solved is None or there is None or joint is None or ranges.newest is None:
            return None
        if not len(there.n) or int(there.n[-1]) != self.target.n or not len(solved.n):
            return None
        last, n = min(own.last_us, ranges.newest), int(solved.n[-1])
        seen = ranges.between(last - SECOND_US, last).in_sight(self._sensors.model)
        if not len(seen.utime) or not own.track.covers(n, own.track.end - 1):
            return None
        when = median(seen.utime.tolist())
        step = se2.between(own.track.at(n), own.pose(when))
        antenna = se2.transform(se2.compose(solved.poses[-1], step), own.data.model.antenna)
        sight = there.poses[-1, :2] - antenna
        distance = max(float(np.hypot(*sight)), 1e-3)
        u = np.concatenate([-sight, [0.0], sight, [0.0]]) / distance
        bias = estimate.bias_m.get((min(robot, number), max(robot, number)), Learned())
        off = distance + bias.value - median(seen.range_m.tolist())
        noise, model = self._sensors
        variance = u @ joint @ u + noise.sigma**2 + float(model.near_range_sigma(distance)) ** 2
        variance += min(bias.sigma, MOST_BIAS_M) ** 2
        return abs(off), abs(off) / float(np.sqrt(variance))


def _searched(
    passing: Passing, own: PairEnd, noise: RangeNoise, model: RangeModel, when: int
) -> tuple[PlaceFound, int]:
    return search(passing, own.data.model.noise, noise, model), when
