"""Modules 2 and 3 on relative poses that others estimated: consistency, then the paper's DPGO.

Each pair's edges go through pairwise consistency maximisation in the order of time; what it keeps
is the graph of a team whose robots optimise their own blocks in turns (`[optimizer]` with
`algorithm = "rbcd"`), with perfect radio, until nothing moves. (Or every robot solves all of it:
`algorithm = "closures"`.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drslamd.config import Config, parse
from drslamd.conventions import GRID_HZ, ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.slam import se2, settings
from drslamd.slam.back_end import BackEnd
from drslamd.slam.consistency.pcm import Candidate, PairConsistency
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry, Keyframe
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.odometry.noise import OdometryNoise, growth
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.robot_model import RobotModel
from drslamd.slam.tuning import DEFAULTS, Tuning
from lab.play.turns import EPOCH, Turns
from lab.recordings.recording import Array, EdgeRecording, Trail
from lab.score import metrics
from lab.score.outcome import Closure, Outcome, Path

EARLIER = 1_000
"""Grid samples added to all times, so that none is negative."""
MOST_ROUNDS = 600


@dataclass(frozen=True)
class Chains:
    """Keyframes of one robot: samples n (k,) of the 10 Hz grid, poses (k, 3) and their sums."""

    n: NDArray[np.int64]
    poses: Array
    sums: Array


def run(
    recording: EdgeRecording,
    extra: str = "",
    progress: Callable[[float], None] | None = None,
    optimizer: str = "rbcd",
    tuning: Tuning = DEFAULTS,
) -> tuple[Outcome, NDArray[np.bool_]]:
    """What the team makes of the edges, and which of them it kept (k,).

    Args:
        extra: TOML sections for every robot.
        progress: told how many rounds are done.
        optimizer: `optimizer.algorithm` of every robot.
        tuning: of its estimator.
    """
    configs = {robot: _config(robot, optimizer, extra) for robot in recording.trails}
    noise = settings.odometry_noise(next(iter(configs.values())).odometry)
    chains = {robot: _chain(recording, trail) for robot, trail in recording.trails.items()}
    kept = consistent(recording, chains, noise, configs[min(configs)].consistency.epsilon)
    backs = {
        robot: BackEnd(config, Chain(robot, EPOCH), tuning) for robot, config in configs.items()
    }
    for robot, entries in _logs(recording, chains, kept, noise).items():
        for entry in entries:
            for back in backs.values():
                back.insert(Chain(robot, EPOCH), entry)
    _optimise(backs, progress)
    return _outcome(backs, recording, kept), kept


def _config(robot: int, optimizer: str, extra: str) -> Config:
    return parse(
        f'[robot]\nid = {robot}\n[team]\ninsecure = true\n[uwb]\nport = "/dev/uwb"\n'
        '[wheels]\nsource = "kobuki"\nport = "/dev/wheels"\n'
        f'[optimizer]\nalgorithm = "{optimizer}"\n{extra}'
    )


def _chain(recording: EdgeRecording, trail: Trail) -> Chains:
    """A keyframe a second and one for every edge, in whole steps as they would be sent."""
    edges = recording.edges
    own = edges[(edges[:, 1] == trail.robot) | (edges[:, 2] == trail.robot), 0]
    grid = np.arange(np.ceil(trail.t[0] * GRID_HZ), np.floor(trail.t[-1] * GRID_HZ) + 1, GRID_HZ)
    n = np.unique(np.concatenate([grid, np.round(own * GRID_HZ)])).astype(np.int64)
    poses = metrics.at_times(trail.t, trail.odometry, n / GRID_HZ)
    steps = np.array([TRANSLATION_STEP_M, TRANSLATION_STEP_M, ROTATION_STEP_RAD])
    poses = np.round(poses / steps) * steps
    return Chains(n, poses, growth(poses))


def consistent(
    recording: EdgeRecording, chains: dict[int, Chains], noise: OdometryNoise, epsilon: float
) -> NDArray[np.bool_]:
    """Which edges (k,) are in the largest consistent set of their pair."""
    kept = np.zeros(len(recording.edges), dtype=bool)
    covariance = _covariance(recording)
    for a, b in np.unique(recording.edges[:, 1:3], axis=0).astype(int).tolist():
        pair = PairConsistency(noise, noise, epsilon)
        rows = np.flatnonzero((recording.edges[:, 1] == a) & (recording.edges[:, 2] == b))
        for row in rows.tolist():
            n = round(recording.edges[row, 0] * GRID_HZ)
            i, j = (
                np.searchsorted(chains[a].n, n),
                np.searchsorted(chains[b].n, n),
            )
            pair.add(
                Candidate(
                    row,
                    recording.edges[row, 3:],
                    covariance,
                    chains[a].poses[i],
                    chains[b].poses[j],
                    chains[a].sums[i],
                    chains[b].sums[j],
                )
            )
        kept[pair.kept()] = True
    return kept


def _covariance(recording: EdgeRecording) -> Array:
    metres, radians = recording.sigmas
    return np.diag([metres**2, metres**2, radians**2])


def _logs(
    recording: EdgeRecording,
    chains: dict[int, Chains],
    kept: NDArray[np.bool_],
    noise: OdometryNoise,
) -> dict[int, list[GraphEntry]]:
    """What each robot would have told the others."""
    covariance = se2.packed(_covariance(recording))
    logs = {}
    for robot, chain in chains.items():
        scaled = np.round(
            chain.poses / [TRANSLATION_STEP_M, TRANSLATION_STEP_M, ROTATION_STEP_RAD]
        ).astype(int)
        keyframes = [
            Keyframe(int(n) + EARLIER, 0, *step)
            for n, step in zip(chain.n, scaled.tolist(), strict=True)
        ]
        closures = []
        for row in np.flatnonzero(kept & (recording.edges[:, 1] == robot)).tolist():
            t, _, b, x, y, yaw = recording.edges[row].tolist()
            n = round(t * GRID_HZ) + EARLIER
            peer = Chain(int(b), EPOCH)
            closures.append(ClosureMeasurement(row, True, n, peer, n, (x, y, yaw), covariance))
        logs[robot] = [GraphEntry(0, RobotModel(noise), tuple(keyframes), (), tuple(closures))]
    return logs


class _Member:
    """A robot that knows the whole log and hears everybody."""

    def __init__(self, back: BackEnd, robots: set[int]) -> None:
        self.back, self.exchange, self._robots = back, back.exchange, robots

    def begin(self, utime: int) -> Job | None:
        return self.back.begin(self._robots, self._robots, utime)

    def on_solution(self, result: TeamEstimate, utime: int) -> list[PublicPoses]:
        return self.back.on_solution(result, utime)

    def hear(self, origin: Chain, message: PublicPoses) -> None:
        self.back.hear(origin, message)


def _optimise(backs: dict[int, BackEnd], progress: Callable[[float], None] | None) -> None:
    """Rounds of block descent until nobody moves."""
    members = {robot: _Member(back, set(backs)) for robot, back in backs.items()}
    turns = Turns(members)
    for number in range(MOST_ROUNDS):
        goes_on = turns.round()
        if progress:
            progress(number)
        if not goes_on:
            break


def _outcome(
    backs: dict[int, BackEnd], recording: EdgeRecording, kept: NDArray[np.bool_]
) -> Outcome:
    out = Outcome()
    covariance = _covariance(recording)[None]
    for (t, a, b, *pose), inlier in zip(recording.edges.tolist(), kept.tolist(), strict=True):
        out.closures.append(
            Closure(t, int(a), int(b), "unique", np.array([pose]), covariance, inlier)
        )
    for robot, back in backs.items():
        solved, estimate = back.trajectory(robot), back.estimate
        out.frames[robot] = estimate.frame.robot if estimate else None
        if solved is not None and estimate is not None:
            t = (solved.n - EARLIER) / GRID_HZ
            out.final[robot] = Path(t, solved.poses, np.full(len(t), estimate.frame.robot))
    return out
