"""Harm on the air: links, strangers, replays, messages of others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drslamd.gossip import lc02
from lab.score import metrics
from lab.soak import radio
from lab.soak.stage import STRANGER, Act, Bench, Stage


def apart(stage: Stage) -> Callable[[int, int, float], float]:
    trails = stage.recording.trails

    def apart_m(a: int, b: int, t_s: float) -> float:
        one, other = (
            metrics.at_times(trails[r].t, trails[r].truth, np.array([t_s]))[0] for r in (a, b)
        )
        return float(np.hypot(*(one - other)[:2]))

    return apart_m


def one_way(stage: Stage, dose: float) -> None:
    a, b = (int(r) for r in stage.rng.choice(stage.robots, 2, replace=False))
    stage.during(radio.one_way([(a, b)] if dose == 1 else [(a, b), (b, a)]))


def stranger(stage: Stage, per_s: float, until_s: float | None = None) -> None:
    """Random bytes, damaged messages, and messages under another key.

    Args:
        until_s: when it falls silent, by default when the faults end.
    """

    def speak(bench: Bench) -> None:
        for member in [m for m in bench.members.values() if m.running]:
            seen = bench.seen[member.robot.own.robot]
            kind = int(bench.rng.integers(3))
            if kind == 0 or not seen:
                data = bench.rng.bytes(int(bench.rng.integers(0, 1500)))
            elif kind == 1:
                data = seen[-1][: int(bench.rng.integers(0, len(seen[-1])))]
            else:
                data = seen[-1][:-9] + bench.rng.bytes(9)
            bench.arrive(member, data, STRANGER)

    _often(stage, per_s, speak, until_s)


def replay(stage: Stage, per_s: float) -> None:
    """What a robot was given before, once more."""

    def speak(bench: Bench) -> None:
        for member in [m for m in bench.members.values() if m.running]:
            seen = bench.seen[member.robot.own.robot]
            if seen:
                bench.arrive(member, seen[int(bench.rng.integers(len(seen)))], STRANGER)

    _often(stage, per_s, speak)


def _often(stage: Stage, per_s: float, act: Act, until_s: float | None = None) -> None:
    end_s = stage.end_s if until_s is None else until_s
    for t_s in np.arange(stage.begin_s, end_s, 1 / per_s).tolist():
        stage.at(t_s, act)


def oversize(stage: Stage, length: float) -> None:
    """Somebody on the group's port says too much."""
    data = lc02.encode(0, "DRSLAM_POSE_009", bytes(1_400)) + bytes(int(length) - 1_400)

    def speak(bench: Bench) -> None:
        for member in [m for m in bench.members.values() if m.running]:
            bench.arrive(member, data, STRANGER)

    _often(stage, 5, speak)
