"""The column "drslamd": the daemon's own robots with the default configuration, in virtual time.

What the robots say at the end is scored at the paper's pose times; what they published on the way
is held against the covariance that they published with it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drslamd.gossip import messages
from drslamd.gossip.message_types import PoseState
from drslamd.slam import se2
from lab.bound import efficiency
from lab.play import virtual_team
from lab.play.simulator import Simulator
from lab.recordings.recording import Array, Recording
from lab.reproduce.experiment import PAIRS, POSE_TIMES, Trial, pose_errors
from lab.reproduce.tally import Tally
from lab.score import metrics, outcome
from lab.score.claims import ELLIPSE_95, mahalanobis
from lab.score.outcome import Closure, Outcome

CLAIM_98, CLAIM_WORST = 14.2, 50.0
"""Squared Mahalanobis errors: 98 % of honest closures stay below one, all below the other (the
first is the 99.7 % quantile with three degrees of freedom)."""


def run(trial: Trial, progress: Callable[[float], None] | None = None) -> Tally:
    """Everything that one seed says of the whole system."""
    simulator = virtual_team.play(trial.recording, trial.seed, progress=progress)
    result = virtual_team.outcome(simulator)
    tally = Tally()
    _final(tally, trial, result)
    closures(tally, trial, result.closures)
    published(tally, trial.recording, simulator)
    efficiency.add(
        tally, efficiency.Team(len(trial.truth), 0.0), trial.recording, simulator, result
    )
    for name, ms in result.ms.items():
        tally.add(f"drslamd/ms/{name}", ms)
    tally.add("drslamd/bytes", sum(result.bytes_sent.values()))
    return tally


def _final(tally: Tally, trial: Trial, result: Outcome) -> None:
    """Final trajectories, pair by pair where both are in one frame."""
    poses = {r: metrics.at_times(p.t, p.poses, POSE_TIMES) for r, p in result.final.items()}
    for a, b in PAIRS:
        together = a in poses and b in poses and result.frames[a] == result.frames[b]
        tally.add("drslamd/localised", np.full(len(POSE_TIMES), float(together)))
        if together:
            found = metrics.relative(poses[a], poses[b])
            tally.poses("drslamd/after", pose_errors(found, trial.true_pairs(a, b)))
    if result.is_one_team:
        scores = outcome.score(trial.recording, result)
        tally.add("drslamd/ate", scores["team"]["ate_rmse_m"])


def closures(tally: Tally, trial: Trial, found: list[Closure]) -> None:
    """Module 1's answers that name one pose: all of them, and those that module 2 kept."""
    for closure in found:
        tally.add(f"drslamd/verdict/{closure.verdict}", 1.0)
        if not len(closure.poses):
            continue
        pair = [trial.recording.trails[r] for r in (closure.a, closure.b)]
        ends = [metrics.at_times(x.t, x.truth, np.array([closure.t])) for x in pair]
        truth = metrics.relative(*ends)
        tally.add("drslamd/keeps", float(closure.kept))
        if closure.verdict == "unique":
            errors = pose_errors(closure.poses[:1], truth)
            tally.poses("drslamd/before", errors)
            if closure.kept:
                tally.poses("drslamd/kept", errors)
            claim(tally, "drslamd/claim", closure.poses[0], closure.covariances[0], truth[0])


def claim(tally: Tally, name: str, pose: Array, covariance: Array, truth: Array) -> None:
    """The squared Mahalanobis error of one closure, and what an honest one would be below."""
    squared = mahalanobis(pose, covariance, truth)
    tally.add(f"{name}/nees", squared / 3)
    tally.add(f"{name}/below", float(squared <= CLAIM_98))
    tally.add(f"{name}/wild", float(squared > CLAIM_WORST))


def published(tally: Tally, recording: Recording, simulator: Simulator) -> None:
    """Every published pose against its own covariance, in the frame that it names.

    That frame is the odometry frame of a robot, and so where that robot was switched on.
    """
    for robot, member in simulator.members.items():
        trail = recording.trails[robot]
        for _, channel, payload in member.traces.sent:
            if messages.kind_of_channel(channel) != "POSE":
                continue
            message = messages.decode("POSE", payload)
            if not isinstance(message, messages.Pose) or message.state != PoseState.LOCALISED:
                continue
            t = np.array([member.clock.world(message.pose_utime) / 1e6])
            origin = recording.trails[message.frame].truth[0]
            truth = metrics.relative(origin, metrics.at_times(trail.t, trail.truth, t)[0])
            pose, covariance = np.array(message.pose), se2.unpacked(message.covariance)
            tally.add("drslamd/published/nees", mahalanobis(pose, covariance, truth) / 3)
            error = pose[:2] - truth[:2]
            inside = error @ np.linalg.solve(covariance[:2, :2], error) <= ELLIPSE_95
            tally.add("drslamd/published/inside", float(inside))
            tally.poses("drslamd/published", pose_errors(pose[None], truth[None]))
