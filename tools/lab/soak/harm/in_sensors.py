"""Harm in sensors: ranges, the lines that carry them, wheels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.play.playback import Wiring
from lab.recordings.recording import Array
from lab.soak.stage import Put, Stage
from lab.trust import mountings, sensor_faults

# ranges


def _rows(stage: Stage) -> Array:
    """(k,) which ranges are measured while things go wrong."""
    return np.asarray(
        (stage.recording.ranges[:, 0] >= stage.begin_s)
        & (stage.recording.ranges[:, 0] < stage.end_s)
    )


def _set_ranges(stage: Stage, ranges: Array) -> None:
    stage.recording = replace(stage.recording, ranges=ranges)


def blocked(stage: Stage, metres: float) -> None:
    a, b = sorted(int(r) for r in stage.rng.choice(stage.robots, 2, replace=False))

    def extra(one: int, other: int, t: Array) -> Array:
        inside = (t >= stage.begin_s) & (t < stage.end_s) & ((one, other) == (a, b))
        return np.where(inside, metres * stage.rng.random(len(t)), 0.0)

    stage.recording = sensor_faults.lengthened(stage.recording, extra)


def outliers(stage: Stage, share: float) -> None:
    ranges = stage.recording.ranges.copy()
    wild = _rows(stage) & (stage.rng.random(len(ranges)) < share)
    ranges[wild, 3] = stage.rng.uniform(0.1, 100, int(wild.sum()))
    _set_ranges(stage, ranges)


def range_dropout(stage: Stage, share: float) -> None:
    ranges = stage.recording.ranges
    _set_ranges(stage, ranges[~(_rows(stage) & (stage.rng.random(len(ranges)) < share))])


def frozen_ranges(stage: Stage, _: float) -> None:
    """A module says its last ranges again and again; its clock goes on."""
    ranges, robot = stage.recording.ranges.copy(), stage.one()
    for peer in stage.robots:
        mine = (ranges[:, 1] == robot) & (ranges[:, 2] == peer)
        frozen = np.flatnonzero(mine & _rows(stage))
        if len(frozen):
            ranges[frozen, 3] = ranges[frozen[0], 3]
    _set_ranges(stage, ranges)


def module_reset(stage: Stage, _: float) -> None:
    robot = stage.one()
    stage.at(stage.begin_s, lambda bench: bench.hardware[robot].uwb.reboot(stage.begin_s))


# lines


def cut(port: str) -> Put:
    def put(stage: Stage, _: float) -> None:
        stage.lines.setdefault(stage.one(), []).append(
            lambda t, where, data: b"" if where == port and stage.is_wrong(t) else data
        )

    return put


def garbage(stage: Stage, share: float) -> None:
    """Random bytes between frames, so many of all."""
    rng = stage.rng

    def line(t: float, port: str, data: bytes) -> bytes:
        if not stage.is_wrong(t):
            return data
        return rng.bytes(round(len(data) * share / (1 - share))) + data

    stage.lines.setdefault(stage.one(), []).append(line)


def bit_errors(stage: Stage, per_bit: float) -> None:
    rng = stage.rng

    def line(t: float, port: str, data: bytes) -> bytes:
        if not stage.is_wrong(t):
            return data
        out = bytearray(data)
        for k in np.flatnonzero(rng.random(8 * len(out)) < per_bit).tolist():
            out[k // 8] ^= 1 << (k % 8)
        return bytes(out)

    stage.lines.setdefault(stage.one(), []).append(line)


# wheels


def stuck(stage: Stage, _: float) -> None:
    _wire(stage, mountings.standing(stage.begin_s, stage.end_s))


def spinning(stage: Stage, metres_per_s: float) -> None:
    _wire(stage, mountings.spinning(stage.begin_s, stage.end_s, metres_per_s))


def counter_reset(stage: Stage, _: float) -> None:
    """The controller begins to count at zero again."""

    def wiring(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
        after = t >= stage.begin_s
        at = int(np.searchsorted(t, stage.begin_s))
        return np.where(after, left - left[at], left), np.where(after, right - right[at], right)

    _wire(stage, wiring)


def _wire(stage: Stage, wiring: Wiring) -> None:
    stage.wirings.setdefault(stage.one(), []).append(wiring)
