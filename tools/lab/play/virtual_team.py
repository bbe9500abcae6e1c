"""A recording played to a team in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from drslamd import report
from drslamd.gossip import messages
from drslamd.gossip.message_types import PoseState
from drslamd.slam.tuning import DEFAULTS, Tuning
from lab.play.playback import Hardware, equip, robot_config
from lab.play.simulator import Clock, Member, Network, Simulator
from lab.recordings.recording import Recording
from lab.score.outcome import Closure, Outcome, Path

SETTLE_S = 3.0
"""Time after the last measurement in which the team agrees on the end of its paths."""


def skewed_clock(rng: np.random.Generator) -> Clock:
    """Hours from the others and up to 50 ppm wrong."""
    return Clock(int(rng.uniform(1, 10) * 3600e6), float(rng.uniform(-50, 50)))


def run(
    recording: Recording,
    seed: int = 0,
    network: Network | None = None,
    extra: str = "",
    hardware: dict[int, Hardware] | None = None,
    progress: Callable[[float], None] | None = None,
    tuning: Tuning = DEFAULTS,
) -> Outcome:
    """Play the whole recording and ask the team what it found; arguments as in `play`."""
    return outcome(play(recording, seed, network, extra, hardware, progress, tuning=tuning))


def play(
    recording: Recording,
    seed: int = 0,
    network: Network | None = None,
    extra: str = "",
    hardware: dict[int, Hardware] | None = None,
    progress: Callable[[float], None] | None = None,
    solve_us: int | None = 20_000,
    tuning: Tuning = DEFAULTS,
) -> Simulator:
    """Play the whole recording; arguments as in `start`.

    Args:
        progress: told the seconds that have passed.
    """
    simulator = start(recording, seed, network, extra, hardware, solve_us, tuning)
    end = recording.duration + SETTLE_S
    for second in range(1, int(end) + 1):
        simulator.run(min(second, end))
        if progress:
            progress(second)
    simulator.run(end)
    return simulator


def start(
    recording: Recording,
    seed: int = 0,
    network: Network | None = None,
    extra: str = "",
    hardware: dict[int, Hardware] | None = None,
    solve_us: int | None = 20_000,
    tuning: Tuning = DEFAULTS,
) -> Simulator:
    """Every robot switched on and its devices about to print; no time has passed.

    Args:
        extra: TOML sections that every robot's configuration gets.
        solve_us: how long a computation takes there; None as long as it takes here.
        tuning: of every robot's estimator.
    """
    rng = np.random.default_rng(seed)
    simulator = Simulator(seed, network, solve_us, tuning)
    for device in (hardware or equip(recording)).values():
        member = simulator.add(robot_config(device, extra), skewed_clock(rng), device)
        simulator.play(member, device.chunks())
    return simulator


def outcome(simulator: Simulator) -> Outcome:
    """Ask every robot of a simulation what a daemon would be asked."""
    out = Outcome()
    for robot, member in simulator.members.items():
        now = member.clock.local(simulator.now)
        add_answers(
            out,
            robot,
            member.clock,
            report.trajectories(member.robot, now),
            report.closures(member.robot),
            report.status(member.robot, now),
        )
        out.live[robot] = _live(member)
        for name, ms in member.traces.solve_ms.items():
            out.ms[name] += ms
    return out


def add_answers(
    out: Outcome, robot: int, clock: Clock, trajectory: Any, closures: Any, status: Any
) -> None:
    """Sort one robot's answers into an outcome, its clock taken out."""
    own = trajectory["robots"].get(str(robot))
    if own:
        t = np.array([clock.world(u) / 1e6 for u in own["utime"]])
        out.final[robot] = Path(t, np.array(own["poses"]), np.full(len(t), trajectory["frame"]))
    for c in closures["closures"]:
        out.closures.append(
            Closure(
                clock.world(c["utime"]) / 1e6,
                c["a"],
                c["b"],
                c["verdict"],
                np.array(c["poses"]),
                np.array(c["covariances"]),
                c["kept"],
            )
        )
    out.frames[robot] = status["pose"].get("frame")
    out.groups[robot] = status["graph"]["group"]
    out.status[robot] = status
    out.bytes_sent[robot] = status["network"]["bytes_sent"]
    if out.near_bias_m is None:
        out.near_bias_m = status["graph"].get("near_range_bias_m")
    out.bias_m = {**status["graph"].get("range_bias_m", {}), **out.bias_m}
    out.scale = {**status["graph"].get("wheel_scale", {}), **out.scale}


def _live(member: Member) -> Path:
    """The poses that a robot published."""
    rows = []
    for _, channel, payload in member.traces.sent:
        if messages.kind_of_channel(channel) == "POSE":
            message = messages.decode("POSE", payload)
            if isinstance(message, messages.Pose) and message.state == PoseState.LOCALISED:
                t = member.clock.world(message.pose_utime) / 1e6
                rows.append([t, *message.pose, message.frame])
    return live_path(rows)


def live_path(rows: list[list[float]]) -> Path:
    """Published poses as rows of time, pose and frame."""
    table = np.array(rows).reshape(-1, 5)
    return Path(table[:, 0], table[:, 1:4], table[:, 4])
