"""What robots said in long drives, made up: for tests of a graph that is thinned."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from slam_scenes import NOISE, Array, closure, inverted, keyframes, model_of, product, range_item

from drslamd.conventions import Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.thinning.chain_view import ChainThinning, ChainView

Said = tuple[Chain, GraphEntry]
A, B = Chain(0, 1), Chain(1, 1)


def circles(radius_m: float, turn_s: float) -> Callable[[float], tuple[float, float, float]]:
    """A robot that drives in a circle: where it is at a time."""

    def at(t: float) -> tuple[float, float, float]:
        angle = 2 * math.pi * t / turn_s
        return radius_m * math.sin(angle), radius_m * (1 - math.cos(angle)), angle

    return at


def chain_of(seconds: Iterable[float], at: Callable[[float], Sequence[float] | Array]) -> ChainData:
    """A chain with keyframes at these times."""
    data = ChainData(A)
    times = list(seconds)
    for k in keyframes([round(10 * t) for t in times], [at(t) for t in times]):
        data.add(k)
    return data


def aged(data: ChainData, recent: int = 300) -> ChainView:
    """A chain as old as its newest keyframe says."""
    return ChainThinning().view(data, int(data.keyframes.n[-1]) // 160, recent)


@dataclass(frozen=True)
class Drive:
    """One robot of a team.

    Attributes:
        clock: samples that its clock is ahead.
        breaks: seconds at which its odometry breaks.
        stands: from when to when it makes no keyframe, s.
    """

    clock: int = 0
    breaks: tuple[int, ...] = ()
    stands: tuple[int, int] = (0, 0)


def logs(seed: int, seconds: int, drives: list[Drive], every: int = 2) -> list[Said]:
    """Entries of all robots in the order in which they were made.

    Keyframes and ranges come every so many seconds, a closure each eighth time; each third closure
    is withdrawn a minute and a half later.
    """
    rng = np.random.default_rng(seed)
    chains = [Chain(robot, robot + 1) for robot in range(len(drives))]
    times = np.arange(0, seconds, every)
    paths = [_wander(rng, len(times), 0.4 * every) for _ in drives]
    out: list[Said] = []
    newest: dict[int, int] = {}
    told: list[list[tuple[int, ClosureMeasurement]]] = [[] for _ in drives]
    for k, t in enumerate(times.tolist()):
        for robot, drive in enumerate(drives):
            frames: tuple[Keyframe, ...] = ()
            if not drive.stands[0] <= t < drive.stands[1] or robot not in newest:
                newest[robot] = drive.clock + 10 * t + int(rng.integers(0, 3))
                segment = sum(b <= t for b in drive.breaks)
                frames = keyframes([newest[robot]], [paths[robot][k]], segment)
            ranges: list[RangeMeasurement] = []
            closures: list[ClosureMeasurement] = []
            for peer in range(robot + 1, len(drives)):
                # at first the peer has no keyframe, and one is named that never comes
                ends = newest[robot], chains[peer], newest.get(peer, drives[peer].clock)
                arm = (float(rng.normal(0, 0.1)), 0.0)
                sigma = float(rng.choice([0.1, 0.1, 0.1, 0.35]))
                ranges.append(range_item(*ends, float(rng.uniform(1, 9)), arm, sigma=sigma))
                if k % 8 == 0:
                    closures.append(closure(10_000 * peer + k, *ends, rng.normal(0, 2, 3)))
                    told[robot].append((k, closures[-1]))
            gone = [item for when, item in told[robot] if when == k - 45 and when % 3 == 0]
            closures += [replace(item, kept=False) for item in gone]
            model = model_of(NOISE, (0.1 * robot, 0.0)) if k % 64 == robot else None
            out.append(
                (chains[robot], GraphEntry(k, model, frames, tuple(ranges), tuple(closures)))
            )
    return out


def _wander(rng: np.random.Generator, count: int, step_m: float) -> Array:
    heading = np.cumsum(rng.normal(0, 0.3, count))
    way = step_m * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return np.column_stack([np.cumsum(way, axis=0), heading])


def relative(path: Array, i: int, j: int) -> Array:
    """Pose j of a path seen from pose i."""
    return product(inverted(path[i]), path[j])
