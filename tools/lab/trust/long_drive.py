"""A drive of twenty minutes: is what thinning leaves of old times still right, and known to be?

Two robots drive in a room of 8 m x 8 m, once as they are and once with a graph that is never
thinned. Run it with `tools/venv lab python -m lab.trust.long_drive`, some ten minutes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from drslamd.slam.tuning import DEFAULTS, Tuning
from lab.accuracy.accuracy_rows import Figure
from lab.numbers import real, whole
from lab.play import virtual_team
from lab.play.simulator import Simulator
from lab.recordings import world
from lab.recordings.recording import Array, Recording, Trail
from lab.reproduce import team_column
from lab.reproduce.tally import Tally
from lab.score import metrics
from lab.score.outcome import Outcome

SECONDS = 1_200.0
SEEDS = range(1, 6)
OLD_S = 600.0
"""What was driven so long before the end is old: it has been thinned more than once."""
START_S = 30.0
"""Before that nobody knows anything."""
EVERYTHING = Tuning(recent_s=10**6)
"""Nothing is thinned."""
MOST_RATIO = 1.2
LEAST_NEES, MOST_NEES = 0.8, 1.2
MOST_SIGMAS = 1.25
"""Of the learned yaw rates, root mean square."""


@dataclass(frozen=True)
class Driven:
    """What one drive came to.

    Attributes:
        metres, degrees: mean error of the relative pose over old times.
        nees: of published poses, per degree of freedom.
        sigmas: (2,) errors of the learned yaw rates in units of what is claimed.
    """

    metres: float
    degrees: float
    nees: float
    sigmas: Array


def drive(seed: int, seconds: float = SECONDS, tuning: Tuning = DEFAULTS) -> Driven:
    """Play one drive."""
    scene = world.Scene(
        robots=2, seconds=seconds, odometry_hz=10, range_hz=10, width=8.0, height=8.0
    )
    recording = world.simulate(scene, seed)
    simulator = virtual_team.play(recording, seed, tuning=tuning)
    metres, degrees = old_errors(recording, virtual_team.outcome(simulator), seconds - OLD_S)
    tally = Tally()
    team_column.published(tally, recording, simulator)
    return Driven(
        metres, degrees, tally["drslamd/published/nees"].mean, _yaw_errors(recording, simulator)
    )


def old_errors(recording: Recording, outcome: Outcome, until: float) -> tuple[float, float]:
    """Mean error, m and degrees, of where one robot was seen from the other, up to a time."""
    t = np.arange(START_S, until, 5.0)
    trails = [recording.trails[robot] for robot in (0, 1)]
    said = [metrics.at_times(p.t, p.poses, t) for p in (outcome.final[0], outcome.final[1])]
    true = [metrics.at_times(trail.t, trail.truth, t) for trail in trails]
    off = metrics.relative(said[0], said[1]) - metrics.relative(true[0], true[1])
    turned = np.degrees(np.abs(metrics.wrapped(off[:, 2])))
    return float(np.hypot(off[:, 0], off[:, 1]).mean()), float(turned.mean())


def _yaw_errors(recording: Recording, simulator: Simulator) -> Array:
    """Of what the first robot says of both, in sigmas."""
    estimate = simulator.members[0].robot.back.estimate
    assert estimate is not None
    learned = [estimate.yaw[robot] for robot in (0, 1)]
    true = [_yaw_rate(recording.trails[robot]) for robot in (0, 1)]
    return np.array([(k.value - y) / k.sigma for k, y in zip(learned, true, strict=True)])


def _yaw_rate(trail: Trail) -> float:
    """rad/m by which the odometry of a robot turned away from the truth, over the whole drive."""
    way = float(np.hypot(*np.diff(trail.truth[:, :2], axis=0).T).sum())
    wrong = np.unwrap(trail.odometry[:, 2]) - np.unwrap(trail.truth[:, 2])
    return float(wrong[-1] - wrong[0]) / way


def figures(seeds: Iterable[int] = SEEDS, seconds: float = SECONDS) -> list[Figure]:
    """What thinning costs, over some drives."""
    thinned, whole = [], []
    for seed in seeds:
        print(f"long drive, seed {seed} ...", file=sys.stderr, flush=True)
        thinned.append(drive(seed, seconds))
        whole.append(drive(seed, seconds, EVERYTHING))
    name = f"{len(thinned)} drives of {seconds / 60:.0f} min"
    metres, degrees = (
        sum(getattr(d, what) for d in thinned) / sum(getattr(d, what) for d in whole)
        for what in ("metres", "degrees")
    )
    nees = float(np.mean([d.nees for d in thinned]))
    sigmas = float(np.sqrt(np.mean(np.concatenate([d.sigmas for d in thinned]) ** 2)))
    old = f"relative pose over {OLD_S / 60:.0f} min old, over that without thinning"
    return [
        Figure(name, f"{old}, position", metres, MOST_RATIO),
        Figure(name, f"{old}, rotation", degrees, MOST_RATIO),
        Figure(name, "published NEES per degree of freedom", nees, MOST_NEES),
        Figure(name, "published NEES per degree of freedom", nees, LEAST_NEES, is_least=True),
        Figure(name, "learned yaw rates, rms error in sigmas", sigmas, MOST_SIGMAS),
    ]


def main(arguments: list[str] | None = None) -> int:
    """Run it; 0 when every figure is reached."""
    parser = argparse.ArgumentParser(prog="lab.trust.long_drive", description=__doc__)
    parser.add_argument("--seeds", type=whole(), nargs="+", default=list(SEEDS))
    parser.add_argument("--seconds", type=real(1), default=SECONDS)
    options = parser.parse_args(arguments)
    found = figures(options.seeds, options.seconds)
    for figure in found:
        sign = "at least" if figure.is_least else "at most"
        mark = "" if figure.is_reached else "  NOT REACHED"
        print(f"{figure.measure}: {figure.reached:.3f}, {sign} {figure.wanted:g}{mark}")
    return 0 if all(figure.is_reached for figure in found) else 1


if __name__ == "__main__":
    raise SystemExit(main())
