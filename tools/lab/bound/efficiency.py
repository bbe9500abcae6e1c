"""How near our answers come to the bound: its variance over our mean square error, row by row.

In hindsight: relative poses of all pairs at the paper's pose times, of what robots say in the end.
Live: each pose as it was published, in the frame of robot 0. First pose: the first of those of each
robot. Bound and error are taken of the same robots at the same times.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from drslamd.gossip import messages
from drslamd.gossip.message_types import Pose, PoseState
from lab.bound import cramer_rao
from lab.bound.cramer_rao import Bound
from lab.play import virtual_team
from lab.play.simulator import Member, Network, Simulator
from lab.recordings import world
from lab.recordings.recording import Recording
from lab.recordings.world import Scene
from lab.reproduce import driving
from lab.reproduce.experiment import POSE_TIMES, SCENE, pose_errors
from lab.reproduce.tally import Tally
from lab.score import metrics
from lab.score.outcome import Outcome

ROWS = ("hindsight", "live", "first pose")
UNITS = ("m", "deg")
LEAST = {0.0: 0.9, 0.3: 0.85}
"""What is wanted of the first two rows, by the share of messages that is lost."""


@dataclass(frozen=True)
class Team:
    """So many robots in the paper's experiment, so many of their messages lost."""

    robots: int
    loss: float

    @property
    def name(self) -> str:
        return f"efficiency/{self.robots}/{self.loss:g}"

    @property
    def seconds(self) -> float:
        """Of one core, for one seed."""
        return 4.0 * self.robots**2

    @property
    def scene(self) -> Scene:
        """Ranges of large teams come more seldom, as on the radio."""
        return (
            SCENE
            if self.robots <= SCENE.robots
            else replace(SCENE, robots=self.robots, range_hz=10)
        )


TEAMS = tuple(Team(robots, loss) for robots in (3, 8) for loss in LEAST)


def recording(team: Team, seed: int) -> Recording:
    """The experiment of this seed with so many robots."""
    rng, scene = np.random.default_rng(seed), team.scene
    truths = [driving.by_hand(rng, scene) for _ in range(scene.robots)]
    return world.recorded(f"{scene.robots} robots, seed {seed}", rng, scene, truths)


def run(team: Team, seed: int) -> Tally:
    """Play one seed of a team."""
    data = recording(team, seed)
    simulator = virtual_team.play(data, seed, Network(loss=team.loss))
    tally = Tally()
    add(tally, team, data, simulator, virtual_team.outcome(simulator))
    return tally


def add(tally: Tally, team: Team, data: Recording, simulator: Simulator, result: Outcome) -> None:
    """Squared errors and bounds of one run that was played."""
    whole = np.arange(0.0, data.duration, cramer_rao.STEP_S * 5)
    bound = cramer_rao.of_recording(data, team.scene, whole)
    _hindsight(tally, team, data, bound, result)
    for member in simulator.members.values():
        for row, said in _published(member):
            _live(tally, f"{team.name}/{row}", data, bound, member, said)


def _hindsight(tally: Tally, team: Team, data: Recording, bound: Bound, result: Outcome) -> None:
    t = POSE_TIMES[data.duration - 1 > POSE_TIMES]
    at = np.searchsorted(bound.t, t - 1e-6)
    truths = {r: metrics.at_times(x.t, x.truth, t) for r, x in data.trails.items()}
    final = {r: metrics.at_times(p.t, p.poses, t) for r, p in result.final.items()}
    for a, b in combinations(sorted(final), 2):
        if result.frames[a] == result.frames[b]:
            found = metrics.relative(final[a], final[b])
            errors = pose_errors(found, metrics.relative(truths[a], truths[b]))
            variances = [values[at] for values in bound.of_pair(a, b)]
            _put(tally, f"{team.name}/hindsight", errors, variances)


def _published(member: Member) -> Iterator[tuple[str, Pose]]:
    """What one robot said live in the frame of robot 0; its first pose comes once more."""
    is_first = True
    for _, channel, payload in member.traces.sent:
        if messages.kind_of_channel(channel) != "POSE":
            continue
        said = messages.decode("POSE", payload)
        if isinstance(said, Pose) and said.state == PoseState.LOCALISED and said.frame == 0:
            if is_first and member.robot.own.robot != 0:
                is_first = False
                yield "first pose", said
            yield "live", said


def _live(
    tally: Tally, name: str, data: Recording, bound: Bound, member: Member, said: Pose
) -> None:
    robot, t = member.robot.own.robot, member.clock.world(said.pose_utime) / 1e6
    if robot == 0 or (name.endswith("live") and t < POSE_TIMES[0]):
        return
    trail = data.trails[robot]
    truth = metrics.relative(
        data.trails[0].truth[0], metrics.at_times(trail.t, trail.truth, np.array([t]))[0]
    )
    errors = pose_errors(np.array(said.pose)[None], truth[None])
    _put(tally, name, errors, [np.array([v]) for v in bound.of_pose(robot, t)])


def _put(
    tally: Tally, name: str, errors: Sequence[np.ndarray], variances: Sequence[np.ndarray]
) -> None:
    """Squares in m^2 and square degrees."""
    units = (1.0, np.degrees(1.0) ** 2)
    for unit, error, variance, factor in zip(UNITS, errors, variances, units, strict=True):
        tally.add(f"{name}/{unit}/square", error**2)
        tally.add(f"{name}/{unit}/bound", variance * factor)


def of(total: Tally, name: str) -> float:
    """Bound over mean square error; not a number where nothing was measured."""
    return total[f"{name}/bound"].mean / total[f"{name}/square"].mean
