"""Scenes for the tests of `drslamd.slam`: poses as matrices, robots on curves, small teams.

What is needed to work out an expected value is written here a second time, plainly, on 3 x 3
matrices and in loops, and shares no code with the package.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drslamd.config import Config, parse
from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.optimizer.banded.banded_optimizer import BandedOptimizer
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.robot_model import RobotModel

Array = NDArray[Any]

NOISE = OdometryNoise(0.03, math.radians(0.15), 0.01, math.radians(0.5))
"""Wheels of usual quality: their scale is better than the configuration allows for by default."""
EXACT = OdometryNoise(1e-9, 1e-9, 1e-9, 1e-9)


def config(robot: int = 0, extra: str = "", uwb: str = "", wheels: str | None = None) -> Config:
    """A configuration that says only what must be said, in `uwb` more of that section.

    Args:
        wheels: the whole section, for another base than a Kobuki.
    """
    base = 'source = "kobuki"\nport = "/dev/wheels"\n' if wheels is None else wheels
    return parse(
        f'[robot]\nid = {robot}\n[team]\ninsecure = true\n[uwb]\nport = "/dev/uwb"\n{uwb}'
        f"[wheels]\n{base}{extra}"
    )


def matrix(pose: Sequence[float] | Array) -> Array:
    """The 3 x 3 matrix of one pose."""
    x, y, theta = (float(v) for v in pose)
    cos, sin = math.cos(theta), math.sin(theta)
    return np.array([[cos, -sin, x], [sin, cos, y], [0.0, 0.0, 1.0]])


def pose_of(m: Array) -> Array:
    """The pose of one 3 x 3 matrix, angle in (-pi, pi]."""
    return np.array([m[0, 2], m[1, 2], math.atan2(m[1, 0], m[0, 0])])


def product(*poses: Sequence[float] | Array) -> Array:
    """Poses multiplied in the order in which they are given."""
    m = np.eye(3)
    for pose in poses:
        m = m @ matrix(pose)
    return pose_of(m)


def inverted(pose: Sequence[float] | Array) -> Array:
    return pose_of(np.linalg.inv(matrix(pose)))


def angle_between(a: float, b: float) -> float:
    """The smallest turn from b to a, in [-pi, pi]."""
    return math.remainder(a - b, 2 * math.pi)


def same_pose(a: Array, b: Array, tolerance: float = 1e-9) -> bool:
    return bool(
        np.hypot(a[0] - b[0], a[1] - b[1]) < tolerance
        and abs(angle_between(a[2], b[2])) < tolerance
    )


# paths


def wander(rng: np.random.Generator, count: int, step_m: float = 0.05) -> Array:
    """(count, 3) a path with smooth random curves, from a random start."""
    turn = np.convolve(rng.normal(0, 0.12, count + 20), np.ones(20) / 4.5, "valid")[:count]
    heading = rng.uniform(-np.pi, np.pi) + np.cumsum(turn)
    xy = rng.uniform(-4, 4, 2) + np.cumsum(
        step_m * np.stack([np.cos(heading), np.sin(heading)], axis=-1), axis=0
    )
    return np.column_stack([xy, heading])


def straight(start: Sequence[float], count: int, step_m: float = 0.05) -> Array:
    """(count, 3) along the heading of the start pose."""
    way = step_m * np.arange(count)[:, None]
    x, y, theta = start
    xy = np.array([x, y]) + way * [math.cos(theta), math.sin(theta)]
    return np.column_stack([xy, np.full(count, theta)])


def seen_from_last(path: Array) -> Array:
    """Poses of a path in the frame of its last pose, what `Window` wants."""
    last = inverted(path[-1])
    return np.array([product(last, pose) for pose in path])


def window_of(
    a: Array,
    b: Array,
    bias: float = 0.0,
    a_antenna: Sequence[float] = (0.0, 0.0),
    b_antenna: Sequence[float] = (0.0, 0.0),
    step_s: float = 0.5,
) -> tuple[Window, Array]:
    """The exact window of two true paths (n, 3) in one frame, and the true a_T_b at its end."""
    one = [matrix(p) @ [*a_antenna, 1.0] for p in a]
    other = [matrix(p) @ [*b_antenna, 1.0] for p in b]
    ranges = np.array([np.hypot(*(q - p)[:2]) for p, q in zip(one, other, strict=True)]) + bias
    t = (np.arange(len(a)) - len(a) + 1) * step_s
    window = Window(
        t, ranges, seen_from_last(a), seen_from_last(b), np.array(a_antenna), np.array(b_antenna)
    )
    return window, product(inverted(a[-1]), b[-1])


def curved_window(
    rng: np.random.Generator,
    apart: float = 6.0,
    count: int = 60,
    step_m: float = 0.25,
    bias: float = 0.0,
    a_antenna: Sequence[float] = (0.0, 0.0),
    b_antenna: Sequence[float] = (0.0, 0.0),
    step_s: float = 0.5,
) -> tuple[Window, Array]:
    """The exact window of two robots on random curves, b moved by `apart`, and the true a_T_b."""
    a, b = wander(rng, count, step_m), wander(rng, count, step_m) + [apart, 0, 0]
    return window_of(a, b, bias, a_antenna, b_antenna, step_s)


# items


def keyframes(
    n: Iterable[int], poses: Iterable[Sequence[float] | Array], segment: int = 0
) -> tuple[Keyframe, ...]:
    """Poses as keyframes, rounded to whole steps."""
    return tuple(
        Keyframe(int(k), segment, *(round(float(v) * 1e4) for v in pose))
        for k, pose in zip(n, poses, strict=True)
    )


def closure(
    number: int,
    a_n: int,
    peer: Chain,
    b_n: int,
    a_T_b: Sequence[float] | Array,
    sigma: float = 0.1,
    kept: bool = True,
) -> ClosureMeasurement:
    x, y, theta = (float(v) for v in a_T_b)
    v = sigma**2
    covariance = (v, 0.0, 0.0, v, 0.0, v / 4)
    return ClosureMeasurement(number, kept, a_n, peer, b_n, (x, y, theta), covariance)


def range_item(
    a_n: int,
    peer: Chain,
    b_n: int,
    range_m: float,
    q_a: tuple[float, float] = (0.0, 0.0),
    q_b: tuple[float, float] = (0.0, 0.0),
    sigma: float = 0.1,
) -> RangeMeasurement:
    return RangeMeasurement(a_n, peer, b_n, q_a, q_b, range_m, sigma)


def model_of(
    noise: OdometryNoise, antenna: tuple[float, float] = (0.0, 0.0), height: float = 0.0
) -> RobotModel:
    return RobotModel(noise, *antenna, height)


# a small team with a graph


@dataclass
class SmallTeam:
    """Robots that drove, and the graph of what they said.

    Attributes:
        graph: all items.
        truth: (k, 3) true poses of each robot's keyframes in one frame.
        n: (k,) their numbers on the clock of each robot.
    """

    graph: PoseGraph
    truth: dict[int, Array]
    n: dict[int, Array]
    chains: dict[int, Chain]
    entries: list[tuple[Chain, GraphEntry]]


def small_team(
    seed: int,
    robots: int = 3,
    count: int = 40,
    noise: OdometryNoise = NOISE,
    range_sigma: float = 0.05,
    closure_sigma: float = 0.05,
    biases: dict[tuple[int, int], float] | None = None,
    clock: int = 1000,
    every: int = 10,
) -> SmallTeam:
    """Keyframes once a second, a range of every pair each second, closures now and then.

    Robot r counts its samples from `clock` * r; its odometry starts at zero.
    """
    rng = np.random.default_rng(seed)
    chains = {r: Chain(r, 10 + r) for r in range(robots)}
    truth = {r: wander(rng, count, 0.4) for r in range(robots)}
    n = {r: clock * r + every * np.arange(count) for r in range(robots)}
    graph = PoseGraph()
    entries = []
    for r, chain in chains.items():
        odometry = driven(rng, truth[r], noise)
        entry = GraphEntry(0, model_of(NOISE), keyframes(n[r], odometry))
        entries.append((chain, entry))
    for a in range(robots):
        ranges: list[RangeMeasurement] = []
        closures: list[ClosureMeasurement] = []
        for b in range(a + 1, robots):
            bias = (biases or {}).get((a, b), 0.0)
            for k in range(count):
                apart = truth[b][k, :2] - truth[a][k, :2]
                measured = float(np.hypot(*apart)) + bias + rng.normal(0, range_sigma)
                ranges.append(
                    range_item(int(n[a][k]), chains[b], int(n[b][k]), measured, sigma=0.05)
                )
            for k in range(5, count, 10):
                error = rng.normal(0, closure_sigma, 3) * [1, 1, 0.5]
                true = product(inverted(truth[a][k]), truth[b][k])
                closures.append(
                    closure(
                        len(closures), int(n[a][k]), chains[b], int(n[b][k]), true + error, 0.05
                    )
                )
        entries.append((chains[a], GraphEntry(1, None, (), tuple(ranges), tuple(closures))))
    for chain, entry in entries:
        graph.insert(chain, entry)
    return SmallTeam(graph, truth, n, chains, entries)


def driven(rng: np.random.Generator, truth: Array, noise: OdometryNoise) -> Array:
    """(k, 3) dead reckoning of a true path, one straight step between neighbours."""
    scale = 1 + rng.normal(0, noise.scale)
    bend = rng.normal(0, noise.yaw_rad_per_m)
    poses = [np.zeros(3)]
    for before, after in itertools.pairwise(truth):
        step = product(inverted(before), after)
        length = math.hypot(step[0], step[1])
        turn = bend * length + rng.normal(0, noise.yaw_rad_per_sqrt_m * math.sqrt(length))
        shift = rng.normal(0, noise.translation_per_sqrt_m * math.sqrt(length), 2)
        wrong = product(
            product((0, 0, turn / 2), (*(scale * step[:2] + shift), step[2])), (0, 0, turn / 2)
        )
        poses.append(product(poses[-1], wrong))
    out = np.array(poses)
    out[:, 2] = np.unwrap(out[:, 2])
    return out


BANDED = BandedOptimizer(bias_sigma=0.30, range_sigma=0.10)
"""As the configuration has it by default."""


def group_of(graph: PoseGraph) -> Group:
    """All first segments of a graph, in the frame of the lowest."""
    members = {Segment(*items.chain, 0) for items in graph.chains.values()}
    return Group(members, min(members))
