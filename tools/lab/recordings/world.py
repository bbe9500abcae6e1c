"""A simulated team: robots that drive like driven by hand, and sensors as wrong as real ones.

The noise of ranges and odometry is the mixture that recordings of LinkTrack modules and of wheeled
robots show: a constant bias per pair, a slow first-order bias, white noise and positive bursts;
a constant scale error and yaw rate per robot, random yaw and random translation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lab.recordings.recording import Array, Recording, Trail

STEP_S = 0.02
"""The world moves at the 50 Hz of the UWB modules."""


@dataclass(frozen=True)
class RangeModel:
    """Sigmas in metres, times in seconds (medians over recorded LinkTrack data)."""

    bias: float = 0.10
    slow: float = 0.06
    slow_s: float = 2.5
    white: float = 0.02
    burst_share: float = 0.01
    burst_s: float = 0.3
    burst_least: float = 0.3
    burst_mean: float = 0.3
    lost: float = 0.003


@dataclass(frozen=True)
class OdometryModel:
    scale: float = 0.03
    yaw_deg_per_m: float = 0.15
    yaw_deg_per_sqrt_m: float = 0.5
    translation_per_sqrt_m: float = 0.01


@dataclass(frozen=True)
class GyroModel:
    """Random yaw and one sigma of a constant rate."""

    deg_per_sqrt_s: float = 0.01
    deg_per_h: float = 10.0


def with_gyros(recording: Recording, seed: int, model: GyroModel = GyroModel()) -> Recording:
    """The same drive and the same wheels, with a gyro in every base."""
    trails = {}
    for robot, trail in recording.trails.items():
        rng = np.random.default_rng([seed, robot, 4])
        step = np.diff(trail.t, prepend=trail.t[0])
        noise = rng.normal(size=len(step)) * np.sqrt(step) * model.deg_per_sqrt_s
        rate = rng.normal(0, model.deg_per_h) / 3600
        said = np.unwrap(trail.truth[:, 2]) + np.radians(np.cumsum(noise + rate * step))
        trails[robot] = replace(trail, gyro=said - said[0])
    return replace(recording, trails=trails)


@dataclass(frozen=True)
class Scene:
    """What is simulated."""

    robots: int = 3
    seconds: float = 75.0
    speed: float = 0.5
    width: float = 10.0
    height: float = 12.0
    ranges: RangeModel = RangeModel()
    odometry: OdometryModel = OdometryModel()
    range_hz: int = 50
    odometry_hz: int = 50
    both_measure: bool = True
    """Both modules of a pair print the range, as LinkTrack's DR_MODE0 does."""


def simulate(scene: Scene, seed: int) -> Recording:
    """One recording of a scene; the same seed gives the same recording."""
    rng = np.random.default_rng(seed)
    truths = [drive(rng, scene) for _ in range(scene.robots)]
    name = f"simulated {scene.robots} robots, {scene.seconds:.0f} s, seed {seed}"
    return recorded(name, rng, scene, truths)


def recorded(name: str, rng: np.random.Generator, scene: Scene, truths: list[Array]) -> Recording:
    """What sensors say of true trajectories (n, 3), one sample per STEP_S."""
    t = np.arange(len(truths[0])) * STEP_S
    every = round(1 / STEP_S / scene.odometry_hz)
    trails = {
        robot: Trail(robot, t[::every], wrong(rng, truth, scene.odometry)[::every], truth[::every])
        for robot, truth in enumerate(truths)
    }
    rows = [np.zeros((0, 4))]
    rows += [
        row
        for a in range(scene.robots)
        for b in range(a + 1, scene.robots)
        for row in _pair_ranges(rng, scene, t, truths, a, b)
    ]
    table = np.concatenate(rows)
    return Recording(name, trails, table[np.lexsort((table[:, 2], table[:, 1], table[:, 0]))])


def drive(rng: np.random.Generator, scene: Scene, start: Array | None = None) -> Array:
    """(n, 3) true poses: towards random goals, with turns, curves, straight lines and stops.

    Args:
        start: (3,) pose to start from, by default anywhere.
    """
    count = round(scene.seconds / STEP_S)
    margin = np.array([1.0, 1.0])
    room = np.array([scene.width, scene.height])
    pose = np.array([*rng.uniform(margin, room - margin), rng.uniform(-np.pi, np.pi)])
    pose = pose if start is None else start
    goal = rng.uniform(margin, room - margin)
    speed = turn = 0.0
    stop_at, stop_for = rng.uniform(12, 30), 0.0
    poses = np.empty((count, 3))
    for k in range(count):
        poses[k] = pose
        if np.hypot(*(goal - pose[:2])) < 0.6:
            goal = rng.uniform(margin, room - margin)
        away = np.arctan2(*(goal - pose[:2])[::-1]) - pose[2]
        away = (away + np.pi) % (2 * np.pi) - np.pi
        wanted = scene.speed * max(0.15, np.cos(away)) if abs(away) < 1.2 else 0.1 * scene.speed
        wanted_turn = np.clip(1.5 * away, -0.9, 0.9)
        now = k * STEP_S
        if stop_at < now:
            if not stop_for:
                stop_for = rng.uniform(1, 3)
            wanted, wanted_turn = 0.0, 0.0
            if now > stop_at + stop_for:
                stop_at, stop_for = now + rng.uniform(12, 30), 0.0
        speed += np.clip(wanted - speed, -0.02, 0.02)
        turn += np.clip(wanted_turn - turn, -0.06, 0.06)
        middle = pose[2] + turn * STEP_S / 2
        pose = pose + STEP_S * np.array([speed * np.cos(middle), speed * np.sin(middle), turn])
    return poses


def wrong(rng: np.random.Generator, truth: Array, model: OdometryModel) -> Array:
    """(n, 3) what the wheels say of a true trajectory, starting at zero."""
    step = np.diff(truth, axis=0)
    middle = (truth[1:, 2] + truth[:-1, 2]) / 2
    forward = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
    path = np.abs(forward)
    scale = 1 + rng.normal(0, model.scale)
    bend = np.radians(rng.normal(0, model.yaw_deg_per_m))
    noise = rng.normal(size=(2, len(path))) * np.sqrt(path)
    forward = forward * scale + noise[0] * model.translation_per_sqrt_m
    turn = step[:, 2] + bend * path + noise[1] * np.radians(model.yaw_deg_per_sqrt_m)
    out = np.zeros_like(truth)
    out[1:, 2] = np.cumsum(turn)
    heading = out[:-1, 2] + turn / 2
    out[1:, 0] = np.cumsum(forward * np.cos(heading))
    out[1:, 1] = np.cumsum(forward * np.sin(heading))
    return out


def range_errors(rng: np.random.Generator, model: RangeModel, count: int, step_s: float) -> Array:
    """(count,) slow part and bursts of one pair, without its bias and white noise."""
    keep = np.exp(-step_s / model.slow_s)
    kicks = rng.normal(size=count) * model.slow
    slow = np.empty(count)
    value = kicks[0] if count else 0.0
    for k in range(count):
        slow[k] = value
        value = keep * value + np.sqrt(1 - keep**2) * kicks[k]
    share = model.burst_share
    starts = rng.random(count) < step_s * share / (model.burst_s * (1 - share))
    until, size = -1.0, 0.0
    for k in range(count):
        if starts[k] and k * step_s > until:
            until = k * step_s + rng.exponential(model.burst_s)
            size = min(model.burst_least + rng.exponential(model.burst_mean), 6.0)
        if k * step_s <= until:
            slow[k] += size
    return slow


def _pair_ranges(
    rng: np.random.Generator, scene: Scene, t: Array, truths: list[Array], a: int, b: int
) -> list[Array]:
    """Rows (time, observer, peer, range) of one pair, from one or both modules."""
    model = scene.ranges
    distance = np.hypot(*(truths[a][:, :2] - truths[b][:, :2]).T)
    shared = distance + rng.normal(0, model.bias) + range_errors(rng, model, len(t), STEP_S)
    every = round(1 / STEP_S / scene.range_hz)
    rows = []
    for observer, peer in ((a, b), (b, a))[: 2 if scene.both_measure else 1]:
        measured = shared + rng.normal(0, model.white, len(t))
        heard = rng.random(len(t)) >= model.lost
        heard[np.arange(len(t)) % every != 0] = False
        count = int(heard.sum())
        rows.append(
            np.column_stack(
                [t[heard], np.full(count, observer), np.full(count, peer), measured[heard]]
            )
        )
    return rows
