"""What a team that was played knows beyond its paths: residuals, agreement, claims, traffic.

All of it comes from the robots of a simulation after the run, whoever gave them their events: a
recording of others, or the team's own logs. Times are seconds of the recording.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_US
from drslamd.export.answers import columns
from drslamd.gossip import messages
from drslamd.gossip.message_types import PoseState
from drslamd.reports import graph_report
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.se2 import unpacked
from lab.play.simulator import Member, Simulator
from lab.recordings.recording import Array

MOST_CLOSURES = 150
"""Hypotheses in one matrix, the newest: more are no longer squares on paper."""


MEANT = (PoseState.LOCALISED, PoseState.DOUBTFUL)
"""Poses of now; a stale one says where a robot was and how far it may have driven since."""


@dataclass(frozen=True)
class Residuals:
    """Of the ranges of one pair: t (k,) s, metres (k,), and the sigmas (k,) that they had, m."""

    t: Array
    metres: Array
    sigma: Array


@dataclass(frozen=True)
class Agreement:
    """Module 2 of one pair: of n hypotheses in the order of time the squared lengths (n, n) of the
    loops of each two, and which (n,) are in the clique."""

    t: Array
    squared: Array
    kept: NDArray[np.bool_]


@dataclass(frozen=True)
class Published:
    """Poses of one robot: t (k,) s, poses (k, 3), covariances (k, 3, 3), frame and state (k,)."""

    t: Array
    poses: Array
    covariances: Array
    frame: NDArray[np.int64]
    state: NDArray[np.int64]


@dataclass
class Evidence:
    """By robot, or by pair "A-B"."""

    residuals: dict[str, Residuals] = field(default_factory=dict)
    agreement: dict[str, Agreement] = field(default_factory=dict)
    published: dict[int, Published] = field(default_factory=dict)
    sent: dict[int, dict[str, int]] = field(default_factory=dict)
    """Bytes of each kind of message."""
    problems: dict[int, list[str]] = field(default_factory=dict)
    """What each robot said was wrong at the end."""


def gather(simulator: Simulator) -> Evidence:
    """Of a run that has ended."""
    out = Evidence()
    for robot, member in sorted(simulator.members.items()):
        out.published[robot] = _published(member)
        out.sent[robot] = _sent(member)
        out.problems[robot] = list(member.robot.health.sentences().values())
        for peer, pair in sorted(member.robot.front.pairs.items()):
            found = _agreement(member, pair)
            if found is not None:
                out.agreement[f"{robot}-{peer}"] = found
    for member in simulator.members.values():
        for name, residuals in _residuals(simulator, member).items():
            known = out.residuals.get(name)
            if known is None or len(known.t) < len(residuals.t):
                out.residuals[name] = residuals
    out.residuals = dict(sorted(out.residuals.items()))
    return out


def _seconds(member: Member, utime: Array) -> Array:
    return np.array([member.clock.world(int(u)) / 1e6 for u in utime])


def _residuals(simulator: Simulator, member: Member) -> dict[str, Residuals]:
    """By pair, as one robot has them."""
    told = graph_report.graph(member.robot, member.clock.local(simulator.now))
    ranges, keyframes = columns(told, "ranges"), columns(told, "keyframes")
    if not ranges or told["ranges"]["left_out"] or told["keyframes"]["left_out"]:
        return {}
    utime = keyframes["utime"][ranges["i"].astype(int)]
    out = {}
    for a, b in np.unique(np.stack([ranges["a"], ranges["b"]], -1), axis=0).astype(int).tolist():
        mine = (ranges["a"] == a) & (ranges["b"] == b)
        t = _seconds(simulator.members[a], utime[mine])
        out[f"{a}-{b}"] = Residuals(t, ranges["residual_m"][mine], ranges["sigma_m"][mine])
    return out


def _agreement(member: Member, pair: PairTracker) -> Agreement | None:
    checked = pair._checked  # nobody else wants it, and a daemon need not keep a door for it
    if checked is None or not len(checked.consistency):
        return None
    count = len(checked.consistency)
    first = max(0, count - MOST_CLOSURES)
    squared = np.zeros((count - first, count - first))
    for k in range(first, count):
        squared[k - first, : k - first] = checked.consistency.distances(k)[first:]
    squared += squared.T
    kept = np.isin(np.arange(first, count), checked.consistency.kept_vertices())
    utime = np.array([m.a_n * GRID_US for m in checked.measurements[first:]])
    return Agreement(_seconds(member, utime), squared, kept)


def _published(member: Member) -> Published:
    rows: list[list[float]] = []
    for _, channel, payload in member.traces.sent:
        if messages.kind_of_channel(channel) == "POSE":
            message: Any = messages.decode("POSE", payload)
            if isinstance(message, messages.Pose) and message.state in MEANT:
                rows.append(message.row())
    table = np.array(rows).reshape(-1, 12)
    state, frame = table[:, 1].astype(np.int64), table[:, 2].astype(np.int64)
    covariances = np.array([unpacked(row) for row in table[:, 6:]]).reshape(-1, 3, 3)
    return Published(_seconds(member, table[:, 0]), table[:, 3:6], covariances, frame, state)


def _sent(member: Member) -> dict[str, int]:
    out: dict[str, int] = defaultdict(int)
    for _, channel, payload in member.traces.sent:
        out[messages.kind_of_channel(channel) or "other"] += len(payload)
    return dict(sorted(out.items()))
