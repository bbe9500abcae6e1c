"""A member of the team whose program was changed: what do the others lose?

It drives, measures and speaks as it should, but for all that it says of one other robot: its ranges
are too long and its closures, very sure of themselves, put that robot beside where it is, always to
the same side. Nothing of it is malformed, and all of it agrees.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from drslamd.events import Send
from drslamd.gossip import messages
from drslamd.gossip.seal import Header, header_of
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry, RangeMeasurement
from lab.hunt.liar import LEAST_M, MOST, SCENE
from lab.play import virtual_team
from lab.play.simulator import Member, Simulator
from lab.recordings import world
from lab.score.outcome import score

FORGER: Final = 1
SURE: Final = (1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-5)
"""Covariance of its closures, m^2 and rad^2: a centimetre."""
_ALL: Final = frozenset(messages.FINGERPRINTS.values())


class Forged(NamedTuple):
    """How it ended.

    Attributes:
        honest_m, forged_m: ATE of the others without and with the forger, m.
        many: false measurements that it said.
    """

    many: int
    honest_m: float
    forged_m: float

    @property
    def ratio(self) -> float:
        return max(self.forged_m, LEAST_M) / max(self.honest_m, LEAST_M)

    @property
    def is_kept(self) -> bool:
        return self.ratio <= MOST


class _Forger:
    """Changes what `FORGER` says of robot `victim`, by `aside_m`."""

    def __init__(self, simulator: Simulator, victim: int, aside_m: float) -> None:
        self._victim, self._aside_m = victim, aside_m
        self._send = simulator._send
        self.many = 0
        simulator._send = self  # type: ignore[method-assign, assignment]

    def __call__(self, member: Member, send: Send) -> None:
        self._send(member, self._changed(member, send))

    def _changed(self, member: Member, send: Send) -> Send:
        robot = member.robot
        if robot.own.robot != FORGER or messages.kind_of_channel(send.channel) != "GRAPH":
            return send
        entry, header = messages.decode("GRAPH", send.payload), header_of(send.payload, _ALL)
        if not isinstance(entry, GraphEntry) or not isinstance(header, Header) or entry.chapter:
            return send
        false = replace(
            entry,
            ranges=tuple(self._longer(one) for one in entry.ranges),
            closures=tuple(self._beside(member, one) for one in entry.closures),
        )
        payload = messages.encode(header, false)
        return Send(send.channel, robot.team.seal.close(send.channel, payload))

    def _longer(self, one: RangeMeasurement) -> RangeMeasurement:
        if one.peer.robot != self._victim:
            return one
        self.many += 1
        return replace(one, range_m=round(one.range_m + 0.7 * self._aside_m, 4))

    def _beside(self, member: Member, one: ClosureMeasurement) -> ClosureMeasurement:
        if one.peer.robot != self._victim:
            return one
        self.many += 1
        track = member.robot.front.reckoning.track
        heading = float(track.steps(one.a_n, 1)[0, 2]) * 1e-4
        x, y, turn = one.a_T_b
        aside = self._aside_m * np.array([np.cos(heading), -np.sin(heading)])
        pose = x + float(aside[0]), y + float(aside[1]), turn
        covariance = tuple(float(np.float32(value)) for value in SURE)
        return replace(one, kept=True, a_T_b=pose, covariance=covariance)


def compared(aside_m: float, scene: world.Scene = SCENE, victim: int = 2) -> Forged:
    """The same team twice, once with a forger in it."""
    recording, errors, many = world.simulate(scene, 3), [], 0
    for is_forged in (False, True):
        simulator = virtual_team.start(recording, 3)
        forger = _Forger(simulator, victim, aside_m) if is_forged else None
        simulator.run(scene.seconds + virtual_team.SETTLE_S)
        robots = score(recording, virtual_team.outcome(simulator))["robots"]
        others = [e["ate_rmse_m"] for robot, e in robots.items() if int(robot) != FORGER]
        errors.append(float(np.sqrt(np.mean(np.square(others)))))
        many = forger.many if forger else 0
    return Forged(many, *errors)
