"""A team before it begins: its world, radio, clocks, disks, and what will happen when."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from drslamd.events import SaveDone
from drslamd.gossip.epochs import next_epoch
from drslamd.robot import Robot
from drslamd.slam.calibration.sensor_calibration import SensorCalibration
from lab.play.playback import Chunk, Hardware, Wiring, equip, robot_config
from lab.play.simulator import Clock, Disk, Member, Simulator
from lab.play.virtual_team import skewed_clock
from lab.recordings.recording import Array, Recording
from lab.soak.invariants import Broken, imprint
from lab.soak.radio import Change, Radio, Trouble

STRANGER = "a stranger"
SECRET = bytes(range(32))
WALL_S = 1_800_000_000
"""What wall clocks show when a run begins."""
REMEMBERED = 200
"""Datagrams of each robot that somebody might replay to it."""

Act = Callable[["Bench"], object]
"""Something that happens to a team."""
Line = Callable[[float, str, bytes], bytes]
"""What becomes at a time, s, of bytes on the way from a port's device."""


class Bench(Simulator):
    """A team whose robots can be switched off and on, with somebody else on the air.

    Attributes:
        seen: the latest datagrams that each robot took: a copy of what it refused from somebody who
            had not answered it yet is no replay, but that message itself, late.
        doubles: robots under an id that belongs to another, by that id.
    """

    def __init__(self, stage: Stage, seed: int, extra: str = "") -> None:
        super().__init__(seed, stage.radio)
        self.stage = stage
        self.rng = np.random.default_rng([seed, 1])
        self.hardware = stage.hardware()
        self.seen: dict[int, deque[bytes]] = {}
        self.doubles: dict[int, Member] = {}
        self._extra = f'[team]\nkey_file = "team.key"\n{extra}'
        self._disks = {robot: Disk() for robot in self.hardware}
        for robot in self.hardware:
            self.switch_on(robot)
        for at_s, act in stage.acts:
            self.at(round(at_s * 1e6), partial(self._happen, act))

    def _happen(self, act: Act) -> None:
        act(self)

    def disk(self, robot: int) -> Disk:
        return self._disks[robot]

    def switch_on(self, robot: int) -> None:
        """A new start of a robot, with what its disk still says; one that runs goes on running."""
        if robot in self.members and self.members[robot].running:
            return
        self.forget_ended()
        self.seen[robot] = deque(maxlen=REMEMBERED)
        self._begin(self.hardware[robot], self._disks[robot])

    def double(self, robot: int) -> Member:
        """Another robot, with a copy of the disk of this one; it is none of `members`."""
        disk = Disk()
        disk.state = dict(self._disks[robot].state)
        first = self.members[robot]
        second = self.doubles[robot] = self._begin(self.stage.hardware()[robot], disk)
        self.members[robot] = first
        return second

    def _begin(self, device: Hardware, disk: Disk) -> Member:
        robot, now_s = device.robot, self.now / 1e6
        epoch = next_epoch(
            disk.state.get("epoch", 0), WALL_S + int(now_s), int(self.rng.integers(1_000_000))
        )
        epochs = dict(disk.state.get("epochs", {}))
        kept = SensorCalibration.of_state(disk.state.get("calibration", {}))
        fault = disk.keep({**disk.state, "epoch": epoch})
        member = self.add(
            robot_config(device, self._extra),
            self.stage.clocks[robot],
            device,
            SECRET,
            epoch,
            epochs,
            kept,
            disk=disk,
        )
        member.hears = partial(self._on_line, self.stage.lines.get(robot, []))
        if fault:
            self.handle(member, lambda utime: SaveDone(utime, fault))
        self.play(member, self.stage.chunks(device, now_s))
        return member

    def _on_line(self, lines: list[Line], port: str, data: bytes) -> bytes:
        for line in lines:
            data = line(self.now / 1e6, port, data)
        return data

    def arrive(self, member: Member, data: bytes, sender: str) -> None:
        robot = member.robot
        is_foreign = sender == STRANGER or data in self.stage.radio.damaged
        self.stage.radio.damaged.discard(data)
        before, taken = imprint(robot) if is_foreign else b"", _taken(robot)
        super().arrive(member, data, sender)
        if is_foreign and imprint(robot) != before:
            raise Broken("P5", robot.own.robot, f"believed {data[:40]!r} of {sender}")
        if sender != STRANGER and _taken(robot) > taken:
            self.seen[robot.own.robot].append(data)


def _taken(robot: Robot) -> int:
    return robot.team.accepted + robot.team.repeats_heard


@dataclass
class Stage:
    """All that can be prepared.

    Attributes:
        begin_s, end_s: from when to when things go wrong.
        wirings: what counters say, by robot, one after the other.
        lines: what becomes of bytes, by robot.
        acts: what happens at a time, s.
    """

    recording: Recording
    rng: np.random.Generator
    begin_s: float
    end_s: float
    radio: Radio = field(default_factory=Radio)
    clocks: dict[int, Clock] = field(default_factory=dict)
    wirings: dict[int, list[Wiring]] = field(default_factory=dict)
    lines: dict[int, list[Line]] = field(default_factory=dict)
    acts: list[tuple[float, Act]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.clocks = {robot: skewed_clock(self.rng) for robot in self.robots}

    @property
    def robots(self) -> list[int]:
        return sorted(self.recording.trails)

    def one(self) -> int:
        """Some robot."""
        return int(self.rng.choice(self.robots))

    def during(self, change: Change) -> None:
        """The radio has a trouble while things go wrong."""
        trouble = Trouble(round(self.begin_s * 1e6), round(self.end_s * 1e6), change)
        self.radio.troubles.append(trouble)

    def at(self, t_s: float, act: Act) -> None:
        self.acts.append((t_s, act))

    def is_wrong(self, t_s: float) -> bool:
        return self.begin_s <= t_s < self.end_s

    def hardware(self) -> dict[int, Hardware]:
        """Of all robots, when everything is prepared."""
        devices = equip(self.recording)
        for robot, wirings in self.wirings.items():
            devices[robot].wiring = partial(_wired, wirings)
        return devices

    def chunks(self, device: Hardware, since_s: float) -> Iterable[Chunk]:
        """What devices print from a time on."""
        return [chunk for chunk in device.chunks() if chunk.t >= since_s]


def _wired(wirings: list[Wiring], t: Array, left: Array, right: Array) -> tuple[Array, Array]:
    for wiring in wirings:
        left, right = wiring(t, left, right)
    return left, right


Put = Callable[[Stage, float], None]
"""Puts a fault onto a stage, in a dose."""
