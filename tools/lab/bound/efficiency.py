"""How near our answers come to the bound: its variance over our mean square error, row by row.

In hindsight: relative poses of all pairs at the paper's pose times, of what robots say in the end.
Live: each pose as it was published, in the frame of robot 0. First pose: the first of those of each
robot. Bound and error are taken of the same robots at the same times, and so are the errors of an
estimator that is told all (`told_all`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from drslamd.gossip import messages
from drslamd.gossip.message_types import Pose, PoseState
from lab.bound import cramer_rao, told_all
from lab.bound.cramer_rao import Bound
from lab.bound.told_all import Found
from lab.play import virtual_team
from lab.play.simulator import Member, Network, Simulator
from lab.recordings import world
from lab.recordings.recording import Array, Recording
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


@dataclass(frozen=True)
class _Best:
    """What is the best that there is on one recording: the bound, and who is told all."""

    bound: Bound
    told: Found

    def at(self, t: float) -> int:
        """Which of its times is nearest, s."""
        return int(np.argmin(np.abs(self.bound.t - t)))

    def off(self, k: int, robot: int) -> tuple[Array, Array]:
        """(1,) m and degrees by which who is told all is off live."""
        return pose_errors(self.told.live[k, robot][None], self.bound.poses[k, robot][None])


def _best(team: Team, data: Recording) -> _Best:
    times = np.arange(0.0, data.duration, cramer_rao.STEP_S * 5)
    return _Best(
        cramer_rao.of_recording(data, team.scene, times),
        told_all.of_recording(data, team.scene, times),
    )


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
    best = _best(team, data)
    t = _pose_times(data)
    final = {r: metrics.at_times(p.t, p.poses, t) for r, p in result.final.items()}
    for a, b in combinations(sorted(final), 2):
        if result.frames[a] == result.frames[b]:
            _add_pair(tally, team, data, best, (a, b), metrics.relative(final[a], final[b]))
    for member in simulator.members.values():
        for row, said in _published(member):
            _live(tally, f"{team.name}/{row}", data, best, member, said)


def checked(team: Team, seed: int) -> Tally:
    """The same rows of one seed that nobody played: of who is told all, beside the bound."""
    data, tally = recording(team, seed), Tally()
    best = _best(team, data)
    for pair in combinations(range(team.robots), 2):
        _add_pair(tally, team, data, best, pair)
    name = f"{team.name}/live"
    for k in np.flatnonzero(best.bound.t >= POSE_TIMES[0]):
        for robot in range(1, team.robots):
            _put(tally, name, best.bound.of_pose(int(k), robot), best.off(int(k), robot))
    return tally


def _pose_times(data: Recording) -> Array:
    return POSE_TIMES[data.duration - 1 > POSE_TIMES]


def _add_pair(
    tally: Tally,
    team: Team,
    data: Recording,
    best: _Best,
    pair: tuple[int, int],
    found: Array | None = None,
) -> None:
    """A pair in hindsight, and what was found of it (n, 3) at the pose times."""
    t = _pose_times(data)
    at = np.searchsorted(best.bound.t, t - 1e-6)
    trails = (data.trails[robot] for robot in pair)
    true = metrics.relative(*(metrics.at_times(x.t, x.truth, t) for x in trails))
    told = pose_errors(metrics.relative(*(best.told.hindsight[at, r] for r in pair)), true)
    errors = None if found is None else pose_errors(found, true)
    variances = [values[at] for values in best.bound.of_pair(*pair)]
    _put(tally, f"{team.name}/hindsight", variances, told, errors)


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
    tally: Tally, name: str, data: Recording, best: _Best, member: Member, said: Pose
) -> None:
    robot, t = member.robot.own.robot, member.clock.world(said.pose_utime) / 1e6
    if robot == 0 or (name.endswith("live") and t < POSE_TIMES[0]):
        return
    trail = data.trails[robot]
    truth = metrics.relative(
        data.trails[0].truth[0], metrics.at_times(trail.t, trail.truth, np.array([t]))[0]
    )
    errors = pose_errors(np.array(said.pose)[None], truth[None])
    k = best.at(t)
    _put(tally, name, best.bound.of_pose(k, robot), best.off(k, robot), errors)


def _put(
    tally: Tally,
    name: str,
    variances: Sequence[Array],
    told: Sequence[Array],
    errors: Sequence[Array] | None = None,
) -> None:
    """Squares in m^2 and square degrees; variances are in square radians."""
    for k, (unit, factor) in enumerate(zip(UNITS, (1.0, np.degrees(1.0) ** 2), strict=True)):
        tally.add(f"{name}/{unit}/bound", variances[k] * factor)
        tally.add(f"{name}/{unit}/told", told[k] ** 2)
        if errors is not None:
            tally.add(f"{name}/{unit}/square", errors[k] ** 2)


def of(total: Tally, name: str) -> float:
    """Bound over mean square error; not a number where nothing was measured."""
    return total[f"{name}/bound"].mean / total[f"{name}/square"].mean


def on_same_data(total: Tally, name: str) -> float:
    """The same with the mean square error of who is told all in place of the bound.

    Both have the same mean over many seeds. What wheels and pair biases of a seed happen to be is
    in both errors alike, so of few seeds this says more.
    """
    return total[f"{name}/told"].mean / total[f"{name}/square"].mean
