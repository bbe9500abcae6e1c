"""Something stands that nobody has surveyed: when is its place known, and how well?

    python -m lab.trust.standing [--what robot] [--seeds 20] [--seconds 60] [--drivers 2]

Two robots drive, and between them stands a third one (`robot`), a module that no robot carries
(`module`), or one that somebody carries 2 m away in the middle of the run (`moved`). Each second
all claims of its place are held against the truth, seen from whoever claims it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from statistics import median

import numpy as np

from drslamd.conventions import GRID_US, node_chain
from drslamd.gossip.message_types import PoseState
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from lab.numbers import real, whole
from lab.play import virtual_team
from lab.play.simulator import Simulator
from lab.progress import Progress
from lab.recordings import world
from lab.recordings.recording import Array, Recording

DRIVERS = 2
MOVED_M, BEFORE_S = 2.0, 10.0
WITHIN_S = 30.0
"""After it was moved, it has to be dropped; how far drivers are off later is not its fault."""
FEW = 2
"""Candidates that are worth telling."""
WRONG_M, WRONG_SIGMAS = 0.5, 4.0
SCENE = world.Scene(seconds=60.0, odometry_hz=20, range_hz=10)


@dataclass
class Run:
    """One seed; times in s, infinite for what never was.

    Attributes:
        few_s: the first driver's search leaves two places or one; known_s: somebody claims one.
        off_m: how far the claims are off at the end, one for each robot that has one.
        wrong: claims over 0.5 m and four sigmas off; headings: claims of a heading.
        squares: of all claims, per degree of freedom.
        dropped_s: how long after it was moved the old place was still claimed; worst_m: how far
            drivers are off in the first 30 s from then on, relative to each other; before_m: in
            the ten seconds before; later_m: after these.
    """

    few_s: float = float("inf")
    known_s: float = float("inf")
    off_m: list[float] = field(default_factory=list)
    wrong: int = 0
    headings: int = 0
    squares: list[float] = field(default_factory=list)
    dropped_s: float = 0.0
    worst_m: float = 0.0
    before_m: float = 0.0
    later_m: float = 0.0


def recorded(
    what: str, seed: int, seconds: float, drivers: int = DRIVERS
) -> tuple[Recording, Array]:
    """A drive, and (n, 2) where the thing is that comes after the drivers, one row for each
    `world.STEP_S`."""
    rng = np.random.default_rng(seed)
    scene = replace(SCENE, seconds=seconds, robots=drivers + 1)
    truths = [world.drive(rng, scene) for _ in range(drivers)]
    place = rng.uniform([1, 1], [scene.width - 1, scene.height - 1])
    stands = np.tile([*place, rng.uniform(-np.pi, np.pi)], (len(truths[0]), 1))
    if what == "moved":
        angle = rng.uniform(-np.pi, np.pi)
        stands[len(stands) // 2 :, :2] += MOVED_M * np.array([np.cos(angle), np.sin(angle)])
    recording = world.recorded(f"{what}, seed {seed}", rng, scene, [*truths, stands])
    if what != "robot":
        trails = {robot: recording.trails[robot] for robot in range(drivers)}
        ranges = recording.ranges[recording.ranges[:, 1] != drivers]
        recording = replace(recording, trails=trails, ranges=ranges)
    return recording, stands[:, :2]


def play(what: str, seed: int, seconds: float, drivers: int = DRIVERS) -> Run:
    """One seed."""
    recording, stands = recorded(what, seed, seconds, drivers)
    simulator, run = virtual_team.start(recording, seed), Run()
    for second in range(2, round(seconds)):
        simulator.run(second)
        _look(run, recording, stands, simulator, second, drivers)
        if what == "moved":
            off = max(apart_off(recording, simulator, other) for other in range(1, drivers))
            if second > seconds / 2 + WITHIN_S:
                run.later_m = max(run.later_m, off)
            elif second > seconds / 2:
                run.worst_m = max(run.worst_m, off)
            elif second > seconds / 2 - BEFORE_S:
                run.before_m = max(run.before_m, off)
    return run


def _look(
    run: Run, recording: Recording, stands: Array, simulator: Simulator, second: int, drivers: int
) -> None:
    number = drivers if drivers in recording.trails else node_chain(drivers).robot
    is_moved = bool((stands[0] != stands[-1]).any()) and second > len(stands) * world.STEP_S / 2
    run.off_m = []
    for robot in range(drivers):
        member = simulator.members[robot]
        tracker = member.robot.front.points.trackers.get(drivers)
        found = tracker.found if tracker is not None else None
        if found is not None and 1 <= len(found.candidates) <= FEW:
            run.few_s = min(run.few_s, second)
        estimate = member.robot.back.estimate
        if estimate is None or number not in estimate.everybody:
            continue
        run.known_s = min(run.known_s, second)
        claim = seen_from(estimate, robot, number)
        t = member.clock.world(int(estimate.trajectories[robot].n[-1]) * GRID_US) / 1e6
        true = _truth(recording, robot, t, stands[min(round(t / world.STEP_S), len(stands) - 1)])
        off = claim[0] - true
        square = float(off @ np.linalg.solve(claim[1], off))
        if is_moved and np.hypot(*off) > MOVED_M / 2:
            run.dropped_s = second - len(stands) * world.STEP_S / 2
            continue
        run.off_m.append(float(np.hypot(*off)))
        run.squares.append(square / 2)
        run.wrong += run.off_m[-1] > WRONG_M and square > WRONG_SIGMAS**2
    parked = simulator.members.get(drivers)
    if parked is not None:
        where = parked.robot.whereabouts(parked.clock.local(simulator.now))
        run.headings += where.state in (PoseState.LOCALISED, PoseState.DOUBTFUL)


def seen_from(estimate: TeamEstimate, robot: int, number: int) -> tuple[Array, Array]:
    """Place (2,) of something in the last solved body frame of a robot, and its covariance."""
    found = estimate.relative(robot, number)
    assert found is not None
    return found[0][:2], found[1][:2, :2]


def apart_off(recording: Recording, simulator: Simulator, other: int) -> float:
    """How far the first driver has another one from where it is, as it sees it, m."""
    members = simulator.members[0], simulator.members[other]
    estimate = members[0].robot.back.estimate
    found = estimate.relative(0, other) if estimate is not None else None
    if estimate is None or found is None:
        return 0.0
    ends = [estimate.trajectories[robot].n[-1] for robot in (0, other)]
    times = [m.clock.world(int(n) * GRID_US) / 1e6 for m, n in zip(members, ends, strict=True)]
    there = _pose(recording, other, times[1])
    true = _truth(recording, 0, times[0], there[:2])
    return float(np.hypot(*(found[0][:2] - true)))


def _pose(recording: Recording, robot: int, t: float) -> Array:
    trail = recording.trails[robot]
    return np.array([np.interp(t, trail.t, trail.truth[:, k]) for k in range(3)])


def _truth(recording: Recording, robot: int, t: float, place: Array) -> Array:
    """(2,) a place in the true body frame of a robot."""
    pose = _pose(recording, robot, t)
    return np.asarray(se2.between(pose, np.array([*place, 0.0]))[:2])


def row(what: str, seed: int, run: Run) -> str:
    """One run, for people."""
    off = ", ".join(f"{metres:.3f}" for metres in run.off_m) or "nobody knows it,"
    moved = (
        f", {run.dropped_s:.0f} s, {run.worst_m:.2f} m (before {run.before_m:.2f} m, later "
        f"{run.later_m:.2f} m)"
        if what == "moved"
        else ""
    )
    return f"seed {seed}: {run.known_s:.0f} s, {off} m at the end, {run.wrong} wrong{moved}"


def lines(what: str, runs: list[Run]) -> Iterator[str]:
    """What came out, for people."""
    known = [run.known_s for run in runs]
    off = [metres for run in runs for metres in run.off_m]
    squares = [square for run in runs for square in run.squares]
    yield f"{len(runs)} seeds of `{what}`"
    yield (
        f"two places or one: after {median(run.few_s for run in runs):.0f} s (median), "
        f"{max(run.few_s for run in runs):.0f} s (most); one: {median(known):.0f} s, "
        f"{max(known):.0f} s"
    )
    if off:
        yield (
            f"at the end {median(off):.3f} m off (median), {max(off):.3f} m (most); squared error "
            f"by its covariance {np.mean(squares):.2f}"
        )
    yield (
        f"wrong (over {WRONG_M} m and {WRONG_SIGMAS:.0f} sigmas off): "
        f"{sum(run.wrong for run in runs)}; headings: {sum(run.headings for run in runs)}"
    )
    if what == "moved":
        dropped = [run.dropped_s for run in runs]
        yield (
            f"the old place is dropped after {median(dropped):.0f} s (median), "
            f"{max(dropped):.0f} s (most); drivers are off by at most "
            f"{max(run.worst_m for run in runs):.2f} m in the {WITHIN_S:.0f} s from then on "
            f"({median(run.worst_m for run in runs):.2f} m, median), "
            f"{max(run.later_m for run in runs):.2f} m after these, "
            f"{max(run.before_m for run in runs):.2f} m in the {BEFORE_S:.0f} s before "
            f"({median(run.before_m for run in runs):.2f} m, median)"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--what", default="robot", choices=("robot", "module", "moved"))
    parser.add_argument("--seeds", type=whole(1), default=20)
    parser.add_argument("--first", type=whole(), default=1)
    parser.add_argument("--seconds", type=real(1), default=SCENE.seconds)
    parser.add_argument("--drivers", type=whole(1, 100), default=DRIVERS)
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    progress, runs = Progress("played", len(seeds), "runs"), []
    for done, seed in enumerate(seeds, start=1):
        runs.append(play(options.what, seed, options.seconds, options.drivers))
        print(row(options.what, seed, runs[-1]), flush=True)
        progress(done)
    progress.end()
    print("\n".join(lines(options.what, runs)))


if __name__ == "__main__":
    main()
