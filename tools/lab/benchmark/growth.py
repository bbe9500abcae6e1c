"""What a robot computes as the hours pass, and as the team grows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from drslamd.config import Config, parse
from drslamd.conventions import ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.slam import se2
from drslamd.slam.back_end import BackEnd
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from lab.benchmark import timing
from lab.benchmark.rows import Row
from lab.play import virtual_team
from lab.recordings import world
from lab.recordings.recording import Array, Recording

HOURS = {"10 min": 600, "1 h": 3600, "8 h": 28_800}
ROBOTS = 3
SPEED_MPS = 0.3
ROOM_M = 10.0
GOAL_RATIO = 1.5
SOLVE_EVERY_S = 20
"""Between two solves on the way; at a mark one follows each second, as on a robot."""
AT_A_MARK = 9
TEAMS = (3, 5, 10, 20, 50)
SQUARE_M = 6.0
"""Side of the square that each robot of a team has to itself: the area grows with the team."""
RANGE_M = 12.0
"""How far its radio reaches, so that each has a handful of neighbours."""
TEAM_S = 60.0
MOST_OF_A_CORE = 0.5


# ---- hours -------------------------------------------------------------------------------------


def by_hours(quick: bool) -> Iterator[Row]:
    """Time of one update of module 3 after so long a drive of three robots."""
    marks = {name: s for name, s in HOURS.items() if not quick or s <= HOURS["1 h"]}
    first = 0.0
    for name, (ms, held) in _driven(marks).items():
        first = first or ms
        work = f"one more second after {name} of driving, {held} keyframes held"
        yield Row(3, work, ms, "ms", curve=("hours of driving", marks[name] / 3600))
    work = f"the same, {list(marks)[-1]} over {next(iter(marks))}"
    yield Row(3, work, ms / first, "ratio", GOAL_RATIO)


def _driven(marks: dict[str, int]) -> dict[str, tuple[float, int]]:
    """Median ms of an update at each mark, and how many keyframes the graph then held."""
    rng = np.random.default_rng(8)
    longest = max(marks.values()) + AT_A_MARK
    truth = [_wander(rng, longest) for _ in range(ROBOTS)]
    odometry = [_drifted(rng, path) for path in truth]
    chains = [Chain(robot, 1) for robot in range(ROBOTS)]
    back = BackEnd(_config(0), chains[0])
    at_marks: dict[str, list[float]] = {name: [] for name in marks}
    held = dict.fromkeys(marks, 0)
    for second in range(longest):
        for chain in chains:
            back.insert(chain, _entry(rng, second, chain, chains, truth, odometry))
        reached = [name for name, mark in marks.items() if 0 <= second - mark < AT_A_MARK]
        if second % SOLVE_EVERY_S and not reached:
            continue
        taken = _update(back)
        for name in reached:
            at_marks[name].append(taken)
            held[name] = sum(len(items.keyframes.rows) for items in back.graph.chains.values())
    return {name: (float(np.median(ms)), held[name]) for name, ms in at_marks.items()}


def _update(back: BackEnd) -> float:
    """ms of CPU for all that a robot does each second with the graph that it holds."""
    started = timing.now_ms()
    back.digest()
    job = back.begin(set(range(ROBOTS)), {})
    if job is not None:
        back.on_solution(job())
    return timing.now_ms() - started


def _entry(
    rng: np.random.Generator,
    second: int,
    chain: Chain,
    chains: list[Chain],
    truth: list[Array],
    odometry: list[Array],
) -> GraphEntry:
    """What one robot adds in one second: a keyframe, ranges, now and then a closure."""
    robot, n = chain.robot, 10 * second
    x, y, theta = odometry[robot][second]
    x, y = round(x / TRANSLATION_STEP_M), round(y / TRANSLATION_STEP_M)
    frame = Keyframe(n, 0, x, y, round(theta / ROTATION_STEP_RAD))
    ranges, closures = [], []
    for peer in chains[robot + 1 :]:
        here, there = truth[robot][second], truth[peer.robot][second]
        distance = float(np.hypot(*(here - there)[:2])) + rng.normal(0, 0.07)
        ranges.append(RangeMeasurement(n, peer, n, (0.0, 0.0), (0.0, 0.0), distance, 0.1))
        if second % 10 == 0:
            x, y, theta = (se2.between(here, there) + rng.normal(0, 0.1, 3)).tolist()
            number = len(chains) * second + peer.robot
            covariance = (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)
            closures.append(ClosureMeasurement(number, True, n, peer, n, (x, y, theta), covariance))
    return GraphEntry(second, None, (frame,), tuple(ranges), tuple(closures))


def _wander(rng: np.random.Generator, seconds: int) -> Array:
    """(seconds, 3) about a room, turned back by its walls."""
    poses = np.empty((seconds, 3))
    pose = np.array([*rng.uniform(2, ROOM_M - 2, 2), rng.uniform(-np.pi, np.pi)])
    for k in range(seconds):
        poses[k] = pose
        home = np.arctan2(*(ROOM_M / 2 - pose[1::-1])) - pose[2]
        inside = np.abs(pose[:2] - ROOM_M / 2).max() < ROOM_M / 2 - 1.5
        turn = rng.normal(0, 0.3) if inside else 0.6 * np.sin(home)
        step = SPEED_MPS * np.array([np.cos(pose[2]), np.sin(pose[2])])
        pose = pose + np.array([*step, turn])
    return poses


def _drifted(rng: np.random.Generator, truth: Array) -> Array:
    """What the wheels say of a path with a keyframe a second, from zero."""
    step = se2.between(truth[:-1], truth[1:])
    step[:, 2] = se2.wrap(step[:, 2])
    step[:, :2] *= 1 + rng.normal(0, 0.03)
    step += rng.normal(size=step.shape) * np.sqrt(SPEED_MPS) * [0.01, 0.01, np.radians(0.5)]
    out = np.zeros_like(truth)
    for k in range(len(step)):
        out[k + 1] = se2.compose(out[k], step[k])
    return out


def _config(robot: int) -> Config:
    return parse(
        f'[robot]\nid = {robot}\n[team]\ninsecure = true\n[uwb]\nport = "uwb"\n'
        '[wheels]\nsource = "kobuki"\nport = "wheels"\n'
    )


# ---- team size ---------------------------------------------------------------------------------


def by_team_size(quick: bool) -> Iterator[Row]:
    """CPU and bytes of one robot, all sensors and messages included, in virtual time."""
    for robots in TEAMS[:2] if quick else TEAMS:
        recording = crowd(robots)
        neighbours = _neighbours(recording)
        started = timing.now_ms()
        simulator = virtual_team.play(recording, solve_us=None)
        share = (timing.now_ms() - started) / 1e3 / TEAM_S / robots
        sent = sum(
            8 + len(channel) + 1 + len(payload)
            for member in simulator.members.values()
            for _, channel, payload in member.traces.sent
        )
        of = f"one of {robots} robots with {neighbours:.1f} neighbours each"
        work, curve = f"{of}, share of a core", ("robots", robots)
        yield Row(0, work, share, "ratio", MOST_OF_A_CORE, curve=curve)
        work, curve = f"{of}, sent in a minute", ("robots in the team", robots)
        yield Row(0, work, sent / 1e6 / robots, "MB", curve=curve)


def crowd(robots: int) -> Recording:
    """A team on an area that grows with it, whose radios do not."""
    side = SQUARE_M * float(np.sqrt(robots))
    scene = world.Scene(
        robots=robots,
        seconds=TEAM_S,
        speed=SPEED_MPS,
        width=side,
        height=side,
        odometry_hz=10,
        range_hz=10,
    )
    recording = world.simulate(scene, 3)
    return replace(recording, ranges=recording.ranges[recording.ranges[:, 3] < RANGE_M])


def _neighbours(recording: Recording) -> float:
    pairs = np.unique(recording.ranges[:, 1:3], axis=0)
    return len(pairs) / len(recording.trails)


def rows(quick: bool) -> Iterator[Row]:
    """Both kinds of growth."""
    yield from by_hours(quick)
    yield from by_team_size(quick)
