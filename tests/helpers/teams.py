"""Teams in virtual time for the scenarios."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from lab.play.playback import Hardware, equip, robot_config
from lab.play.simulator import Member, Network, Simulator
from lab.play.virtual_team import outcome, skewed_clock
from lab.recordings import world
from lab.recordings.recording import Recording
from lab.score.outcome import Outcome, score

from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.relocation.last_place import LastPlace
from drslamd.slam.tuning import DEFAULTS, Tuning

EASY = world.Scene(
    robots=3,
    seconds=60.0,
    ranges=world.RangeModel(bias=0.05, slow=0.03, burst_share=0.0),
    odometry=world.OdometryModel(scale=0.01, yaw_deg_per_m=0.05),
    odometry_hz=20,
    range_hz=10,
)
"""Mild noise and few bytes: for scenarios that are about something else than accuracy."""


class VirtualTeam:
    """A recording, its hardware, and the robots that are switched on."""

    def __init__(
        self,
        scene: world.Scene = EASY,
        seed: int = 3,
        network: Network | None = None,
        extra: str = "",
        on: tuple[int, ...] | None = None,
        secrets: dict[int, bytes] | None = None,
        solve_us: int = 20_000,
        tuning: Tuning = DEFAULTS,
    ) -> None:
        self.recording: Recording = world.simulate(scene, seed)
        self.simulator = Simulator(seed, network, solve_us, tuning)
        self.hardware: dict[int, Hardware] = equip(self.recording)
        self._rng = np.random.default_rng(seed)
        self._clocks = {robot: skewed_clock(self._rng) for robot in self.hardware}
        self._extra = extra
        self._secrets = secrets or {}
        self.cut: Callable[[int, str, float], bool] = lambda robot, port, t: False
        """Is this cable pulled at time t?"""
        for robot in on if on is not None else tuple(self.hardware):
            self.start(robot)

    def start(
        self,
        robot: int,
        epoch: int = 1,
        epochs: dict[int, int] | None = None,
        kept: SensorCalibration = UNLEARNED,
        place: LastPlace | None = None,
    ) -> Member:
        """Switch a robot on, now; its devices print from now on."""
        device = self.hardware[robot]
        secret = self._secrets.get(robot)
        extra = self._extra
        if secret is not None:
            extra += '[team]\nkey_file = "team.key"\n'
        config, clock = robot_config(device, extra), self._clocks[robot]
        member = self.simulator.add(config, clock, device, secret, epoch, epochs, kept, place=place)
        now = self.simulator.now / 1e6
        chunks = [c for c in device.chunks() if c.t >= now]
        self.simulator.play(member, [c for c in chunks if not self.cut(robot, c.port, c.t)])
        return member

    def run(self, until_s: float) -> None:
        self.simulator.run(until_s)

    def member(self, robot: int) -> Member:
        return self.simulator.members[robot]

    def outcome(self) -> Outcome:
        return outcome(self.simulator)

    def errors(self) -> dict[str, float]:
        """Errors of the final team trajectories."""
        result: dict[str, float] = score(self.recording, self.outcome())["team"]
        return result

    def frames(self) -> dict[int, int | None]:
        """In whose frame each running robot is."""
        out = {}
        for robot, member in self.simulator.members.items():
            if member.running:
                estimate = member.robot.back.estimate
                out[robot] = estimate.frame.robot if estimate else None
        return out

    def digests(self) -> set[int]:
        """The graphs that the running robots hold."""
        members = self.simulator.members.values()
        return {member.robot.back.digest() for member in members if member.running}

    def problems(self, robot: int) -> str:
        """All sentences about what is wrong at a robot."""
        return "\n".join(self.member(robot).robot.health.sentences().values())
