"""What can go wrong, each with its rows of the fault matrix and its doses.

A fault is put onto a stage before anything happens; it lasts from the stage's begin to its end, and
everything is whole again afterwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drslamd.gossip import lc02
from lab.play.playback import Wiring
from lab.play.simulator import Clock
from lab.recordings.recording import Array
from lab.score import metrics
from lab.soak import radio
from lab.soak.stage import STRANGER, Act, Bench, Stage
from lab.trust import mountings, sensor_faults

Put = Callable[[Stage, float], None]


@dataclass(frozen=True)
class Fault:
    """One kind.

    Attributes:
        rows: of the fault matrix.
        what: in a few words, with {} for the dose.
        doses: that a mixed run draws from.
    """

    rows: tuple[str, ...]
    what: str
    doses: tuple[float, ...]
    put: Put


# radio


def _apart(stage: Stage) -> Callable[[int, int, float], float]:
    trails = stage.recording.trails

    def apart_m(a: int, b: int, t_s: float) -> float:
        one, other = (
            metrics.at_times(trails[r].t, trails[r].truth, np.array([t_s]))[0] for r in (a, b)
        )
        return float(np.hypot(*(one - other)[:2]))

    return apart_m


def _one_way(stage: Stage, dose: float) -> None:
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


def _replay(stage: Stage, per_s: float) -> None:
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


def _oversize(stage: Stage, length: float) -> None:
    """Somebody on the group's port says too much."""
    data = lc02.encode(0, "DRSLAM_POSE_009", bytes(1_400)) + bytes(int(length) - 1_400)

    def speak(bench: Bench) -> None:
        for member in [m for m in bench.members.values() if m.running]:
            bench.arrive(member, data, STRANGER)

    _often(stage, 5, speak)


# ranges


def _rows(stage: Stage) -> Array:
    """(k,) which ranges are measured while things go wrong."""
    return np.asarray(
        (stage.recording.ranges[:, 0] >= stage.begin_s)
        & (stage.recording.ranges[:, 0] < stage.end_s)
    )


def _set_ranges(stage: Stage, ranges: Array) -> None:
    stage.recording = replace(stage.recording, ranges=ranges)


def _blocked(stage: Stage, metres: float) -> None:
    a, b = sorted(int(r) for r in stage.rng.choice(stage.robots, 2, replace=False))

    def extra(one: int, other: int, t: Array) -> Array:
        inside = (t >= stage.begin_s) & (t < stage.end_s) & ((one, other) == (a, b))
        return np.where(inside, metres * stage.rng.random(len(t)), 0.0)

    stage.recording = sensor_faults.lengthened(stage.recording, extra)


def _outliers(stage: Stage, share: float) -> None:
    ranges = stage.recording.ranges.copy()
    wild = _rows(stage) & (stage.rng.random(len(ranges)) < share)
    ranges[wild, 3] = stage.rng.uniform(0.1, 100, int(wild.sum()))
    _set_ranges(stage, ranges)


def _range_dropout(stage: Stage, share: float) -> None:
    ranges = stage.recording.ranges
    _set_ranges(stage, ranges[~(_rows(stage) & (stage.rng.random(len(ranges)) < share))])


def _frozen_ranges(stage: Stage, _: float) -> None:
    """A module says its last ranges again and again; its clock goes on."""
    ranges, robot = stage.recording.ranges.copy(), stage.one()
    for peer in stage.robots:
        mine = (ranges[:, 1] == robot) & (ranges[:, 2] == peer)
        frozen = np.flatnonzero(mine & _rows(stage))
        if len(frozen):
            ranges[frozen, 3] = ranges[frozen[0], 3]
    _set_ranges(stage, ranges)


def _module_reset(stage: Stage, _: float) -> None:
    robot = stage.one()
    stage.at(stage.begin_s, lambda bench: bench.hardware[robot].uwb.reboot(stage.begin_s))


# lines


def _cut(port: str) -> Put:
    def put(stage: Stage, _: float) -> None:
        stage.lines.setdefault(stage.one(), []).append(
            lambda t, where, data: b"" if where == port and stage.is_wrong(t) else data
        )

    return put


def _garbage(stage: Stage, share: float) -> None:
    """Random bytes between frames, so many of all."""
    rng = stage.rng

    def line(t: float, port: str, data: bytes) -> bytes:
        if not stage.is_wrong(t):
            return data
        return rng.bytes(round(len(data) * share / (1 - share))) + data

    stage.lines.setdefault(stage.one(), []).append(line)


def _bit_errors(stage: Stage, per_bit: float) -> None:
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


def _stuck(stage: Stage, _: float) -> None:
    _wire(stage, mountings.standing(stage.begin_s, stage.end_s))


def _spinning(stage: Stage, metres_per_s: float) -> None:
    _wire(stage, mountings.spinning(stage.begin_s, stage.end_s, metres_per_s))


def _counter_reset(stage: Stage, _: float) -> None:
    """The controller begins to count at zero again."""

    def wiring(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
        after = t >= stage.begin_s
        at = int(np.searchsorted(t, stage.begin_s))
        return np.where(after, left - left[at], left), np.where(after, right - right[at], right)

    _wire(stage, wiring)


def _wire(stage: Stage, wiring: Wiring) -> None:
    stage.wirings.setdefault(stage.one(), []).append(wiring)


# clocks, disks, processes


def _drift(stage: Stage, ppm: float) -> None:
    for k, robot in enumerate(stage.robots):
        offset = stage.clocks[robot].offset_us
        stage.clocks[robot] = Clock(offset, ppm * (-1) ** k)


def _suspended(stage: Stage, seconds: float) -> None:
    robot = stage.one()
    stage.at(stage.begin_s, lambda bench: bench.sleep(bench.members[robot], seconds))


def _stalled(stage: Stage, seconds: float) -> None:
    robot = stage.one()

    def act(bench: Bench) -> None:
        bench.members[robot].stalled_until = bench.now + round(seconds * 1e6)

    stage.at(stage.begin_s, act)


def _disk(fault: str) -> Put:
    def put(stage: Stage, _: float) -> None:
        robot = stage.one()

        def set_fault(what: str) -> Act:
            return lambda bench: setattr(bench.disk(robot), "fault", what)

        stage.at(stage.begin_s, set_fault(fault))
        stage.at(stage.end_s, set_fault(""))

    return put


def _restarts(stage: Stage, times: float) -> None:
    """A robot loses its power and comes back two seconds later, so often."""
    robot = stage.one()
    apart = (stage.end_s - stage.begin_s) / times
    for k in range(int(times)):
        at_s = stage.begin_s + k * apart
        stage.at(at_s, lambda bench: bench.kill(bench.members[robot]))
        stage.at(at_s + 2.0, lambda bench: bench.switch_on(robot))


def _wiped(stage: Stage, _: float) -> None:
    """A robot restarts with an empty disk."""
    robot = stage.one()

    def kill(bench: Bench) -> None:
        bench.kill(bench.members[robot])
        bench.disk(robot).state = {}

    stage.at(stage.begin_s, kill)
    stage.at(stage.begin_s + 2.0, lambda bench: bench.switch_on(robot))


def _left(stage: Stage, _: float) -> None:
    """A robot leaves in order and comes back."""
    robot = stage.one()
    stage.at(stage.begin_s, lambda bench: bench.stop(bench.members[robot]))
    stage.at(stage.end_s, lambda bench: bench.switch_on(robot))


FAULTS: dict[str, Fault] = {
    "loss": Fault(
        ("N1",),
        "{:.0%} of datagrams lost",
        (0.1, 0.3, 0.5, 0.7),
        lambda s, dose: s.during(radio.lossy(dose)),
    ),
    "bursts": Fault(
        ("N2",),
        "links dead in bursts, {:.0%} of the time",
        (0.3,),
        lambda s, dose: s.during(radio.bursty(dose)),
    ),
    "dark": Fault(
        ("N2",),
        "nothing heard for 5 s of {:.0f}",
        (10.0,),
        lambda s, dose: s.during(radio.dark(dose, 5.0)),
    ),
    "copies": Fault(
        ("N3",),
        "every datagram {:.0f} times",
        (2, 10),
        lambda s, dose: s.during(radio.copied(int(dose))),
    ),
    "late": Fault(
        ("N4",),
        "datagrams up to {:.0f} s late, in any order",
        (1.0, 5.0),
        lambda s, dose: s.during(radio.late(dose)),
    ),
    "one-way": Fault(("N5",), "a link dead on {:.0f} of its ways", (1, 2), _one_way),
    "parted": Fault(
        ("N6",),
        "one robot cut off",
        (0,),
        lambda s, dose: s.during(radio.parted({s.one()})),
    ),
    "flapping": Fault(
        ("N6",),
        "one robot cut off every other {:.0f} s",
        (3.0,),
        lambda s, dose: s.during(radio.parted({s.one()}, dose)),
    ),
    "short": Fault(
        ("N5",),
        "nobody heard beyond {:.0f} m",
        (5.0,),
        lambda s, dose: s.during(radio.short(dose, _apart(s))),
    ),
    "damage": Fault(
        ("N7", "S10"),
        "{:.0%} of datagrams damaged",
        (0.05, 0.5),
        lambda s, dose: s.during(s.radio.corrupting(dose)),
    ),
    "stranger": Fault(("N7", "S1"), "a stranger says {:.0f} things a second", (2, 20), stranger),
    "replay": Fault(("S3",), "{:.0f} replays a second", (2, 20), _replay),
    "oversize": Fault(("N9",), "datagrams of {:.0f} bytes", (1_401, 9_000), _oversize),
    "blocked": Fault(("M3",), "a pair's ranges up to {:.1f} m too long", (0.3, 3.0), _blocked),
    "outliers": Fault(("M4",), "{:.0%} of ranges anything", (0.01, 0.1, 0.3, 0.5), _outliers),
    "range-dropout": Fault(("M7",), "{:.0%} of ranges missing", (0.5, 0.9, 1.0), _range_dropout),
    "frozen-ranges": Fault(("M3",), "a module says its last ranges for ever", (0,), _frozen_ranges),
    "module-reset": Fault(("D11",), "a module begins anew", (0,), _module_reset),
    "uwb-cut": Fault(("D5",), "a module's cable pulled", (0,), _cut("uwb")),
    "wheels-cut": Fault(("D5",), "a base's cable pulled", (0,), _cut("wheels")),
    "garbage": Fault(("D1",), "{:.0%} of a robot's bytes are garbage", (0.1, 0.5), _garbage),
    "bit-errors": Fault(("D2",), "{:g} of a robot's bits turned over", (1e-5, 1e-3), _bit_errors),
    "stuck": Fault(("M1",), "a robot's encoders stuck", (0,), _stuck),
    "spinning": Fault(("M2",), "a robot's wheels slip by {:.1f} m/s", (0.2, 0.5), _spinning),
    "counter-reset": Fault(("D11",), "a base counts from zero again", (0,), _counter_reset),
    "drift": Fault(("T4",), "clocks drift by {:.0f} ppm, in turn fast and slow", (200,), _drift),
    "suspended": Fault(("T2",), "a computer asleep for {:.0f} s", (1, 10), _suspended),
    "stalled": Fault(("T3",), "a process that does nothing for {:.1f} s", (0.1, 1, 5), _stalled),
    "disk-full": Fault(("O2",), "a full disk", (0,), _disk("No space left on device")),
    "read-only": Fault(("S7",), "a disk that is read-only", (0,), _disk("Read-only file system")),
    "restarts": Fault(("S6", "O5"), "a robot restarted {:.0f} times", (1, 3), _restarts),
    "wiped": Fault(("S7",), "a robot restarted with an empty disk", (0,), _wiped),
    "leaves": Fault(("O4",), "a robot leaves in order and comes back", (0,), _left),
}
