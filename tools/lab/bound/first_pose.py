"""How soon a team that knows nothing says where it is, and whether that is true.

usage: python -m lab.bound.first_pose [--seeds N] [--robots N] [--jobs N] [--json FILE]

The world is the demo's: everybody is switched on, and drives, at once. For each robot the stages on
the way to its first published pose are timed, those of modules 1 and 2 by the first of its pairs.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field

import numpy as np

from drslamd.events import Effect, Event, Send
from drslamd.gossip import messages
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.slam import se2
from lab.files import CANNOT_WRITE, keep, result_file
from lab.numbers import whole
from lab.play import virtual_team
from lab.play.simulator import Member, Simulator
from lab.progress import Progress
from lab.recordings import world
from lab.recordings.recording import Recording
from lab.score import metrics
from lab.score.claims import claim

NEAR_M = 0.5
"""A pose that is nearer to the truth says where a robot is."""
WRONG = 20.0
"""A first pose of which the squared error is more, in units of its covariance, is a wrong one."""
MEDIAN_S, WRONG_SHARE = 16.0, 0.001
"""What is wanted."""
LONGEST_S = 60.0
STEP_S = 0.2
STAGES = ("answered", "one answer", "agreed", "confirmed", "connected")


@dataclass
class FirstPose:
    """Of one robot of one seed; times in s from the start, infinite what did not come.

    Attributes:
        stages: of its pairs, when the first came so far.
        published: its first pose; near: its first within `NEAR_M`.
        squared: error of the first one in units of its covariance, squared.
        error_m, sigma_m: of its position.
        in_own_frame: is it the frame of the team, so that little can be wrong?
    """

    seed: int
    robot: int
    stages: dict[str, float] = field(default_factory=dict)
    published: float = np.inf
    near: float = np.inf
    squared: float = 0.0
    error_m: float = 0.0
    sigma_m: float = 0.0
    in_own_frame: bool = False

    @property
    def is_wrong(self) -> bool:
        return self.squared > WRONG


class Watch:
    """Of one simulation."""

    def __init__(self, recording: Recording, simulator: Simulator, seed: int) -> None:
        self._recording, self._simulator = recording, simulator
        self.found = {robot: FirstPose(seed, robot) for robot in simulator.members}
        simulator.watchers.append(self.on_event)

    @property
    def is_over(self) -> bool:
        return all(np.isfinite(first.near) for first in self.found.values())

    def on_event(self, member: Member, event: Event, effects: Sequence[Effect]) -> None:
        for effect in effects:
            if isinstance(effect, Send) and messages.kind_of_channel(effect.channel) == "POSE":
                message = messages.decode("POSE", effect.payload)
                if isinstance(message, Pose) and message.state == PoseState.LOCALISED:
                    self._on_pose(member, message)

    def _on_pose(self, member: Member, said: Pose) -> None:
        robot, now = member.robot.own.robot, self._simulator.now / 1e6
        first, trail = self.found[robot], self._recording.trails[member.robot.own.robot]
        if np.isfinite(first.near):
            return
        t = np.array([member.clock.world(said.pose_utime) / 1e6])
        origin = self._recording.trails[said.frame].truth[0]
        truth = metrics.relative(origin, metrics.at_times(trail.t, trail.truth, t)[0])
        made = claim(np.array(said.pose), se2.unpacked(said.covariance), truth)
        if not np.isfinite(first.published):
            first.published, first.squared = now, made.squared
            first.error_m, first.sigma_m = made.error_m, made.sigma_m
            first.in_own_frame = said.frame == robot
        if made.error_m <= NEAR_M:
            first.near = now

    def look(self) -> None:
        """At the pairs: which stage each has come to."""
        now = self._simulator.now / 1e6
        for robot, member in self._simulator.members.items():
            for peer, pair in member.robot.front.pairs.items():
                reached = (
                    pair.closures_seen > 0,
                    pair.verdicts["unique"] > 0,
                    len(pair.kept) >= pair.agreement.least,
                    pair.search.is_confirmed,
                    pair.connected,
                )
                for stage, is_reached in zip(STAGES, reached, strict=True):
                    for one in (robot, peer) if is_reached else ():
                        self.found[one].stages.setdefault(stage, now)


def of_seed(seed: int, robots: int = 3, longest_s: float = LONGEST_S) -> list[FirstPose]:
    """Play one seed until everybody has said a pose that is near."""
    recording = world.simulate(world.Scene(robots=robots, seconds=longest_s), seed)
    simulator = virtual_team.start(recording, seed)
    watch, now = Watch(recording, simulator, seed), 0.0
    while now < longest_s and not watch.is_over:
        now += STEP_S
        simulator.run(now)
        watch.look()
    return list(watch.found.values())


def lines(found: Sequence[FirstPose]) -> list[str]:
    """The figures, as printed."""
    out = [f"{'s from the start':<28}{'p10':>7}{'median':>8}{'p90':>7}{'never':>7}"]
    for stage in STAGES:
        out.append(_row(stage, [first.stages.get(stage, np.inf) for first in found]))
    out.append(_row("published", [first.published for first in found]))
    out.append(_row(f"published within {NEAR_M} m", [first.near for first in found]))
    teams = {first.seed: first.near for first in sorted(found, key=lambda first: first.near)}
    out.append(_row("the same, all of a team", list(teams.values())))
    wrong = [first for first in found if first.is_wrong]
    out.append(f"wrong first poses: {len(wrong)} of {len(found)} (at most {WRONG_SHARE:.1%})")
    for first in wrong:
        out.append(
            f"  seed {first.seed}, robot {first.robot}: {first.error_m:.2f} m off, "
            f"sigma {first.sigma_m:.2f} m, squared {first.squared:.0f}"
        )
    return out


def _row(name: str, values: Sequence[float]) -> str:
    p10, median, p90 = np.percentile(values, [10, 50, 90], method="lower")
    never = np.count_nonzero(~np.isfinite(values))
    return f"{name:<28}{p10:>7.1f}{median:>8.1f}{p90:>7.1f}{never:>7}"


def is_reached(found: Sequence[FirstPose]) -> bool:
    """Soon enough, and seldom enough wrong?"""
    wrong = np.mean([first.is_wrong for first in found])
    return bool(np.median([first.near for first in found]) <= MEDIAN_S and wrong <= WRONG_SHARE)


def played(seeds: Sequence[int], robots: int, jobs: int) -> Iterator[list[FirstPose]]:
    """Every seed, in order."""
    if jobs == 1:
        yield from (of_seed(seed, robots) for seed in seeds)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(of_seed, seeds, [robots] * len(seeds))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run it; 1 when something is not reached."""
    parser = argparse.ArgumentParser(
        prog="lab.bound.first_pose", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--seeds", type=whole(1), default=500, metavar="N", help="default 500")
    parser.add_argument("--first", type=whole(), default=0, metavar="SEED", help="default 0")
    parser.add_argument("--robots", type=whole(2, 100), default=3, metavar="N", help="default 3")
    parser.add_argument("--jobs", type=whole(1), default=os.cpu_count() or 1, metavar="N")
    parser.add_argument(
        "--json", type=result_file, metavar="FILE", help="every first pose, as it comes"
    )
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.seeds)
    bar, found = Progress("first poses", len(seeds), "seeds"), list[FirstPose]()
    for done, firsts in enumerate(played(seeds, options.robots, options.jobs), start=1):
        found += firsts
        bar(done)
        if keep(options.json, json.dumps([asdict(first) for first in found]) + "\n"):
            return CANNOT_WRITE
    bar.end()
    print("\n".join(lines(found)))
    return 0 if is_reached(found) else 1


if __name__ == "__main__":
    sys.exit(main())
