"""What breaks the model of the sensors: put into a recording that is as wrong as modelled.

Each fault is a function of a generator and a recording that gives another recording.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from lab.recordings.recording import Array, Recording, Trail
from lab.score import metrics

Fault = Callable[[np.random.Generator, Recording], Recording]

SLIP_SHARE, SLIP_S, SLIP_MORE = 0.08, 1.0, 0.5
"""Wheels slip in so many seconds of a drive, and then say by half more than is driven."""
JERKS_PER_MINUTE, JERK_DEG, JERK_S = 3.0, 8.0, 0.2
"""Now and then the base is turned by something else than its wheels."""

BLOCKED_SHARE, BLOCKED_S = 0.4, 10.0
"""Sight is blocked in so much of the time, so long at a time in the mean."""
BLOCKED_LEAST_M, BLOCKED_MEAN_M = 0.3, 1.0
"""By how much ranges are then too long, at least, and beyond that in the mean."""

WALL_S, WALL_M = (35.0, 55.0), (0.5, 1.5)
"""When sight between two is gone for good, and how much too long ranges are from then on."""

TAILS_M, TAILS_DOF = 0.05, 2
"""Student's distribution of so few degrees has no variance."""

SWING_M = (0.04, 0.10)
"""From the shortest to the longest that the bias of one module becomes when it turns."""


EVIDENT_M, EVIDENT_DEG = 0.25, 10.0
"""Wheels that have been wrong by so much since their fault began can be known to be wrong; so can
ranges that are."""

Evidence = Callable[[Recording, Recording, float], float]
"""From when it can be known that a recording is wrong, s: of the same drive measured as modelled,
the recording, and a time before which nothing counts; infinite where it is not that wrong."""


# wheels


def evident_in_wheels(right: Recording, wrong: Recording, since_s: float) -> float:
    """`Evidence` of odometry."""
    found = [float("inf")]
    for robot, trail in wrong.trails.items():
        off = _steps(trail) - _steps(right.trails[robot])
        off[trail.t[1:] <= since_s] = 0.0
        ways, turned = np.hypot(off[:, 0], off[:, 1]).cumsum(), np.degrees(off[:, 2].cumsum())
        is_evident = (ways > EVIDENT_M) | (np.abs(turned) > EVIDENT_DEG)
        found += trail.t[1:][is_evident][:1].tolist()
    return min(found)


def evident_in_ranges(right: Recording, wrong: Recording, since_s: float) -> float:
    """`Evidence` of ranges."""
    off = np.abs(wrong.ranges[:, 3] - right.ranges[:, 3]) > EVIDENT_M
    found = wrong.ranges[off & (wrong.ranges[:, 0] > since_s), 0]
    return float(found[0]) if len(found) else float("inf")


def slipping(rng: np.random.Generator, recording: Recording) -> Recording:
    """Wheels that slip along the way, and sudden turns that they do not see."""
    trails = {robot: _slipped(rng, trail) for robot, trail in recording.trails.items()}
    return replace(recording, trails=trails)


def _slipped(rng: np.random.Generator, trail: Trail) -> Trail:
    step = _steps(trail)
    t = trail.t[1:]
    seconds = rng.random(int(trail.t[-1] / SLIP_S) + 1) < SLIP_SHARE
    step[:, :2] *= 1 + SLIP_MORE * seconds[(t / SLIP_S).astype(int)][:, None]
    for start in rng.uniform(0, trail.t[-1], round(trail.t[-1] / 60 * JERKS_PER_MINUTE)):
        inside = (t >= start) & (t < start + JERK_S)
        step[inside, 2] += np.radians(JERK_DEG) * rng.choice([-1, 1]) / max(inside.sum(), 1)
    return replace(trail, odometry=_chained(trail.odometry[0], step))


def _steps(trail: Trail) -> Array:
    """(k, 3) of its odometry."""
    return metrics.relative(trail.odometry[:-1], trail.odometry[1:])


def _chained(start: Array, steps: Array) -> Array:
    """(k + 1, 3) poses from a start (3,) by steps (k, 3), each in the frame of the one before."""
    out = np.zeros((len(steps) + 1, 3))
    out[0] = start
    out[1:, 2] = start[2] + np.cumsum(steps[:, 2])
    turned = metrics.compose(out[:-1] * [0, 0, 1], steps)
    out[1:, :2] = start[:2] + np.cumsum(turned[:, :2], axis=0)
    return out


# ranges


def blocked(rng: np.random.Generator, recording: Recording) -> Recording:
    """Sight between two robots that is blocked for long, each time by as much as it is."""

    def extra(a: int, b: int, t: Array) -> Array:
        out = np.zeros(len(t))
        clear_s = BLOCKED_S * (1 - BLOCKED_SHARE) / BLOCKED_SHARE
        is_blocked, now = rng.random() < BLOCKED_SHARE, 0.0
        while now <= t[-1]:
            until = now + rng.exponential(BLOCKED_S if is_blocked else clear_s)
            if is_blocked:
                size = BLOCKED_LEAST_M + rng.exponential(BLOCKED_MEAN_M)
                out[(t >= now) & (t < until)] = size
            now, is_blocked = until, not is_blocked
        return out

    return lengthened(recording, extra)


def walled(rng: np.random.Generator, recording: Recording) -> Recording:
    """Two robots lose sight of each other, and stay so."""
    robots = sorted(recording.trails)
    hidden = tuple(sorted(rng.choice(robots, 2, replace=False).tolist()))
    since, size = rng.uniform(*WALL_S), rng.uniform(*WALL_M)
    return lengthened(
        recording, lambda a, b, t: np.where((t >= since) & ((a, b) == hidden), size, 0.0)
    )


def heavy_tailed(rng: np.random.Generator, recording: Recording) -> Recording:
    """Noise of every range that knows no bounds."""
    return lengthened(recording, lambda a, b, t: TAILS_M * rng.standard_t(TAILS_DOF, len(t)))


def off_axle(places: Mapping[int, tuple[float, float]], configured: bool) -> Fault:
    """Antennas of robots at (x, y) m in their body frames.

    Args:
        configured: do the robots' configurations say so?
    """

    def fault(rng: np.random.Generator, recording: Recording) -> Recording:
        def extra(a: int, b: int, t: Array) -> Array:
            ends = [
                metrics.at_times(recording.trails[r].t, recording.trails[r].truth, t)
                for r in (a, b)
            ]
            seats = [
                metrics.compose(end, np.array([*places.get(r, (0.0, 0.0)), 0.0]))
                for r, end in zip((a, b), ends, strict=True)
            ]
            return _distance(*seats) - _distance(*ends)

        moved = lengthened(recording, extra)
        return replace(moved, antennas=dict(places)) if configured else moved

    return fault


def bearing_biased(rng: np.random.Generator, recording: Recording) -> Recording:
    """A bias of each module that moves with the bearing of the other: two waves in a round."""
    swings = {robot: _swing(rng) for robot in recording.trails}

    def extra(a: int, b: int, t: Array) -> Array:
        ends = {
            r: metrics.at_times(recording.trails[r].t, recording.trails[r].truth, t) for r in (a, b)
        }
        out = np.zeros(len(t))
        for robot, other in ((a, b), (b, a)):
            place = metrics.relative(ends[robot], ends[other])
            out += swings[robot](np.arctan2(place[:, 1], place[:, 0]))
        return out

    return lengthened(recording, extra)


def _swing(rng: np.random.Generator) -> Callable[[Array], Array]:
    """Bias in m over bearing in rad, of one module."""
    sizes, phases = rng.uniform(0.2, 1.0, 2), rng.uniform(-np.pi, np.pi, 2)

    def wave(bearing: Array) -> Array:
        first, second = np.cos(bearing + phases[0]), np.cos(2 * bearing + phases[1])
        return np.asarray(sizes[0] * first + sizes[1] * second)

    unit = np.ptp(wave(np.linspace(-np.pi, np.pi, 721)))
    size = rng.uniform(*SWING_M) / unit
    return lambda bearing: size * wave(bearing)


def lengthened(recording: Recording, extra: Callable[[int, int, Array], Array]) -> Recording:
    """Ranges between robots a < b longer by extra(a, b, t) (k,) m at moments t (k,), whichever of
    the two measured."""
    ranges = recording.ranges.copy()
    for (a, b), rows in _pairs(ranges):
        moments, which = np.unique(ranges[rows, 0], return_inverse=True)
        ranges[rows, 3] += extra(a, b, moments)[which]
    return replace(recording, ranges=ranges)


def _pairs(ranges: Array) -> Iterator[tuple[tuple[int, int], Array]]:
    """Each pair a < b with the rows of its ranges."""
    ends = np.sort(ranges[:, 1:3], axis=1)
    for a, b in np.unique(ends, axis=0).astype(int).tolist():
        yield (a, b), np.flatnonzero((ends == [a, b]).all(axis=1))


def _distance(a: Array, b: Array) -> Array:
    """(k,) m between poses (k, 3)."""
    return np.asarray(np.hypot(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1]))
