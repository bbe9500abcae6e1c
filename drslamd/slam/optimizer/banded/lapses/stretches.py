"""Where wheels, or one of two, may have stood or spun, as they show it themselves, and problems
with that freed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ
from drslamd.slam.odometry.jumps import AT_ONCE, JUMP_MPS
from drslamd.slam.optimizer.problem import Freed, OdometryFactors, Problem
from drslamd.slam.se2 import Array, Index

STANDS_S = 2.0
"""Who stands for less is back before anything can be seen of it."""
STILL_MPS, STILL_RADPS = 0.05, 0.1
"""Wheels that stand."""
PIVOTS_S, PIVOTS_RADPS = 3.0, 0.2
"""Who turns about one wheel for so long, and so fast: the counter of that wheel may stand."""
PIVOTS_AT = (0.95, 1.05)
"""How far from its middle, in halves of the configured track: whatever the true one is, a counter
that stands has odometry turn about the place where its wheel is configured."""
PIVOTS_APART_S = 2.0
"""Between such links of one stretch, in which the other wheel hardly moved; a lane lasts longer."""
MOVES_MPS = 0.1
"""Links slower than this say nothing of how fast a robot drives."""
FASTER = 1.25
"""Times its usual speed: wheels that spin, or somebody in a hurry, who fits without."""
APART_S = 4.0
"""Between fast links of one stretch: a robot whose wheels spin slows down to turn."""
LEAST_MPS, MOST_RADPS = 0.2, 0.5
"""A robot whose wheels do not count may drive as fast as it usually does, or so fast, and turn."""
UNKNOWN_M = 100.0
"""Sigma of a range that says nothing."""
SHORT_S = (AT_ONCE + 0.5) / GRID_HZ
"""A link that is made because wheels changed their speed at once, ..."""
SHARE = 0.7
"""... if those beside it show that, which are longer, by so much of a jump."""
MOST_TRIED = 4
"""Stretches of each robot, the latest ones."""


def likely_stretches(problem: Problem) -> list[Freed]:
    """Where wheels may have stood or spun: of all robots, those of each in the order of time."""
    out = []
    for robot in range(len(problem.priors.scale)):
        mine = np.flatnonzero(problem.odometry.robot == robot)
        mine = mine[np.argsort(problem.n[problem.odometry.j[mine]], kind="stable")]
        out += _of_robot(problem, robot, mine)
    return out


def _of_robot(problem: Problem, robot: int, mine: Index) -> list[Freed]:
    """The latest ones of its links (k,)."""
    odometry = problem.odometry
    seconds = _seconds(problem, mine)
    speed = np.hypot(*odometry.measured[mine, :2].T) / seconds
    turning = np.abs(odometry.measured[mine, 2]) / seconds
    # (who moves makes a keyframe each second)
    stands = (seconds >= STANDS_S) | ((speed < STILL_MPS) & (turning < STILL_RADPS))
    until = np.cumsum(seconds)
    stood = [
        (first, last, True)
        for first, last in _stretches(stands, until, 0.0)
        if seconds[first : last + 1].sum() >= STANDS_S
    ]
    half_track = 0.0 if problem.half_track is None else float(problem.half_track[robot])
    pivots = _pivots(odometry.measured[mine], seconds, half_track)
    stood += [
        (first, last, True)
        for first, last in _stretches(pivots, until, PIVOTS_APART_S)
        if (seconds * pivots)[first : last + 1].sum() >= PIVOTS_S
    ]
    is_fast = speed > FASTER * _usual_speed(speed)
    spun = [(first, last, False) for first, last in _stretches(is_fast, until, APART_S)]
    jumps = _jumps(speed, seconds)
    # each began and ended somewhere in the links beside
    spans = [
        (slice(max(first - 1, 0), last + 2), is_still)
        for first, last, is_still in sorted(stood + spun)[-MOST_TRIED:]
    ]
    return [
        replace(
            freed_links(problem, robot, mine[span], is_still), is_abrupt=bool(jumps[span].any())
        )
        for span, is_still in spans
    ]


def has_short_links(problem: Problem) -> bool:
    """May there be a jump of wheels?"""
    odometry = problem.odometry
    return bool((problem.n[odometry.j] - problem.n[odometry.i] <= SHORT_S * GRID_HZ).any())


def _jumps(speed: Array, seconds: Array) -> NDArray[np.bool_]:
    """(k,) links in which wheels change their speed at once."""
    out = np.zeros(len(speed), dtype=bool)
    is_short = seconds[1:-1] <= SHORT_S
    out[1:-1] = is_short & (np.abs(speed[2:] - speed[:-2]) > SHARE * JUMP_MPS)
    return out


def _pivots(measured: Array, seconds: Array, half_track: float) -> NDArray[np.bool_]:
    """(k,) links (k, 3) that turn about one wheel.

    Args:
        half_track: m, 0 where nothing turns about a wheel.
    """
    turn = np.abs(measured[:, 2])
    radius = np.hypot(*measured[:, :2].T) / np.maximum(2 * np.sin(np.minimum(turn, 3.0) / 2), 1e-9)
    nearest, farthest = (times * half_track for times in PIVOTS_AT)
    is_turn = turn > PIVOTS_RADPS * seconds
    return np.asarray(is_turn & (radius > nearest) & (radius < farthest))


def _seconds(problem: Problem, links: Index) -> Array:
    """(k,) that links last."""
    odometry = problem.odometry
    return np.asarray((problem.n[odometry.j[links]] - problem.n[odometry.i[links]]) / GRID_HZ)


def _usual_speed(speed: Array) -> float:
    moving = speed[speed > MOVES_MPS]
    return max(float(np.median(moving)), LEAST_MPS) if len(moving) else LEAST_MPS


def _stretches(flagged: NDArray[np.bool_], until: Array, apart_s: float) -> list[tuple[int, int]]:
    """First and last of the runs of flagged links; those that lie no farther apart are one.

    Args:
        until: (k,) s, when links end.
    """
    out: list[tuple[int, int]] = []
    for k in np.flatnonzero(flagged).tolist():
        if out and until[k - 1] - until[out[-1][1]] <= apart_s:
            out[-1] = (out[-1][0], k)
        else:
            out.append((k, k))
    return out


def freed_links(problem: Problem, robot: int, links: Index, stands: bool) -> Freed:
    mine = problem.odometry.robot == robot
    seconds = _seconds(problem, np.flatnonzero(mine))
    usual = _usual_speed(np.hypot(*problem.odometry.measured[mine, :2].T) / seconds)
    added = _freedom(problem.odometry, links, usual, _seconds(problem, links), stands)
    return Freed(robot, links, added, stands)


def _freedom(
    odometry: OdometryFactors, links: Index, speed: float, seconds: Array, stands: bool
) -> Array:
    """(k, 3, 3) what a robot can do beside what wheels say: anything where they or one of them
    stand, and another way in the same direction where they spin.

    Args:
        speed: m/s at which it drives; seconds: (k,) that links last.
    """
    out = np.zeros((len(links), 3, 3))
    way = (speed * seconds) ** 2
    if stands:
        out[:, 0, 0] = out[:, 1, 1] = way
        out[:, 2, 2] = (MOST_RADPS * seconds) ** 2 + odometry.measured[links, 2] ** 2
        return out
    chord = odometry.measured[links, :2]
    along = chord / np.maximum(np.hypot(*chord.T), 1e-9)[:, None]
    out[:, :2, :2] = way[:, None, None] * along[:, :, None] * along[:, None, :]
    return out


def with_freed(problem: Problem, freed: Freed) -> Problem:
    """With a stretch freed, and without what was ranged along it while no keyframe was made."""
    covariance = problem.odometry.covariance.copy()
    covariance[freed.links] += freed.added
    odometry = replace(problem.odometry, covariance=covariance)
    ranges = problem.ranges
    if freed.stands:
        sigma = np.where(_ranged_later(problem, freed), UNKNOWN_M, ranges.sigma)
        ranges = replace(ranges, sigma=sigma)
    all_freed = (*problem.freed, freed)
    told = problem.told or problem
    return replace(problem, odometry=odometry, ranges=ranges, freed=all_freed, told=told)


def _ranged_later(problem: Problem, freed: Freed) -> NDArray[np.bool_]:
    """(m,) ranges that name a keyframe of a robot whose wheels stood, measured when the other robot
    had made more of its own: nobody knows where that one was by then."""
    odometry, ranges = problem.odometry, problem.ranges
    out = np.zeros(len(ranges), dtype=bool)
    for pose in odometry.i[freed.links[_seconds(problem, freed.links) >= STANDS_S]].tolist():
        for mine, other in ((ranges.i, ranges.j), (ranges.j, ranges.i)):
            for robot in np.unique(problem.robot_id[other[mine == pose]]).tolist():
                later = np.flatnonzero(problem.robot_id == robot)
                later = later[later > pose]
                is_its = (mine == pose) & (problem.robot_id[other] == robot)
                if len(later):
                    out |= is_its & (problem.n[other] >= problem.n[later[0]] + GRID_HZ)
    return out


def span(problem: Problem, freed: Freed) -> tuple[int, int]:
    odometry = problem.odometry
    return int(problem.n[odometry.i[freed.links[0]]]), int(problem.n[odometry.j[freed.links[-1]]])


def under(problem: Problem, freed: Iterable[Freed], after_s: float = 0.0) -> NDArray[np.bool_]:
    """(m,) the links of their robots along some of them and for some seconds after."""
    odometry = problem.odometry
    n = problem.n[odometry.i]
    out = np.zeros(len(n), dtype=bool)
    for one in freed:
        first, last = span(problem, one)
        out |= (odometry.robot == one.robot) & (n >= first) & (n < last + after_s * GRID_HZ)
    return out
