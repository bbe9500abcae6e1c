"""What a team made of its own recordings, held against the truth where there is one."""

from __future__ import annotations

from typing import Any

import numpy as np

from drslamd.conventions import GRID_US
from lab.play.simulator import Simulator
from lab.recordings.recording import Array, BadRecording, Recording, Trail
from lab.replay.team import Team
from lab.score import metrics


def as_recording(name: str, team: Team, played: Simulator, truth: dict[int, Array]) -> Recording:
    """The team's odometry beside the truth, for the scores.

    Raises:
        BadRecording: the truth is of another time, or of other robots.
    """
    wall_us = _wall_at_0(team)
    trails = {}
    for robot, member in sorted(played.members.items()):
        if robot not in truth:
            raise BadRecording(
                f"the truth has no robot {robot}, only {', '.join(map(str, sorted(truth)))}"
            )
        track = member.robot.front.reckoning.track
        n = np.arange(track.n0, track.end)
        held = np.isfinite(track.poses[:, 0])
        t = np.array([member.clock.world(int(k) * GRID_US) / 1e6 for k in n[held]])
        true = truth[robot]
        when = true[:, 0] - wall_us / 1e6
        inside = (t >= when[0]) & (t <= when[-1])
        if np.count_nonzero(inside) < 2:
            raise BadRecording(
                f"the truth of robot {robot} is from {true[0, 0]:.1f} to {true[-1, 0]:.1f} s, its "
                f"recording from {wall_us / 1e6:.1f} to {wall_us / 1e6 + team.duration_s:.1f} s "
                "of UNIX time: was a clock not set?"
            )
        poses = metrics.at_times(when, true[:, 1:], t[inside])
        trails[robot] = Trail(robot, t[inside], track.poses[held][inside], poses)
    return Recording(name, trails, np.zeros((0, 4)))


def _wall_at_0(team: Team) -> int:
    """UNIX time of the world's 0, us: what most robots say."""
    said = [
        run.opening.utime + run.wall_ahead_us() - clock.world(run.opening.utime)
        for run, clock in zip(team.runs, team.clocks, strict=True)
    ]
    return int(np.median(said))


def without_truth(name: str, status: dict[int, dict[str, Any]]) -> dict[str, Any]:
    """What can be said of a run whose truth nobody knows, for a program."""
    return {
        "recording": name,
        "robots": {str(robot): {"pose": said["pose"]} for robot, said in sorted(status.items())},
        "team": None,
    }


def places(status: dict[int, dict[str, Any]]) -> dict[int, str]:
    """Where each robot is at the end, as a sentence."""
    return {robot: _place(said["pose"]) for robot, said in status.items()}


def _place(pose: dict[str, Any]) -> str:
    if "frame" not in pose:
        return str(pose["state"])
    return (
        f"{pose['state']} in the frame of robot {pose['frame']}: x {pose['x_m']:.2f} m, "
        f"y {pose['y_m']:.2f} m, {pose['theta_deg']:.1f} deg (sigma {pose['sigma_m']:.2f} m)"
    )
