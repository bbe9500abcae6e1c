"""What a team said of a recording, and the scores of it in one schema.

All times are seconds of the recording; whoever ran the team has already taken the robots' clocks
out of them.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lab.recordings.recording import Array, EdgeRecording, Recording
from lab.score import metrics

Played = Recording | EdgeRecording


@dataclass(frozen=True)
class Path:
    """A trajectory: t (k,) s ascending, poses (k, 3), frame (k,) robot in whose frame each is."""

    t: Array
    poses: Array
    frame: Array


@dataclass(frozen=True)
class Closure:
    """One answer of module 1: the poses of b in a that it allows, the best first."""

    t: float
    a: int
    b: int
    verdict: str
    poses: Array
    covariances: Array
    kept: bool


@dataclass
class Outcome:
    """The whole of a run."""

    final: dict[int, Path] = field(default_factory=dict)
    """Each robot's own account of its path, at the end."""
    live: dict[int, Path] = field(default_factory=dict)
    """Each estimate as it was published."""
    closures: list[Closure] = field(default_factory=list)
    frames: dict[int, int | None] = field(default_factory=dict)
    """In whose frame each robot was at the end; None when it was not localised."""
    groups: dict[int, list[int]] = field(default_factory=dict)
    bytes_sent: dict[int, int] = field(default_factory=dict)
    bias_m: dict[str, float] = field(default_factory=dict)
    """Range bias of each pair "A-B", as the lowest robot that knows it has it at the end."""
    near_bias_m: float | None = None
    """Of all ranges beside it, at distance 0, likewise; None while nobody knows."""
    scale: dict[str, float] = field(default_factory=dict)
    """Scale error of each robot's odometry, likewise."""
    ms: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    status: dict[int, dict[str, Any]] = field(default_factory=dict)
    """What each robot said of itself at the end."""

    @property
    def is_one_team(self) -> bool:
        """Is everybody localised in one frame?"""
        return len(set(self.frames.values())) == 1 and None not in self.frames.values()


def dead_reckoning(recording: Played) -> dict[int, Array]:
    """Odometry of every robot, started at its true first pose."""
    out = {}
    for robot, trail in recording.trails.items():
        step = metrics.relative(trail.odometry[:1], trail.odometry)
        step[:, 2] = trail.odometry[:, 2] - trail.odometry[0, 2]
        out[robot] = metrics.compose(trail.truth[0], step)
    return out


def score(recording: Played, outcome: Outcome) -> dict[str, Any]:
    """Every figure, by the schema of ``tools/evaluate`` (see tools/README.md)."""
    truth = {robot: trail.truth for robot, trail in recording.trails.items()}
    closures = [c for c in outcome.closures if len(c.poses)]
    return {
        "recording": recording.name,
        **_scored(recording, outcome.final),
        "live": _scored(recording, outcome.live),
        "odometry": metrics.team_errors(dead_reckoning(recording), truth),
        "pairs": _pairs(recording, outcome),
        "closures": {"seen": len(closures), "kept": sum(c.kept for c in closures)},
        "bytes_sent": {str(robot): n for robot, n in sorted(outcome.bytes_sent.items())},
        "ms": {
            name: {"median": float(np.median(ms)), "p99": float(np.percentile(ms, 99))}
            for name, ms in sorted(outcome.ms.items())
            if ms
        },
    }


def _scored(recording: Played, paths: dict[int, Path]) -> dict[str, Any]:
    """Errors at every true pose that an estimate covers, or at every estimate if those are rarer.

    One SE(2) is fitted for all robots together; poses that were published in another frame, before
    two groups met, are fitted for themselves.
    """
    estimates, truths, frames = {}, {}, {}
    for robot, path in paths.items():
        trail = recording.trails[robot]
        if len(path.t) < 2:
            continue
        if len(path.t) < len(trail.t) // 4:
            inside = (path.t >= trail.t[0]) & (path.t <= trail.t[-1])
            estimates[robot], frames[robot] = path.poses[inside], path.frame[inside]
            truths[robot] = metrics.at_times(trail.t, trail.truth, path.t[inside])
        else:
            inside = (trail.t >= path.t[0]) & (trail.t <= path.t[-1])
            when = trail.t[inside]
            estimates[robot] = metrics.at_times(path.t, path.poses, when)
            frames[robot] = path.frame[np.searchsorted(path.t, when)]
            truths[robot] = trail.truth[inside]
    if not estimates:
        return {"robots": {}, "team": None}
    return metrics.team_errors(metrics.aligned(estimates, truths, frames), truths)


def _pairs(recording: Played, outcome: Outcome) -> dict[str, Any]:
    """Relative poses of module 1 where it named exactly one, against the truth."""
    found: dict[str, list[tuple[Array, Array]]] = defaultdict(list)
    for closure in outcome.closures:
        if closure.verdict == "unique":
            truths = [
                metrics.at_times(trail.t, trail.truth, np.array([closure.t]))[0]
                for trail in (recording.trails[closure.a], recording.trails[closure.b])
            ]
            true = metrics.relative(truths[0], truths[1])
            found[f"{closure.a}-{closure.b}"].append((closure.poses[0], true))
    return {
        name: metrics.pair_errors(np.array([p for p, _ in rows]), np.array([t for _, t in rows]))
        for name, rows in sorted(found.items())
    }
