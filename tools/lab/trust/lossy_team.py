"""A team that drives past modules that nobody has surveyed, while messages are lost.

    python -m lab.trust.lossy_team [--robots 10] [--modules 2] [--loss 0.3] [--seeds 1] [--first 1]

Each drive is played twice, without loss and with it. Compared is the live error: each pose as it
was published, by the truth of its time, one frame fitted for all robots together.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from drslamd.conventions import node_chain
from lab.numbers import real, whole
from lab.play import virtual_team
from lab.play.simulator import Network
from lab.progress import Progress
from lab.recordings import world
from lab.recordings.recording import Recording
from lab.score.outcome import score

SCENE = world.Scene(seconds=60.0, odometry_hz=20, range_hz=10)
NETWORK_SEED = 5


@dataclass(frozen=True)
class Live:
    """One run.

    Attributes:
        ate_m: of all live poses; late_m: of those of the second half.
        robots: that published poses; known: modules that the first robot has at the end.
    """

    ate_m: float
    late_m: float
    robots: int
    known: int


def recorded(robots: int, modules: int, seed: int, seconds: float) -> Recording:
    """Robots that drive, and modules that stand and measure nothing."""
    rng, scene = np.random.default_rng(seed), replace(SCENE, robots=robots + modules)
    scene = replace(scene, seconds=seconds)
    truths = [world.drive(rng, scene) for _ in range(robots)]
    for _ in range(modules):
        place = rng.uniform([1, 1], [scene.width - 1, scene.height - 1])
        truths.append(np.tile([*place, 0.0], (len(truths[0]), 1)))
    recording = world.recorded(f"{robots} and {modules}, seed {seed}", rng, scene, truths)
    trails = {robot: recording.trails[robot] for robot in range(robots)}
    return replace(
        recording, trails=trails, ranges=recording.ranges[recording.ranges[:, 1] < robots]
    )


def play(recording: Recording, modules: int, loss: float, seed: int) -> Live:
    """One drive at one loss."""
    progress = Progress(f"{loss:.0%} lost", round(recording.duration) + 1, "s")
    simulator = virtual_team.play(recording, seed, Network(loss=loss), progress=progress)
    progress.end()
    outcome, robots = virtual_team.outcome(simulator), len(recording.trails)
    whole = score(recording, outcome)["live"]
    half = recording.duration / 2
    for robot, path in outcome.live.items():
        late = path.t >= half
        outcome.live[robot] = replace(
            path, t=path.t[late], poses=path.poses[late], frame=path.frame[late]
        )
    later = score(recording, outcome)["live"]
    estimate = simulator.members[0].robot.back.estimate
    nodes = estimate.nodes if estimate is not None else {}
    known = sum(node_chain(robots + k).robot in nodes for k in range(modules))
    ate = [
        found["team"]["ate_rmse_m"] if found["team"] else float("nan") for found in (whole, later)
    ]
    return Live(ate[0], ate[1], len(whole["robots"]), known)


def lines(loss: float, pairs: list[tuple[Live, Live]]) -> Iterator[str]:
    """What came out, for people."""
    for name in ("ate_m", "late_m"):
        without, lossy = ([getattr(live, name) for live in row] for row in zip(*pairs, strict=True))
        means = [float(np.sqrt(np.mean(np.square(row)))) for row in (without, lossy)]
        when = "all poses" if name == "ate_m" else "second half"
        yield (
            f"live error of {when}: {means[0]:.3f} m, {means[1]:.3f} m at {loss:.0%} loss, "
            f"{means[1] / means[0]:.2f} times"
        )
    worst = min(live.known for pair in pairs for live in pair)
    yield f"{len(pairs)} seeds; at least {worst} of the modules were known at the end"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--robots", type=whole(2, 100), default=10, metavar="N")
    parser.add_argument("--modules", type=whole(), default=2, metavar="N")
    parser.add_argument("--loss", type=real(0, 1), default=0.3, metavar="SHARE")
    parser.add_argument("--seeds", type=whole(1), default=1, metavar="N")
    parser.add_argument("--first", type=whole(), default=1, metavar="N")
    parser.add_argument("--seconds", type=real(1), default=SCENE.seconds)
    asked = parser.parse_args()
    pairs = []
    for seed in range(asked.first, asked.first + asked.seeds):
        recording = recorded(asked.robots, asked.modules, seed, asked.seconds)
        pairs.append(
            (
                play(recording, asked.modules, 0.0, seed),
                play(recording, asked.modules, asked.loss, seed),
            )
        )
        print("\n".join(lines(asked.loss, pairs)), flush=True)


if __name__ == "__main__":
    main()
