"""Virtual time: N robots and one heap of times, a lossy network, one seed.

The robots are the very objects that the daemon runs; only the clock, the wires and the radio are
made up. A computation takes the virtual time that it took in reality, unless `solve_us` says how
long, which makes a run repeatable to the bit.
"""

from __future__ import annotations

import heapq
import itertools
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from drslamd.config import Config
from drslamd.events import (
    Datagram,
    Effect,
    Event,
    JobDone,
    Note,
    Restart,
    Save,
    SaveDone,
    Send,
    SerialData,
    Slept,
    Solve,
    Stop,
    Tick,
    Write,
)
from drslamd.gossip import lc02
from drslamd.gossip.seal import team_key
from drslamd.robot import Robot
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.relocation.last_place import LastPlace
from drslamd.slam.tuning import DEFAULTS, Tuning
from lab.play.playback import Chunk, Hardware


@dataclass(frozen=True)
class Clock:
    """A robot's own clock: how far ahead of the world it is, and how fast it runs."""

    offset_us: int = 0
    ppm: float = 0.0

    def local(self, t_us: int) -> int:
        return t_us + self.offset_us + round(t_us * self.ppm * 1e-6)

    def world(self, local_us: int) -> int:
        """The first moment at which this clock shows `local_us` or more."""
        t_us = int((local_us - self.offset_us) / (1 + self.ppm * 1e-6)) - 1
        while self.local(t_us) < local_us:
            t_us += 1
        return t_us


@dataclass
class Network:
    """A shared channel. Times in us."""

    loss: float = 0.0
    delay_us: int = 2_000
    jitter_us: int = 2_000
    duplicate: float = 0.0
    connected: Callable[[int, int, int], bool] = lambda a, b, t: True
    """Does a message from a reach b at time t?"""

    def deliveries(
        self, rng: np.random.Generator, way: tuple[int, int], t_us: int, data: bytes
    ) -> list[tuple[int, bytes]]:
        """When a datagram of the first robot of `way` reaches the second, and as what."""
        if not self.connected(*way, t_us):
            return []
        return [(arrival, data) for arrival in self.arrivals(rng, t_us)]

    def arrivals(self, rng: np.random.Generator, t_us: int) -> list[int]:
        copies = 2 if rng.random() < self.duplicate else 1
        return [
            t_us + self.delay_us + int(rng.integers(0, self.jitter_us + 1))
            for _ in range(copies)
            if rng.random() >= self.loss
        ]


Wire = Callable[[str, bytes], bytes]

Watcher = Callable[["Member", Event, list[Effect]], None]
"""Is told every event of every robot and what it led to, when that was carried out."""


class Disk:
    """What a robot keeps over its restarts.

    Attributes:
        fault: why nothing can be written now, empty while it can.
        state: what was written last.
    """

    def __init__(self) -> None:
        self.fault = ""
        self.state: Mapping[str, Any] = {}

    def keep(self, state: Mapping[str, Any]) -> str:
        """Write; why it was not possible."""
        if not self.fault:
            self.state = state
        return self.fault


@dataclass
class Traces:
    """What left a robot."""

    sent: list[tuple[int, str, bytes]] = field(default_factory=list)
    notes: list[tuple[int, Note]] = field(default_factory=list)
    saved: list[Save] = field(default_factory=list)
    solve_ms: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))


@dataclass
class Member:
    """One robot of the simulated team."""

    robot: Robot
    renew: Callable[[int], Robot]
    clock: Clock
    hardware: Hardware | None
    traces: Traces
    disk: Disk = field(default_factory=Disk)
    hears: Wire = lambda port, data: data
    """What becomes of the bytes that its devices print."""
    running: bool = True
    tick_at: int = -1
    wanted: tuple[int, Clock] | None = None
    """When its robot wants to be woken, on its clock ..."""
    wanted_at: int = 0
    """... and in the world, us."""
    asleep_until: int = 0
    """Its computer is suspended until then, us."""
    stalled_until: int = 0
    """Its process does nothing until then, us; what came meanwhile it finds afterwards."""


class Simulator:
    """A team in virtual time."""

    def __init__(
        self,
        seed: int = 0,
        network: Network | None = None,
        solve_us: int | None = 20_000,
        tuning: Tuning = DEFAULTS,
    ) -> None:
        self.now = 0
        self.network = network or Network()
        self.watchers: list[Watcher] = []
        self.members: dict[int, Member] = {}
        """By robot id, the latest start of each."""
        self._everyone: list[Member] = []
        self._rng = np.random.default_rng(seed)
        self._solve_us = solve_us
        self._tuning = tuning
        self._heap: list[tuple[int, int, Callable[[], None]]] = []
        self._order = itertools.count()
        self._sequence = itertools.count()

    def add(
        self,
        config: Config,
        clock: Clock | None = None,
        hardware: Hardware | None = None,
        secret: bytes | None = None,
        epoch: int = 1,
        epochs: dict[int, int] | None = None,
        kept: SensorCalibration = UNLEARNED,
        dbc_text: str = "",
        taped: SensorCalibration = UNLEARNED,
        disk: Disk | None = None,
        place: LastPlace | None = None,
    ) -> Member:
        """Switch a robot on, now."""

        def renew(fresh: int) -> Robot:
            key, known = team_key(secret), dict(epochs or {})
            return Robot(config, key, fresh, known, kept, dbc_text, self._tuning, taped, place)

        member = Member(renew(epoch), renew, clock or Clock(), hardware, Traces(), disk or Disk())
        self.members[config.robot.id] = member
        self._everyone.append(member)
        self._tick(member)
        return member

    def play(self, member: Member, chunks: Iterable[Chunk]) -> None:
        """Let a robot's devices print."""
        iterator = iter(chunks)

        def step() -> None:
            chunk = next(iterator, None)
            if chunk is None or not member.running:
                return

            def deliver() -> None:
                self.feed(member, chunk.port, member.hears(chunk.port, chunk.printed()))
                step()

            self.at(round(chunk.t * 1e6), deliver)

        step()

    def feed(self, member: Member, port: Any, data: bytes) -> None:
        """Bytes arrive at a port of a robot, now."""
        if data:
            self.handle(member, lambda utime: SerialData(utime, port, data))

    def at(self, t_us: int, action: Callable[[], None]) -> None:
        heapq.heappush(self._heap, (max(t_us, self.now), next(self._order), action))

    def run(self, until_s: float) -> None:
        """Let time pass."""
        until = round(until_s * 1e6)
        while self._heap and self._heap[0][0] <= until:
            self.now, _, action = heapq.heappop(self._heap)
            action()
        self.now = until

    def stop(self, member: Member) -> None:
        """Orderly end of one robot."""
        self.handle(member, Stop)
        member.running = False

    def kill(self, member: Member) -> None:
        """The robot's power is cut."""
        member.running = False

    def forget_ended(self) -> None:
        """Starts that are over leave the memory of this computer."""
        self._everyone = [member for member in self._everyone if member.running]

    def sleep(self, member: Member, seconds: float) -> None:
        """Suspend a robot's computer: nothing reaches it, its clock goes on, and it is told."""
        asleep_us = round(seconds * 1e6)
        member.asleep_until = self.now + asleep_us
        wakes = partial(self.handle, member, lambda utime: Slept(utime, asleep_us))
        self.at(member.asleep_until, wakes)
        self._tick(member)

    def handle(self, member: Member, make: Callable[[int], Event]) -> None:
        if not member.running or self.now < member.asleep_until:
            return
        if self.now < member.stalled_until:
            self.at(member.stalled_until, lambda: self.handle(member, make))
            return
        event = make(member.clock.local(self.now))
        effects = member.robot.handle(event)
        for effect in effects:
            self._carry_out(member, effect)
        for watcher in self.watchers:
            watcher(member, event, effects)
        self._tick(member)

    def _tick(self, member: Member) -> None:
        """Wake the robot when it wants to be woken."""
        wanted = member.robot.next_tick, member.clock
        if wanted != member.wanted:
            member.wanted, member.wanted_at = wanted, member.clock.world(wanted[0])
        due = max(member.wanted_at, self.now, member.asleep_until)
        if self.now < member.tick_at <= due:
            return
        member.tick_at = due

        def tick() -> None:
            if member.tick_at == due:
                member.tick_at = -1
                self.handle(member, Tick)

        self.at(due, tick)

    def _carry_out(self, member: Member, effect: Effect) -> None:
        if isinstance(effect, Send):
            self._send(member, effect)
        elif isinstance(effect, Solve):
            self._solve(member, effect)
        elif isinstance(effect, Write):
            if member.hardware is not None:
                self.feed(member, effect.port, member.hardware.base.answer(effect.data))
        elif isinstance(effect, Note):
            member.traces.notes.append((self.now, effect))
        elif isinstance(effect, Save):
            member.traces.saved.append(effect)
            fault = member.disk.keep(effect.state)
            self.at(self.now, lambda: self.handle(member, lambda utime: SaveDone(utime, fault)))
        elif isinstance(effect, Restart):
            member.robot = member.renew(effect.above + 1)

    def _send(self, sender: Member, effect: Send) -> None:
        data = lc02.encode(next(self._sequence), effect.channel, effect.payload)
        sender.traces.sent.append((self.now, effect.channel, effect.payload))
        source = sender.robot.own.robot
        for member in self._everyone:
            target = member.robot.own.robot
            if member is not sender:
                way = source, target
                for arrival, heard in self.network.deliveries(self._rng, way, self.now, data):
                    self.at(arrival, partial(self.arrive, member, heard, f"robot {source}"))

    def arrive(self, member: Member, data: bytes, sender: str) -> None:
        """A datagram reaches a robot, now."""
        self.handle(member, lambda utime: Datagram(utime, data, sender))

    def _solve(self, member: Member, effect: Solve) -> None:
        robot, start = member.robot, time.perf_counter()
        result = effect.run()
        elapsed = time.perf_counter() - start
        member.traces.solve_ms[effect.name].append(elapsed * 1e3)
        took = round(elapsed * 1e6) if self._solve_us is None else self._solve_us
        self.at(
            self.now + took,
            lambda: self._done(member, robot, effect.job_id, result, took),
        )

    def _done(self, member: Member, robot: Robot, job: int, result: Any, took: int) -> None:
        if self.now < member.asleep_until:
            self.at(member.asleep_until, partial(self._done, member, robot, job, result, took))
        elif member.robot is robot:
            self.handle(member, lambda utime: JobDone(utime, job, result, took))
