"""One run: a team is played in virtual time, and each second everybody is asked what it claims.

A robot's own pose is held against the truth in the frame that it names, which is where the robot of
that frame stood when it began, or began again; the pose of one robot in another against the truth
of both, at the keyframes that it is of, each on its own robot's clock.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from drslamd import report
from drslamd.conventions import Chain, grid_utime
from lab.play import virtual_team
from lab.play.playback import Hardware
from lab.play.simulator import Simulator
from lab.play.virtual_team import SETTLE_S
from lab.recordings.recording import Array, Recording
from lab.score import metrics, outcome, relative_errors
from lab.score.claims import Claim, claim
from lab.score.outcome import Outcome
from lab.trust.naming import Said

LOCALISED, DOUBTFUL = "localised", "doubtful"
"""Words for a pose that is given: as one to rely on, or as one to take care with."""


@dataclass(frozen=True)
class Stated:
    """A claim, when it was made and how it was called.

    Attributes:
        robots: whose pose it is: of one robot in the team's frame, or of the second in the first.
        of_frame: is it the pose of the robot whose frame it is in?
        called: LOCALISED or DOUBTFUL; of two robots the worse.
    """

    t: float
    robots: tuple[int, ...]
    called: str
    claim: Claim
    of_frame: bool = False


@dataclass
class Run:
    """What is left of a run.

    Attributes:
        states: seconds of robots in each state.
        poses, pairs: what was claimed of them, second by second.
        closures: of windows that named one pose.
        said: every sentence of every second.
        localised_s: when the first robot had a pose.
        connected: are all robots in one frame when the recording ends?
        ate_m: of all robots (None) and of all but one, infinite where they are not in one frame.
        bias_m: the largest range bias that was believed at any time, whatever its sign.
        at_fault: robots that are not as configured.
        evident_s: from when that could be known; infinite where it cannot.
    """

    states: Counter[str] = field(default_factory=Counter)
    poses: list[Stated] = field(default_factory=list)
    pairs: list[Stated] = field(default_factory=list)
    closures: list[Claim] = field(default_factory=list)
    said: list[Said] = field(default_factory=list)
    localised_s: float = float("inf")
    connected: bool = False
    ate_m: dict[int | None, float] = field(default_factory=dict)
    bias_m: float = 0.0
    at_fault: frozenset[int] = frozenset()
    evident_s: float = 0.0


def watch(
    recording: Recording,
    seed: int,
    hardware: dict[int, Hardware] | None = None,
    progress: Callable[[float], None] | None = None,
    extra: str = "",
) -> Run:
    """Play a recording and hold against the truth whatever is claimed.

    Args:
        extra: TOML sections that every robot's configuration gets.
    """
    simulator = virtual_team.start(recording, seed, extra=extra, hardware=hardware)
    run = Run()
    for second in range(1, int(recording.duration) + 1):
        simulator.run(second)
        look(run, recording, simulator)
        if progress:
            progress(second)
    run.connected = _is_connected(simulator)
    simulator.run(recording.duration + SETTLE_S)
    result = virtual_team.outcome(simulator)
    unique = [c for c in result.closures if c.verdict == "unique"]
    for closure in unique:
        truth = relative_errors.true_relative(
            recording, closure.a, closure.b, np.array([closure.t])
        )[0]
        run.closures.append(claim(closure.poses[0], closure.covariances[0], truth))
    robots = frozenset(recording.trails)
    run.ate_m = {None: _ate(recording, result, robots)}
    run.ate_m |= {robot: _ate(recording, result, robots - {robot}) for robot in robots}
    return run


def _is_connected(simulator: Simulator) -> bool:
    """Has everybody a solution, in one frame?"""
    estimates = [member.robot.back.estimate for member in simulator.members.values()]
    frames = {estimate.frame.chain if estimate else None for estimate in estimates}
    return len(frames) == 1 and None not in frames


def look(run: Run, recording: Recording, simulator: Simulator) -> None:
    """Ask every robot that is awake now."""
    t = simulator.now / 1e6
    called: dict[int, str] = {}
    for robot, member in simulator.members.items():
        if not member.running or simulator.now < member.asleep_until:
            continue
        status = report.status(member.robot, member.clock.local(simulator.now))
        called[robot] = status["pose"]["state"]
        run.states[called[robot]] += 1
        run.said += [Said(t, robot, sentence) for sentence in status["problems"]]
        estimate = member.robot.back.estimate
        if estimate is not None:
            learned = [abs(bias.value) for bias in estimate.bias_m.values()]
            run.bias_m = max([run.bias_m, *learned])
        if called[robot] in (LOCALISED, DOUBTFUL):
            run.localised_s = min(run.localised_s, t)
            _add_pose(run, recording, simulator, robot, called[robot])
    for pair in combinations(sorted(called), 2):
        states = {called[robot] for robot in pair}
        if states <= {LOCALISED, DOUBTFUL}:
            _add_pair(run, recording, simulator, pair, min(states))


def _add_pose(
    run: Run, recording: Recording, simulator: Simulator, robot: int, called: str
) -> None:
    """A robot's own pose as it is published; not in a frame that began after a hole in odometry, as
    nobody knows where that really is."""
    member = simulator.members[robot]
    where = member.robot.whereabouts(member.clock.local(simulator.now))
    estimate, found = member.robot.back.estimate, where.pose
    if estimate is None or found is None or estimate.frame.segment:
        return
    origin = _origin(recording, simulator, estimate.frame.chain)
    if origin is None:
        return
    t = member.clock.world(found.utime) / 1e6
    truth = metrics.relative(origin, _true(recording, robot, t))
    stated = claim(found.pose, found.covariance, truth)
    of_frame = estimate.frame.robot == robot
    run.poses.append(Stated(t, (robot,), called, stated, of_frame))


def _origin(recording: Recording, simulator: Simulator, chain: Chain) -> Array | None:
    """Where the odometry of this start of a robot truly began: its first keyframe, less the way to
    there; None when it has begun again since."""
    member = simulator.members[chain.robot]
    if member.robot.own != chain:
        return None
    keyframes = member.robot.back.graph.chains[chain.robot].keyframes
    t = member.clock.world(grid_utime(int(keyframes.n[0]))) / 1e6
    way_back = metrics.relative(keyframes.poses[0], np.zeros(3))
    return np.asarray(metrics.compose(_true(recording, chain.robot, t), way_back))


def _add_pair(
    run: Run, recording: Recording, simulator: Simulator, pair: tuple[int, int], called: str
) -> None:
    """The pose of one robot in the other, as each of them has it."""
    for asked in pair:
        estimate = simulator.members[asked].robot.back.estimate
        found = estimate.relative(*pair) if estimate else None
        if estimate is None or found is None:
            continue
        true = []
        for robot in pair:
            n = int(estimate.trajectories[robot].n[-1])
            t = simulator.members[robot].clock.world(grid_utime(n)) / 1e6
            true.append(_true(recording, robot, t))
        stated = claim(*found, metrics.relative(true[0], true[1]))
        run.pairs.append(Stated(simulator.now / 1e6, pair, called, stated))


def _true(recording: Recording, robot: int, t: float) -> Array:
    """(3,) true pose of a robot at time t, s."""
    trail = recording.trails[robot]
    return np.asarray(metrics.at_times(trail.t, trail.truth, np.array([t]))[0])


def _ate(recording: Recording, result: Outcome, robots: frozenset[int]) -> float:
    """Joint ATE of the final trajectories of some robots, m; infinite unless they share a frame."""
    final = {robot: path for robot, path in result.final.items() if robot in robots}
    frames = {int(path.frame[0]) for path in final.values()}
    if final.keys() != robots or len(frames) != 1:
        return float("inf")
    trails = {robot: recording.trails[robot] for robot in robots}
    scores = outcome.score(replace(recording, trails=trails), Outcome(final=final))
    return float(scores["team"]["ate_rmse_m"])
