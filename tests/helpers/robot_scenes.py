"""One robot without a daemon around it: its sensors, its peers and its estimate are made up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from acquainted import introduce
from message_builders import SECRET, a_seal, a_status, sealed
from pair_scenes import tracker
from slam_scenes import Array, config

from drslamd.conventions import GRID_US, SECOND_US, Chain, Segment
from drslamd.events import ChannelMessage, Effect, Note, Save, Send, Solve, Tick
from drslamd.gossip import messages
from drslamd.gossip.message_types import Heard, Message, OdometryBatch, Status
from drslamd.gossip.seal import Seal, team_key
from drslamd.robot import Robot
from drslamd.sensors.samples import Motion, RangeSample
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory

T0 = 100 * SECOND_US


def ticked(robot: Robot, utime: int) -> list[Effect]:
    """It is woken, and again as long as it wants to be at once."""
    effects = robot.handle(Tick(utime))
    while robot.next_tick <= utime:
        effects += robot.handle(Tick(utime))
    return effects


class RobotScene:
    """A robot with epoch 1, at `utime` on its clock, which all clocks agree with.

    Peers have epoch 1 too and UWB modules whose ids are theirs.
    """

    def __init__(
        self,
        robot: int = 0,
        extra: str = "",
        *,
        wheels: str | None = None,
        epoch: int = 1,
        epochs: dict[int, int] | None = None,
        kept: SensorCalibration = UNLEARNED,
    ) -> None:
        self.config = config(robot, extra, wheels=wheels)
        self.robot = Robot(self.config, team_key(SECRET), epoch, epochs or {}, kept)
        self.utime = T0
        self._seals: dict[int, Seal] = {}

    def later(self, seconds: float) -> None:
        """Time passes, and nothing happens."""
        self.utime += round(seconds * SECOND_US)

    def tick(self, seconds: float = 0.0) -> list[Effect]:
        """The robot is woken, so much later."""
        self.later(seconds)
        return ticked(self.robot, self.utime)

    # peers

    def hear(
        self, peer: int, message: Message, epoch: int = 1, *, is_met: bool = True
    ) -> list[Effect]:
        """A message arrives the moment it is sent, of a peer that answered us if it `is_met`."""
        team = self.robot.team
        if is_met and peer != self.robot.own.robot and epoch >= team.seal.epochs.get(peer, 0):
            introduce(team, Chain(peer, epoch), utime=self.utime)
        seal = self._seals.get(peer)
        if seal is None or seal.epoch != epoch:
            seal = self._seals[peer] = a_seal(peer, epoch)
        channel, payload = sealed(seal, message, self.utime)
        return self.robot.handle(ChannelMessage(self.utime, channel, payload, f"host of {peer}"))

    def meet(self, peer: int, *, hears_us: bool = True, ranges_to_us: bool = False) -> None:
        """The heartbeat of a peer."""
        own = self.robot.own
        heard = (Heard(own.robot, own.epoch, 0),) if hears_us else ()
        ranged = (own.robot,) if ranges_to_us else ()
        self.hear(peer, a_status(heard, uwb_id=peer, ranged=ranged), is_met=hears_us)

    def follow(self, peer: int, steps: Sequence[Sequence[float]]) -> None:
        """The odometry of a peer, the last sample of which is now."""
        n0 = self.utime // GRID_US - len(steps) + 1
        self.hear(peer, OdometryBatch(n0, n0, np.array(steps, dtype=float)))

    # sensors

    def range_to(self, uwb_id: int, metres: float = 5.0) -> None:
        self.robot.front.on_range(RangeSample(self.utime, uwb_id, metres, 0.0))

    def drive(self, seconds: float, metres: float = 0.05, radians: float = 0.0) -> None:
        """So far, and turned so much, in each tenth of a second of that time; until then."""
        for _ in range(round(10 * seconds)):
            self.utime += GRID_US
            self.robot.front.on_motion(Motion(self.utime, metres, radians))

    # what it knows

    def own_pair(self, peer: int) -> PairTracker:
        """It owns the pair with a peer."""
        pair = tracker(Chain(peer, 1), self.robot.front._method.agreement)
        self.robot.front.pairs[peer] = pair
        return pair

    def localise(
        self,
        pose: Sequence[float] = (0.0, 0.0, 0.0),
        covariance: Array | None = None,
        frame: int | None = None,
        n: int | None = None,
    ) -> TeamEstimate:
        """Module 3 has placed the keyframe n, by default the last sample of the odometry."""
        own = self.robot.own
        at = self.robot.front.reckoning.track.end - 1 if n is None else n
        estimate = TeamEstimate(
            Segment(own.robot if frame is None else frame, 1, 0),
            {own.robot: Trajectory(own, np.array([at]), np.array([pose], dtype=float))},
            joint=np.eye(3) if covariance is None else covariance,
        )
        self.robot.back.on_solution(estimate)
        return estimate


def sends(effects: list[Effect], kind: str | None = None) -> list[Send]:
    """Messages among effects, of one kind or of all."""
    found = [e for e in effects if isinstance(e, Send)]
    return [e for e in found if kind in (None, messages.kind_of_channel(e.channel))]


def solves(effects: list[Effect], name: str | None = None) -> list[Solve]:
    """Computations among effects."""
    return [e for e in effects if isinstance(e, Solve) and name in (None, e.name)]


def notes(effects: list[Effect]) -> list[Note]:
    return [e for e in effects if isinstance(e, Note)]


def saves(effects: list[Effect]) -> list[Save]:
    return [e for e in effects if isinstance(e, Save)]


def status_in(send: Send) -> Status:
    """What a heartbeat says."""
    decoded = messages.decode("STATUS", send.payload)
    assert isinstance(decoded, Status)
    return decoded
