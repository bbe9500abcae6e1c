"""The Cramer-Rao bound of a team: how well anybody could know its poses from what was measured.

The noise is the simulator's own, its sigmas known, and the model is linear about the truth. The
state are the errors of all poses, of each pair's bias and slow bias, of each robot's scale and yaw
rate; its covariance after Kalman's filter bounds what can be said live, after smoothing (modified
Bryson-Frazier, which inverts nothing singular) what can be said in hindsight. Robot 0 makes the
frame, so where it began is known. Bursts are given away: an oracle says which ranges are wrong,
and nothing is learned from those.

With p a position, theta a heading, u along it and v across, f the way of a step, s the scale and y
the yaw rate, errors go on as

    p' = p + v f theta - u f s - v f |f| y / 2,   theta' = theta - |f| y,

and what is random in a step is drawn along u and, by half of its turn, along v.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from lab.recordings.recording import Array, Recording
from lab.recordings.world import OdometryModel, RangeModel, Scene
from lab.score import metrics

STEP_S = 0.1
WIDE_M, WIDE_RAD = 10.0, 1.8
"""What is known of the others at the start."""
EXACT = 1e-10
"""Variance of what does not err, so that covariances stay positive."""


@dataclass(frozen=True)
class Bound:
    """Of a team of R robots at k times.

    Attributes:
        t: (k,) s.
        live, hindsight: (k, 3R, 3R) covariances of x, y, theta of all robots, in the axes of the
            world and in the frame of robot 0.
        poses: (k, R, 3) true.
    """

    t: Array
    live: Array
    hindsight: Array
    poses: Array

    def of_pose(self, k: int, robot: int) -> tuple[Array, Array]:
        """(1,) variances of position, m^2, and heading, rad^2, that can be reached live."""
        at = 3 * robot
        x, y, theta = np.diag(self.live[k])[at : at + 3]
        return np.array([x + y]), np.array([theta])

    def of_pair(self, a: int, b: int) -> tuple[Array, Array]:
        """(k,) variances of position and heading of b seen from a, in hindsight."""
        apart = self.poses[:, b, :2] - self.poses[:, a, :2]
        j = np.zeros((len(self.t), 3, self.hindsight.shape[1]))
        j[:, :, 3 * b : 3 * b + 3] = np.eye(3)
        j[:, :, 3 * a : 3 * a + 3] = -np.eye(3)
        j[:, 0, 3 * a + 2], j[:, 1, 3 * a + 2] = apart[:, 1], -apart[:, 0]
        seen = j @ self.hindsight @ j.transpose(0, 2, 1)
        return seen[:, 0, 0] + seen[:, 1, 1], seen[:, 2, 2]


def of_recording(recording: Recording, scene: Scene, times: Array) -> Bound:
    """The bound of a simulated recording of a scene, at these times, s."""
    truths = true_steps(recording)
    return of_team(truths, scene, steps_at(times, len(truths)))


def true_steps(recording: Recording) -> Array:
    """(n, R, 3) where everybody was, one each `STEP_S`."""
    trails = [recording.trails[robot] for robot in sorted(recording.trails)]
    t = np.arange(0.0, trails[0].t[-1], STEP_S)
    return np.stack([metrics.at_times(x.t, x.truth, t) for x in trails], axis=1)


def steps_at(times: Array, count: int) -> Array:
    """The steps of these times, s, as far as there are any."""
    at = np.round(times / STEP_S).astype(int)
    return at[at < count]


def of_team(truths: Array, scene: Scene, at: Array) -> Bound:
    """The bound for true poses (n, R, 3), one each `STEP_S`, at some of the n."""
    robots = truths.shape[1]
    white = np.full((len(truths), robots * (robots - 1) // 2), _white(scene))
    gone = through(truths, scene, white, at)
    poses = slice(0, 3 * robots)
    smoothed = _smoothed(gone)
    return Bound(
        at * STEP_S,
        np.array([gone.filtered[k][poses, poses] for k in at.tolist()]),
        np.array([smoothed[k][poses, poses] for k in at.tolist()]),
        truths[at],
    )


def each_alone(truths: Array, scene: Scene, sigma_m: float, at: Array) -> Array:
    """(k, 3R, 3R) covariances that a filter reaches live which weighs each range by itself.

    It is told all but that ranges share their errors from one second to the next, and errs by what
    they really are.

    Args:
        truths, at: see `of_team`.
        sigma_m: that it takes for that of all ranges of a pair in a second.
    """
    robots = truths.shape[1]
    pairs, poses = len(pairs_of(robots)), slice(0, 3 * robots)
    unaware = replace(scene, ranges=replace(scene.ranges, slow=EXACT))
    believed = np.full((len(truths), pairs), sigma_m**2 / STEP_S)
    steps = through(truths, unaware, believed, at[:0])
    transition = _Transition(scene.odometry, scene.ranges, robots, pairs)
    covariance = _start(scene.odometry, scene.ranges, robots, pairs)
    white, wanted, out = _white(scene), set(at.tolist()), dict[int, Array]()
    for k, (_, gain, _) in enumerate(steps.steps):
        if k:
            f, q = transition.step(truths[k - 1], truths[k])
            covariance = f @ covariance @ f.T + q
        left = np.eye(transition.size) - gain @ steps.sight[k]
        covariance = left @ covariance @ left.T + white * gain @ gain.T
        if k in wanted:
            out[k] = covariance[poses, poses]
    return np.array([out[k] for k in at.tolist()])


@dataclass(frozen=True)
class Gone:
    """Kalman's filter, gone through all steps.

    Attributes:
        steps: how each came from the one before, its gain and its innovation.
        sight: (n, P, size) derivatives of the ranges.
        predicted, filtered: covariances before and after what was measured, where wanted.
    """

    steps: list[tuple[Array, Array, Array]]
    sight: Array
    predicted: dict[int, Array]
    filtered: dict[int, Array]


def through(truths: Array, scene: Scene, white: Array, at: Array) -> Gone:
    """The filter, linear about the truth.

    Args:
        white: (n, P) variances of what was measured between each pair in each step.
        at: steps of which covariances are kept.
    """
    robots = truths.shape[1]
    pairs = pairs_of(robots)
    transition = _Transition(scene.odometry, scene.ranges, robots, len(pairs))
    covariance = _start(scene.odometry, scene.ranges, robots, len(pairs))
    gone = Gone([], _sights(truths, pairs, transition.size), {}, {})
    wanted = set(at.tolist())
    for k in range(len(truths)):
        f = np.eye(transition.size)
        if k:
            f, q = transition.step(truths[k - 1], truths[k])
            covariance = f @ covariance @ f.T + q
        h = gone.sight[k]
        innovation = h @ covariance @ h.T + np.diag(white[k])
        gain = np.linalg.solve(innovation, h @ covariance).T
        gone.steps.append((f, gain, innovation))
        if k in wanted:
            gone.predicted[k] = covariance
        left = np.eye(transition.size) - gain @ h
        covariance = left @ covariance @ left.T + (gain * white[k]) @ gain.T
        if k in wanted:
            gone.filtered[k] = covariance
    return gone


def pairs_of(robots: int) -> list[tuple[int, int]]:
    return list(combinations(range(robots), 2))


def _smoothed(gone: Gone) -> dict[int, Array]:
    """Covariances after all measurements, from those before each: P - P L P, with L from behind."""
    size = gone.sight.shape[2]
    later, out = np.zeros((size, size)), dict[int, Array]()
    for k in range(len(gone.steps) - 1, -1, -1):
        f, gain, innovation = gone.steps[k]
        h = gone.sight[k]
        left = np.eye(size) - gain @ h
        known = h.T @ np.linalg.solve(innovation, h) + left.T @ later @ left
        if k in gone.predicted:
            predicted = gone.predicted[k]
            out[k] = predicted - predicted @ known @ predicted
        later = f.T @ known @ f
    return out


def _start(odometry: OdometryModel, ranges: RangeModel, robots: int, pairs: int) -> Array:
    """The covariance before anything was measured."""
    poses = np.tile([WIDE_M**2, WIDE_M**2, WIDE_RAD**2], robots)
    poses[:3] = EXACT
    wheels = [odometry.scale**2] * robots, [np.radians(odometry.yaw_deg_per_m) ** 2] * robots
    return np.diag(
        np.concatenate([poses, [ranges.slow**2] * pairs, [ranges.bias**2] * pairs, *wheels])
    )


def _white(scene: Scene) -> float:
    """Variance of all ranges of a pair in one step together, bursts and slow bias left out."""
    count = max(scene.range_hz * STEP_S, 1.0) * (2 if scene.both_measure else 1)
    heard = (1 - scene.ranges.lost) * (1 - scene.ranges.burst_share)
    return scene.ranges.white**2 / (count * heard)


def _sights(truths: Array, pairs: Sequence[tuple[int, int]], size: int) -> Array:
    """(n, P, size) derivatives of ranges by the state."""
    h = np.zeros((len(truths), len(pairs), size))
    poses = 3 * truths.shape[1]
    for row, (a, b) in enumerate(pairs):
        sight = truths[:, b, :2] - truths[:, a, :2]
        sight = sight / np.linalg.norm(sight, axis=1)[:, None]
        h[:, row, 3 * a : 3 * a + 2], h[:, row, 3 * b : 3 * b + 2] = -sight, sight
        h[:, row, poses + row] = h[:, row, poses + len(pairs) + row] = 1.0
    return h


class _Transition:
    """How errors go on from step to step."""

    def __init__(
        self, odometry: OdometryModel, ranges: RangeModel, robots: int, pairs: int
    ) -> None:
        self._odometry, self._robots = odometry, robots
        self._slow = slice(3 * robots, 3 * robots + pairs)
        self._scale = 3 * robots + 2 * pairs
        self._yaw = self._scale + robots
        self.size = self._yaw + robots
        self._keep = float(np.exp(-STEP_S / ranges.slow_s))
        self._kick = ranges.slow**2 * (1 - self._keep**2)

    def step(self, before: Array, after: Array) -> tuple[Array, Array]:
        """Matrix and noise between true poses (R, 3)."""
        f, q = np.eye(self.size), np.zeros((self.size, self.size))
        slow = np.arange(self._slow.start, self._slow.stop)
        f[slow, slow], q[slow, slow] = self._keep, self._kick
        turn = metrics.wrapped(after[:, 2] - before[:, 2])
        heading = before[:, 2] + turn / 2
        odometry = self._odometry
        for robot in range(self._robots):
            u = np.array([np.cos(heading[robot]), np.sin(heading[robot])])
            v = np.array([-u[1], u[0]])
            way = float((after[robot, :2] - before[robot, :2]) @ u)
            path, at = abs(way), 3 * robot
            f[at : at + 2, at + 2] = v * way
            f[at : at + 2, self._scale + robot] = -u * way
            f[at : at + 2, self._yaw + robot] = -v * way * path / 2
            f[at + 2, self._yaw + robot] = -path
            drawn = odometry.translation_per_sqrt_m**2 * path
            turned = np.radians(odometry.yaw_deg_per_sqrt_m) ** 2 * path
            g = np.array([*(v * way / 2), 1.0])
            q[at : at + 3, at : at + 3] = turned * np.outer(g, g) + EXACT * np.eye(3)
            q[at : at + 2, at : at + 2] += drawn * np.outer(u, u)
        return f, q
