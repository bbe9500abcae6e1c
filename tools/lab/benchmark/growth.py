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
from lab.benchmark.large_teams.met_team import MetTeam, begun
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
RENEWED_S = 64
"""Over so many seconds time steps four times."""
GOAL_ENTRY_MS, GOAL_VIEW_MS = 0.1, 5.0
TEAMS = (3, 5, 10, 20, 50)
SQUARE_M = 6.0
"""Side of the square that each robot of a team has to itself: the area grows with the team."""
RANGE_M = 12.0
"""How far its radio reaches, so that each has a handful of neighbours."""
TEAM_S = 60.0
MOST_OF_A_CORE = 0.5
CROWDS = (100, 200)
CROWD_RANGE_M = 20.4
"""Of its radios: on six times six metres each robot has 28 in reach, those at the walls fewer."""
MINUTE_S, SECONDS = 60, 4
GOAL_MB = 2000.0
"""Of a process that holds and solves a crowd of two hundred."""


# hours


def by_hours(quick: bool) -> Iterator[Row]:
    """Time of one update of module 3 after so long a drive of three robots."""
    marks = {name: s for name, s in HOURS.items() if not quick or s <= HOURS["1 h"]}
    first, longest = 0.0, list(marks)[-1]
    drive = _Drive(max(marks.values()) + len(marks) * AT_A_MARK + RENEWED_S)
    for name, mark in marks.items():
        ms, held = drive.at(mark)
        first = first or ms
        work = f"one more second after {name} of driving, {held} keyframes held"
        yield Row(3, work, ms, "ms", curve=("hours of driving", mark / 3600))
    yield Row(3, f"the same, {longest} over {next(iter(marks))}", ms / first, "ratio", GOAL_RATIO)
    entry, view = drive.renewed()
    yield Row(3, f"one more log entry after {longest}", entry, "ms", GOAL_ENTRY_MS)
    yield Row(3, f"the graph renewed after {longest}, mean", view, "ms", GOAL_VIEW_MS)


class _Drive:
    """Three robots, and the graph of one of them, second by second."""

    def __init__(self, seconds: int) -> None:
        self._rng = np.random.default_rng(8)
        self._truth = [_wander(self._rng, seconds) for _ in range(ROBOTS)]
        self._odometry = [_drifted(self._rng, path) for path in self._truth]
        self._chains = [Chain(robot, 1) for robot in range(ROBOTS)]
        self._back = BackEnd(_config(0), self._chains[0])
        self._second = 0

    def at(self, mark: int) -> tuple[float, int]:
        """Drive on until a mark: median ms of an update there, and how many keyframes are held."""
        while self._second < mark:
            self._insert()
            if self._second % SOLVE_EVERY_S == 0:
                _update(self._back)
        taken = []
        for _ in range(AT_A_MARK):
            self._insert()
            taken.append(_update(self._back))
        held = sum(len(chain.keyframes) for chain in self._back.graph.view.chains.values())
        return float(np.median(taken)), held

    def renewed(self) -> tuple[float, float]:
        """Mean ms for one more entry, and for the graph that follows, over some steps of time."""
        entries = views = 0.0
        for _ in range(RENEWED_S):
            entries += self._insert()
            started = timing.now_ms()
            self._back.graph.digest(set(range(ROBOTS)))
            views += timing.now_ms() - started
        return entries / RENEWED_S / ROBOTS, views / RENEWED_S

    def _insert(self) -> float:
        """One more second of all robots; ms of CPU that it took."""
        said = [
            (c, _entry(self._rng, self._second, c, self._chains, self._truth, self._odometry))
            for c in self._chains
        ]
        started = timing.now_ms()
        for chain, entry in said:
            self._back.insert(chain, entry)
        self._second += 1
        return timing.now_ms() - started


def _update(back: BackEnd) -> float:
    """ms of CPU for all that a robot does each second with the graph that it holds."""
    started = timing.now_ms()
    job = begun(back, set(range(ROBOTS)))
    back.said_digest()
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


# team size


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


# crowds


def by_crowd(quick: bool) -> Iterator[Row]:
    """What a team costs that is too large for all its pairs: CPU of module 3, memory of all."""
    for robots in () if quick else CROWDS:
        team = MetTeam(robots, MINUTE_S, SECONDS, range_m=CROWD_RANGE_M)
        team.know_the_truth()
        taken, left_out = [], 0
        for _ in range(SECONDS):
            started = timing.now_ms()
            job = begun(team.back, team.living)
            found = job()
            taken.append(timing.now_ms() - started)
            left_out = found.left_out
            team.back.on_solution(found)
            team.drive()
        of = f"{robots} robots with 28 in reach, {left_out} pairs left out"
        yield Row(3, f"first solution of {of}", taken[0], "ms")
        yield Row(3, f"the next ones of {of}, mean", float(np.mean(taken[1:])), "ms")
        yield Row(3, f"memory of the process with {of}", timing.peak_mb(), "MB", GOAL_MB)


def rows(quick: bool) -> Iterator[Row]:
    """All kinds of growth; crowds first, since memory is that of the process so far."""
    yield from by_crowd(quick)
    yield from by_hours(quick)
    yield from by_team_size(quick)
