"""Odometry has a hole: where is the robot said to be meanwhile, and when is it back?

    python -m lab.trust.holes [--what cable] [--seeds 20] [--first 1]

Three robots drive for 70 s. The wheels of robot 1 are silent from 30 to 50 s (`cable`), or its
daemon is off from 30 to 36 s and begins again with what it kept (`restart`) or with nothing
(`forgot`), or somebody carries the robot away meanwhile (`carried`). Every half second its pose is
held against the truth at the time that the pose names.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from drslamd.gossip.message_types import PoseState
from drslamd.slam import se2
from drslamd.slam.graph.estimate import PoseNow
from lab.numbers import whole
from lab.play import virtual_team
from lab.play.playback import equip, robot_config
from lab.play.simulator import Member, Simulator
from lab.progress import Progress
from lab.recordings import world
from lab.recordings.recording import Array, Recording
from lab.score import metrics

ROBOT = 1
SILENT_S, END_S = 30.0, 70.0
BACK_S = {"cable": 50.0, "restart": 36.0, "forgot": 36.0, "carried": 36.0}
CARRIED_M = 8.0
"""At most; a walk of six seconds."""
LOOK_S = 0.5
FIRST_S = 3.0
"""After the cable is out it takes so long until peers' odometry has come."""
SCENE = world.Scene(
    robots=3,
    seconds=END_S,
    ranges=world.RangeModel(bias=0.05, slow=0.03, burst_share=0.0),
    odometry=world.OdometryModel(scale=0.01, yaw_deg_per_m=0.05),
    odometry_hz=20,
    range_hz=10,
)
WRONG_M, WRONG_RAD, WRONG_SIGMAS = 0.5, np.radians(15), 4.0
INSIDE = 5.99
"""Chi-squared of two degrees of freedom at 95 %."""


@dataclass
class Hole:
    """One run.

    Attributes:
        was_localised: before the hole.
        silent: error m and squared error by the claimed covariance, per degree of freedom, of each
            look while the wheels are silent; unsaid: looks at which there was no position.
        back_s: after the wheels are back, to the first pose with a heading; infinite without.
        back_m, back_rad: how far off that was; squared: by its covariance of position.
        wrong: looks after that at which a localised pose is over 0.5 m and four sigmas off.
    """

    was_localised: bool = False
    silent: list[tuple[float, float]] = field(default_factory=list)
    unsaid: int = 0
    back_s: float = float("inf")
    back_m: float = float("nan")
    back_rad: float = float("nan")
    wrong: int = 0


def play(what: str, seed: int, until_s: float = END_S) -> Hole:
    """One seed."""
    recording = _driven(seed, is_carried=what == "carried")
    back_s = BACK_S[what]
    cable = (SILENT_S, back_s) if what == "cable" else (END_S, END_S)
    simulator, hole = _cut(recording, seed, cable), Hole()
    for now in np.arange(SILENT_S - 1, until_s, LOOK_S).tolist():
        simulator.run(now)
        if what != "cable" and now == SILENT_S:
            simulator.kill(simulator.members[ROBOT])
        if what != "cable" and now == back_s:
            _begin_again(simulator, what != "forgot")
        if simulator.members[ROBOT].running:
            _look(hole, recording, simulator, now, back_s)
    return hole


def _driven(seed: int, is_carried: bool) -> Recording:
    if not is_carried:
        return world.simulate(SCENE, seed)
    rng = np.random.default_rng(seed)
    truths = [world.drive(rng, SCENE) for _ in range(SCENE.robots)]
    angles, metres = rng.uniform(-np.pi, np.pi, 2), rng.uniform(1.0, CARRIED_M)
    first = round((SILENT_S + BACK_S["carried"]) / 2 / world.STEP_S)
    rest = truths[ROBOT][first:]
    there = rest[0] + [metres * np.cos(angles[0]), metres * np.sin(angles[0]), angles[1]]
    truths[ROBOT][first:] = se2.compose(there, se2.between(rest[0], rest))
    return world.recorded(f"carried, seed {seed}", rng, SCENE, truths)


def _begin_again(simulator: Simulator, remembers: bool) -> None:
    """Another start of that robot, with what its disk holds."""
    old = simulator.members[ROBOT]
    assert old.hardware is not None
    seal, learned, place = old.robot.team.seal, old.robot.calibration, old.robot.memory.place
    member = simulator.add(
        old.robot.config,
        old.clock,
        old.hardware,
        epoch=old.robot.own.epoch + 1,
        epochs=dict(seal.epochs),
        kept=learned.latest,
        place=place if remembers else None,
    )
    now = simulator.now / 1e6
    simulator.play(member, [chunk for chunk in old.hardware.chunks() if chunk.t >= now])


def _cut(recording: Recording, seed: int, cable: tuple[float, float]) -> Simulator:
    """The team with its devices about to print, but for what the cable keeps.

    Args:
        cable: from when until when it is out, s.
    """
    rng, simulator = np.random.default_rng(seed), Simulator(seed, solve_us=20_000)
    for robot, device in equip(recording).items():
        member = simulator.add(robot_config(device, ""), virtual_team.skewed_clock(rng), device)
        is_cut = [
            robot == ROBOT and chunk.port == "wheels" and cable[0] < chunk.t < cable[1]
            for chunk in device.chunks()
        ]
        chunks = [c for c, cut in zip(device.chunks(), is_cut, strict=True) if not cut]
        simulator.play(member, chunks)
    return simulator


def _look(
    hole: Hole, recording: Recording, simulator: Simulator, now: float, back_s: float
) -> None:
    member = simulator.members[ROBOT]
    where = member.robot.whereabouts(member.clock.local(simulator.now))
    has_heading = where.state in (PoseState.LOCALISED, PoseState.DOUBTFUL)
    if now < SILENT_S:
        hole.was_localised = has_heading
        return
    is_silent = SILENT_S + FIRST_S < now < back_s
    if where.pose is None:
        hole.unsaid += is_silent
        return
    error = _error(recording, member, where.pose)
    metres = float(np.hypot(error[0], error[1]))
    squared = float(error[:2] @ np.linalg.solve(where.pose.covariance[:2, :2], error[:2]))
    if is_silent:
        hole.silent.append((metres, squared / 2))
    if now >= back_s and has_heading:
        if not np.isfinite(hole.back_s):
            hole.back_s, hole.back_m, hole.back_rad = now - back_s, metres, abs(float(error[2]))
        hole.wrong += metres > WRONG_M and squared > WRONG_SIGMAS**2


def _error(recording: Recording, member: Member, stated: PoseNow) -> Array:
    """(3,) of a pose, at the time that it names and in the frame that it is in."""
    estimate = member.robot.back.estimate
    assert estimate is not None
    t, trails = member.clock.world(stated.utime) / 1e6, recording.trails
    true = metrics.at_times(trails[ROBOT].t, trails[ROBOT].truth, np.array([t]))[0]
    error = stated.pose - metrics.relative(trails[estimate.frame.robot].truth[0], true)
    error[2] = se2.wrap(error[2])
    return np.asarray(error)


def row(seed: int, hole: Hole) -> str:
    """One run, for people."""
    if not hole.was_localised:
        return f"seed {seed}: was not localised before"
    if not np.isfinite(hole.back_s):
        return f"seed {seed}: never back"
    return (
        f"seed {seed}: back after {hole.back_s:.1f} s, {hole.back_m:.2f} m and "
        f"{np.degrees(hole.back_rad):.1f} degrees off, {hole.wrong} wrong"
    )


def lines(found: list[Hole]) -> list[str]:
    """What came out, of those that were localised before; empty where nobody was."""
    runs = [hole for hole in found if hole.was_localised]
    if not runs:
        return []
    looks = [look for hole in runs for look in hole.silent]
    silent = (
        (
            f"while it is silent: {median(m for m, _ in looks):.2f} m off (median), "
            f"squared error by its covariance {np.mean([s for _, s in looks]):.2f} (mean), "
            f"{np.mean([s < INSIDE / 2 for _, s in looks]):.0%} in the 95 % ellipse, "
            f"{sum(hole.unsaid for hole in runs)} looks without a position"
        )
        if looks
        else "it said nothing while it was off"
    )
    back = np.array([hole.back_s for hole in runs])
    first = [hole for hole in runs if np.isfinite(hole.back_s)]
    return [
        f"{len(runs)} of {len(found)} runs: robot {ROBOT} was localised before",
        silent,
        (
            f"localised again within 5 s: {np.mean(back <= 5):.0%}, within 10 s: "
            f"{np.mean(back <= 10):.0%}, after {np.median(back):.1f} s (median), "
            f"{back.max():.1f} s (longest)"
        ),
        (
            f"first pose then: at most {max(hole.back_m for hole in first):.2f} m and "
            f"{np.degrees(max(hole.back_rad for hole in first)):.1f} degrees off; "
            f"{sum(h.back_m > WRONG_M or h.back_rad > WRONG_RAD for h in first)} of {len(first)} "
            f"over {WRONG_M} m or {np.degrees(WRONG_RAD):.0f} degrees"
        ),
        f"localised poses that are wrong: {sum(hole.wrong for hole in runs)}",
    ]


def holes(what: str, seeds: range) -> Iterator[Hole]:
    """One after the other."""
    progress = Progress("played", len(seeds), "runs")
    for done, seed in enumerate(seeds, start=1):
        yield play(what, seed)
        progress(done)
    progress.end()


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--what", default="cable", choices=tuple(BACK_S))
    parser.add_argument(
        "--seeds", type=whole(1), default=20, metavar="N", help="default: %(default)s"
    )
    parser.add_argument(
        "--first", type=whole(), default=1, metavar="N", help="default: %(default)s"
    )
    asked = parser.parse_args()
    found: list[Hole] = []
    for hole in holes(asked.what, range(asked.first, asked.first + asked.seeds)):
        print(row(asked.first + len(found), hole), flush=True)
        found.append(hole)
    print("\n".join(lines(found)))


if __name__ == "__main__":
    main()
