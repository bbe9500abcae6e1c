"""What a team sends in the paper's experiment, as UDP payload with all that authenticates it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

from lab.benchmark.rows import Peer, Row
from lab.play import virtual_team
from lab.recordings.recording import Recording
from lab.reproduce import experiment
from lab.score import outcome

GOAL_MB = {1: 0.45, 10: 1.4}
PAPER_MB = {1: 4.3, 10: 13.8}
QUICK = 0.25


def sent(rate_hz: int, seconds: float) -> tuple[Counter[str], float]:
    """Bytes of all robots by kind of message, and the joint ATE in m."""
    recording = until(experiment.trial(experiment.TYPICAL_SEED).recording, seconds)
    modules = ("relative_pose", "consistency", "optimizer")
    rates = "".join(f"[{module}]\nrate_hz = {rate_hz}\n" for module in modules)
    simulator = virtual_team.play(recording, extra=rates)
    kinds: Counter[str] = Counter()
    for member in simulator.members.values():
        for _, channel, payload in member.traces.sent:
            kinds[channel.split("_")[1].lower()] += 8 + len(channel) + 1 + len(payload)
    scores = outcome.score(recording, virtual_team.outcome(simulator))
    return kinds, float(scores["team"]["ate_rmse_m"])


def until(recording: Recording, seconds: float) -> Recording:
    """The beginning of a recording."""
    trails = {}
    for robot, trail in recording.trails.items():
        now = trail.t <= seconds
        trails[robot] = replace(
            trail, t=trail.t[now], odometry=trail.odometry[now], truth=trail.truth[now]
        )
    ranges = recording.ranges[recording.ranges[:, 0] <= seconds]
    return replace(recording, trails=trails, ranges=ranges)


def rows(quick: bool) -> Iterator[Row]:
    """Traffic of the whole experiment. Quick plays its first quarter, when robots introduce
    themselves, and has no goal."""
    share = QUICK if quick else 1.0
    for rate_hz in (1,) if quick else (1, 10):
        kinds, ate = sent(rate_hz, share * experiment.SCENE.seconds)
        parts = ", ".join(f"{kind} {count / 1e6:.3f}" for kind, count in sorted(kinds.items()))
        work = f"paper's experiment at {rate_hz} Hz, sent by all robots"
        if quick:
            work += ", its first quarter"
        said = f"paper; ours by kind: {parts}; joint ATE {ate:.3f} m"
        peer = Peer(said, share * PAPER_MB[rate_hz], False)
        goal = None if quick else GOAL_MB[rate_hz]
        yield Row(0, work, sum(kinds.values()) / 1e6, "MB", goal, peers=(peer,))
