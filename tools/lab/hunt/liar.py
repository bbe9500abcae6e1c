"""A member of the team lies, in well-formed messages, all the time: what do the others lose?"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from drslamd.events import Datagram
from drslamd.gossip import lc02
from drslamd.gossip.seal import team_key
from lab.hunt.lies import Liar
from lab.play import virtual_team
from lab.play.simulator import Simulator
from lab.recordings import world
from lab.recordings.recording import Recording
from lab.score.outcome import score

LIAR = 3
ROBOTS = 3
MOST = 1.2
"""Times the error without a liar."""
LEAST_M = 0.02
"""Of an error: a ratio of less says nothing."""
BEATS_A_SECOND = 20
SCENE = world.Scene(
    robots=ROBOTS,
    seconds=75.0,
    ranges=world.RangeModel(bias=0.05, slow=0.03, burst_share=0.0),
    odometry=world.OdometryModel(scale=0.01, yaw_deg_per_m=0.05),
    odometry_hz=20,
    range_hz=10,
)


class Lied(NamedTuple):
    """How it ended.

    Attributes:
        honest_m, lied_to_m: ATE of the others without and with the liar, m.
        accepted: lies that went past seal and bounds, at one robot.
    """

    many: int
    seconds: float
    honest_m: float
    lied_to_m: float
    accepted: int

    @property
    def ratio(self) -> float:
        return max(self.lied_to_m, LEAST_M) / max(self.honest_m, LEAST_M)

    @property
    def is_kept(self) -> bool:
        return self.ratio <= MOST

    def line(self) -> str:
        return (
            f"{self.many:.3g} lies of a member ({self.accepted} read by robot 0): no exception, "
            f"error of the others {self.lied_to_m:.3f} m, {self.honest_m:.3f} m without it, "
            f"ratio {self.ratio:.2f} of at most {MOST}, {self.seconds:.0f} s"
        )


def compared(
    count: int, told: Callable[[float], None] = lambda _: None, scene: world.Scene = SCENE
) -> Lied:
    """The same team twice, once with a liar among them."""
    recording, began = world.simulate(scene, 3), time.perf_counter()
    honest = virtual_team.start(recording, 3)
    honest.run(scene.seconds)
    deceived = virtual_team.start(recording, 3)
    with warnings.catch_warnings():
        # a path of nonsense has no sigma; that its numbers overflow in the solver is no exception
        warnings.simplefilter("ignore", RuntimeWarning)
        _lie_to(deceived, count, scene.seconds, told)
    accepted = deceived.members[0].robot.team.accepted - honest.members[0].robot.team.accepted
    errors = [_error(recording, simulator) for simulator in (honest, deceived)]
    return Lied(count, time.perf_counter() - began, errors[0], errors[1], accepted)


def _lie_to(
    simulator: Simulator, count: int, seconds: float, told: Callable[[float], None]
) -> None:
    liar, said = Liar(LIAR, team_key(None)), 0
    beats = int(seconds * BEATS_A_SECOND)
    for beat in range(1, beats + 1):
        simulator.run(beat / BEATS_A_SECOND)
        for robot, member in simulator.members.items():
            liar.hears(robot, member.robot.own.epoch)
        while said < count * beat // beats:
            channel, payload = liar.lie(simulator.now)
            data = lc02.encode(said, channel, payload)
            for member in simulator.members.values():
                simulator.handle(member, partial(_datagram, data))
            said += 1
        told(said)


def _datagram(data: bytes, utime: int) -> Datagram:
    return Datagram(utime, data, "liar")


def _error(recording: Recording, simulator: Simulator) -> float:
    return float(score(recording, virtual_team.outcome(simulator))["team"]["ate_rmse_m"])
