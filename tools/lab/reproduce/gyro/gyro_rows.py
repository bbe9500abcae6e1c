"""The experiment with a gyro in every base: what it brings, and what one that is wrong costs.

The same drives, wheels and ranges as in the other tables. A gyro is 0.01 degrees per square root of
a second and 10 degrees an hour, and says its angle in the packets of the base. One that is wrong is
robot 1's, and so is the wheel that slips.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from drslamd.gossip import messages
from drslamd.gossip.message_types import PoseState
from drslamd.slam import se2
from lab.play import virtual_team
from lab.play.playback import equip
from lab.play.simulator import Simulator
from lab.recordings import world
from lab.recordings.recording import Array
from lab.reproduce.experiment import PAIRS, POSE_TIMES, Trial, pose_errors, trial
from lab.reproduce.tally import Tally
from lab.reproduce.team_column import published
from lab.score import metrics

KEYS = "gyro_noise_deg_per_sqrt_s = 0.01\ngyro_bias_deg_per_h = 10.0\n"
FAULTY = 1
FROM_S = 120.0
"""When a gyro goes wrong, or a wheel begins to slip."""
SLIP_S, SLIP = 10.0, 0.2
NAMED_WITHIN_S = 10.0
MOST = {"after/m": 0.036, "after/deg": 0.32, "live/m": 0.078, "live/deg": 0.85}
"""Wanted with a gyro."""
HEAD = (
    "| | after m | after deg | live m | live deg | NEES | named s | against |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- |"
)

Wrong = Callable[[float, float], "float | None"]
"""Time s and true angle rad to what is said."""


def _unplugged(t: float, angle: float) -> float | None:
    return None if t >= FROM_S else angle


def _biased(t: float, angle: float) -> float | None:
    return angle + math.radians(max(0.0, t - FROM_S))


def _upside_down(t: float, angle: float) -> float | None:
    return -angle


class _Stuck:
    """The angle of when it stuck."""

    def __init__(self) -> None:
        self._at: float | None = None

    def __call__(self, t: float, angle: float) -> float | None:
        if t < FROM_S:
            return angle
        self._at = angle if self._at is None else self._at
        return self._at


@dataclass(frozen=True)
class Case:
    """One row: is there a gyro, what is wrong with it, and does a wheel slip?

    Attributes:
        against: the row whose errors it may have at most `most` times.
    """

    name: str
    has_gyro: bool = True
    wrong: Callable[[], Wrong] | None = None
    since_s: float = FROM_S
    slips: bool = False
    against: str = ""
    most: float = 1.0


CASES = (
    Case("none", has_gyro=False),
    Case("gyro"),
    Case("a wheel slips, no gyro", has_gyro=False, slips=True),
    Case("a wheel slips", slips=True, against="gyro", most=1.2),
    Case("unplugged", wrong=lambda: _unplugged, against="none"),
    Case("stuck", wrong=_Stuck, against="none"),
    Case("biased by 1 deg/s", wrong=lambda: _biased, against="none"),
    Case("upside down", wrong=lambda: _upside_down, since_s=0.0, against="none"),
)


def row(case: Case, totals: Mapping[str, Tally]) -> tuple[str, bool]:
    """A line of the table, and is everything reached?

    Args:
        totals: of this case and those before it.
    """
    total = totals[case.name]
    cells = [f"{total[name].mean:.3f}" for name in MOST]
    cells.append(f"{total['drslamd/published/nees'].mean:.2f}")
    is_reached = True
    if case.name == "gyro":
        is_reached = all(total[name].mean <= most for name, most in MOST.items())
    named = total["named_s"]
    cells.append(f"{named.most:.1f}" if named.n else "-")
    if case.wrong is not None or (case.slips and case.has_gyro):
        is_reached = named.n == total["asked"].n and named.most <= NAMED_WITHIN_S
    ratio = 0.0
    if case.against in totals:
        other = totals[case.against]
        ratio = max(total[name].mean / other[name].mean for name in MOST)
        is_reached = is_reached and ratio <= case.most
    cells.append(f"{ratio:.2f} of {case.against}" if ratio else "")
    return f"| {case.name} | {' | '.join(cells)} |", is_reached


def slipping(t: Array, left: Array, right: Array) -> tuple[Array, Array]:
    """The right wheel turns by a fifth more than it drives, for ten seconds."""
    step = np.diff(right, prepend=right[:1])
    inside = (t >= FROM_S) & (t < FROM_S + SLIP_S)
    return left, right[:1] + np.cumsum(step * np.where(inside, 1 + SLIP, 1.0))


def run(case: Case, seed: int) -> Tally:
    """One seed of one row."""
    plain = trial(seed)
    recording = world.with_gyros(plain.recording, seed) if case.has_gyro else plain.recording
    hardware = equip(recording)
    if case.wrong is not None:
        hardware[FAULTY].gyro_wiring = case.wrong()
    if case.slips:
        hardware[FAULTY].wiring = slipping
    extra = KEYS if case.has_gyro else ""
    simulator = virtual_team.start(recording, seed, hardware=hardware, extra=extra)
    tally = Tally()
    end = recording.duration + virtual_team.SETTLE_S
    named = _play(simulator, end, case.since_s, is_slip=case.slips)
    tally.add("asked", 1.0)
    if named is not None:
        tally.add("named_s", named)
    _score(tally, plain, simulator)
    published(tally, recording, simulator)
    return tally


def _play(simulator: Simulator, end: float, since: float, *, is_slip: bool) -> float | None:
    """Play to the end; how many seconds after it went wrong robot 1 named it."""
    named = None
    for second in range(1, int(end) + 1):
        simulator.run(float(second))
        member = simulator.members[FAULTY]
        gyro, now = member.robot.wheels.gyro, member.clock.local(simulator.now)
        says = gyro.slips(now) if is_slip else gyro.fault(now) is not None
        if says and named is None and second >= since:
            named = second - since
    simulator.run(end)
    return named


def _score(tally: Tally, plain: Trial, simulator: Simulator) -> None:
    result = virtual_team.outcome(simulator)
    poses = {r: metrics.at_times(p.t, p.poses, POSE_TIMES) for r, p in result.final.items()}
    live = {robot: _live(simulator, robot) for robot in simulator.members}
    for a, b in PAIRS:
        if a in poses and b in poses and result.frames[a] == result.frames[b]:
            found = metrics.relative(poses[a], poses[b])
            tally.poses("after", pose_errors(found, plain.true_pairs(a, b)))
        both = np.isfinite(live[a]).all(axis=1) & np.isfinite(live[b]).all(axis=1)
        if both.any():
            found = metrics.relative(live[a][both], live[b][both])
            tally.poses("live", pose_errors(found, plain.true_pairs(a, b)[both]))


def _live(simulator: Simulator, robot: int) -> Array:
    """(poses, 3) what was last published at POSE_TIMES, carried on to then by odometry that is not
    wrong for so short; NaN before the first."""
    member = simulator.members[robot]
    rows = []
    for at, channel, payload in member.traces.sent:
        if messages.kind_of_channel(channel) == "POSE":
            message = messages.decode("POSE", payload)
            if isinstance(message, messages.Pose) and message.state == PoseState.LOCALISED:
                t = member.clock.world(message.pose_utime) / 1e6
                rows.append([at / 1e6, t, message.frame, *message.pose])
    out = np.full((len(POSE_TIMES), 3), np.nan)
    if not rows:
        return out
    table = np.array(rows)
    table = table[table[:, 2] == 0]
    truth = simulator.members[robot].hardware
    assert truth is not None
    trail = truth.trail
    for k, now in enumerate(POSE_TIMES):
        last = int(np.searchsorted(table[:, 1], now + 1e-6)) - 1
        if last >= 0 and now - table[last, 1] < 3.0:
            ends = metrics.at_times(trail.t, trail.truth, np.array([table[last, 1], now]))
            out[k] = se2.compose(table[last, 3:], metrics.relative(ends[0], ends[1]))
    return out
