"""What a team sends in the paper's experiment, as UDP payload with all that authenticates it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

from lab import outcome, virtual_team, world
from lab.benchmark.rows import Peer, Row

SCENE = world.Scene(robots=3, seconds=300.0, speed=0.2, odometry_hz=10, range_hz=50)
"""Three robots, 60 m each in 10 m x 12 m."""
SEED = 1
GOAL_MB = {1: 0.45, 10: 1.4}
PAPER_MB = {1: 4.3, 10: 13.8}


def sent(rate_hz: int, seconds: float) -> tuple[Counter[str], float]:
    """Bytes of all robots by kind of message, and the joint ATE in m."""
    recording = world.simulate(replace(SCENE, seconds=seconds), SEED)
    modules = ("relative_pose", "consistency", "optimizer")
    rates = "".join(f"[{module}]\nrate_hz = {rate_hz}\n" for module in modules)
    simulator = virtual_team.play(recording, extra=rates)
    kinds: Counter[str] = Counter()
    for member in simulator.members.values():
        for _, channel, payload in member.traces.sent:
            kinds[channel.split("_")[1].lower()] += 8 + len(channel) + 1 + len(payload)
    scores = outcome.score(recording, virtual_team.outcome(simulator))
    return kinds, float(scores["team"]["ate_rmse_m"])


def rows(quick: bool) -> Iterator[Row]:
    """Traffic of the whole experiment; quick plays a fifth of it."""
    share = 0.2 if quick else 1.0
    for rate_hz in (1,) if quick else (1, 10):
        kinds, ate = sent(rate_hz, share * SCENE.seconds)
        parts = ", ".join(f"{kind} {count / 1e6:.3f}" for kind, count in sorted(kinds.items()))
        work = f"paper's experiment at {rate_hz} Hz, sent by all robots"
        if quick:
            work += ", the first minute of five"
        peer = Peer(f"paper; ours by kind: {parts}; joint ATE {ate:.3f} m",
                    share * PAPER_MB[rate_hz], False)  # fmt: skip
        yield Row(0, work, sum(kinds.values()) / 1e6, "MB", share * GOAL_MB[rate_hz], peers=(peer,))
