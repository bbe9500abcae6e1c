"""The robot: every event goes in here, every effect comes out, and nothing else is touched.

`Robot.handle` reads no clock, draws no random number and does no I/O. Sensors become ranges and
motions, messages become graph, and a handful of timers drive the three modules of the paper:

    keyframes, ranges, closures  ->  our log  ->  the team        every second
    module 1  relative pose      ->  `relative_pose.rate_hz`
    module 2  consistency        ->  `consistency.rate_hz`
    module 3  pose graph         ->  `optimizer.rate_hz`          ->  our pose in the team's frame
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drslamd import diagnosis
from drslamd.broadcast import Broadcast
from drslamd.config import Config
from drslamd.conventions import GRID_US, MILLISECOND_US, SECOND_US, Chain
from drslamd.events import (
    CanFrame,
    ChannelMessage,
    Datagram,
    Effect,
    Event,
    JobDone,
    Level,
    NetworkState,
    Note,
    PortCondition,
    PortState,
    Restart,
    Save,
    Send,
    SerialData,
    Solve,
    Stop,
    Tick,
    Write,
)
from drslamd.gossip.outbox import Outbox
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team
from drslamd.health import Health
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from drslamd.sensors.wheels.wheel_input import WheelInput
from drslamd.slam import se2
from drslamd.slam.back_end import BackEnd
from drslamd.slam.calibration.calibration_store import (
    UNLEARNED,
    CalibrationStore,
    SensorCalibration,
)
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relative_pose.pair_window import Request
from drslamd.slam.se2 import Array

POLL_US = 10 * MILLISECOND_US
"""How finely the wheels that must be asked are asked; their driver knows its own rate."""
REPEAT_US = 100 * MILLISECOND_US
SAVE_US = 60 * SECOND_US
REST = 4
"""A module rests so many times as long as it computed: no team is so large that one of the three
takes more than a fifth of a core."""
GOODBYES = 3
"""Last messages of an orderly stop; at 30 % loss one gets through in 97 % of cases."""


@dataclass(frozen=True)
class _Job:
    """A computation under way: its module, the pair it is about, and its question."""

    module: str
    pair: PairTracker | None = None
    request: Request | None = None


class Robot:
    """One robot of a team."""

    def __init__(
        self, config: Config, key: bytes, epoch: int, epochs: dict[int, int],
        kept: SensorCalibration = UNLEARNED, dbc_text: str = "",
    ) -> None:  # fmt: skip
        """
        Args:
            key: of `seal.team_key`.
            epoch: of this start, above all earlier ones.
            epochs: last known epoch of each peer, from before this start.
            kept: what the last start learned of our sensors.
            dbc_text: content of `wheels.dbc_file`, where there is one.
        """
        self.config = config
        self.own = Chain(config.robot.id, epoch)
        self.uwb = LinkTrackInput(config.uwb_id, config.uwb.max_range_m)
        self.wheels = WheelInput(config.wheels, dbc_text)
        self.team = Team(Seal(key, config.robot.id, epoch, epochs))
        self.memory = CalibrationStore(kept, config.relative_pose)
        self.front = FrontEnd(config, self.own, self.memory.used)
        self.back = BackEnd(config, self.own)
        self.broadcast = Broadcast(config, self.team, self.front, self.back)
        self.outbox = Outbox(config.robot.id, config.gossip.max_bytes_per_s)
        self.health = Health()
        self.ports: dict[str, PortState] = {}
        self.network: NetworkState | None = None
        self.next_tick = 0
        self._jobs: dict[int, _Job] = {}
        self._jobs_begun = 0
        self.cycles: dict[str, tuple[int, int]] = {}
        """By module: when it last began to compute, and until when it rests."""
        self._saved_epochs = dict(epochs)
        rate = (config.relative_pose, config.consistency, config.optimizer)
        module_us = [round(SECOND_US / section.rate_hz) for section in rate]
        self._timers: dict[Callable[[int], list[Effect]], int] = {
            self._repeat: REPEAT_US,
            self._send_status: SECOND_US,
            self._send_odometry: SECOND_US,
            self._extend_log: SECOND_US,
            self._module1: module_us[0],
            self._module2: module_us[1],
            self._module3: module_us[2],
            self._check_health: SECOND_US,
            self._save: SAVE_US,
        }
        if self.wheels.must_be_asked:
            self._timers[self._poll_wheels] = POLL_US
        self._due: dict[Callable[[int], list[Effect]], int] = {}
        self._handlers: dict[type[Any], Callable[[Any], list[Effect]]] = {
            SerialData: self._on_serial,
            CanFrame: self._on_can,
            PortState: self._on_port,
            Datagram: self._on_message,
            ChannelMessage: self._on_message,
            NetworkState: self._on_network,
            Tick: self._on_tick,
            JobDone: self._on_job,
            Stop: self._on_stop,
        }

    def handle(self, event: Event) -> list[Effect]:
        """Take one event; what follows from it."""
        effects, outbox = self._handlers[type(event)](event), self.outbox
        return [e for e in effects if not isinstance(e, Send) or outbox.passes(e, event.utime)]

    # ---- sensors ----

    def _on_serial(self, event: SerialData) -> list[Effect]:
        if event.port == "uwb":
            for sample in self.uwb.feed(event.data, event.utime):
                self.front.on_range(sample)
            return []
        return self._on_motions(self.wheels.feed(event.data, event.utime))

    def _on_can(self, event: CanFrame) -> list[Effect]:
        return self._on_motions(self.wheels.on_frame(event))

    def _on_motions(self, motions: list[Any]) -> list[Effect]:
        for motion in motions:
            self.front.on_motion(motion)
        return []

    def _on_port(self, event: PortState) -> list[Effect]:
        self.ports[event.port] = event
        level = Level.INFO if event.condition is PortCondition.OPEN else Level.WARNING
        fields = {"state": event.condition.value, "detail": event.detail}
        return [Note(level, f"{event.port}.port", fields)]

    def _poll_wheels(self, utime: int) -> list[Effect]:
        data = self.wheels.poll(utime)
        return [Write("wheels", data)] if data else []

    # ---- the team ----

    def _on_network(self, event: NetworkState) -> list[Effect]:
        self.network = event
        level = Level.INFO if event.up else Level.WARNING
        return [Note(level, "network.up" if event.up else "network.down", {"detail": event.detail})]

    def _on_message(self, event: Datagram | ChannelMessage) -> list[Effect]:
        received = self.team.receive(event)
        if received is not None and isinstance(received.message, GraphEntry):
            self.back.insert(received.origin, received.message)
        return []

    def _repeat(self, utime: int) -> list[Effect]:
        is_in_a_graph = self.back.estimate is not None or bool(self.neighbours(utime))
        return list(self.team.repeats(utime)) if is_in_a_graph else []

    def _send_status(self, utime: int) -> list[Effect]:
        clock = self.uwb.system_offset_us(utime)
        return self.broadcast.heartbeat(self.neighbours(utime), clock, utime)

    def _send_odometry(self, utime: int) -> list[Effect]:
        return self.broadcast.odometry(self.neighbours(utime), utime)

    def neighbours(self, utime: int) -> list[PeerInRange]:
        """Living peers within UWB range of us, as either side measures it."""
        mine = set(self.front.ranged(utime))
        peers = (peer.neighbour(self.own, utime) for peer in self.team.living(utime).values())
        return [peer for peer in peers if peer.ranges_to_us or peer.uwb_id in mine]

    def _extend_log(self, utime: int) -> list[Effect]:
        """One entry of our log: where our wheels went, what we ranged, what module 2 kept."""
        neighbours = self.neighbours(utime)
        keyframe = self.front.keyframe()
        ranges = self.front.range_items(neighbours, self.back.graph, utime)
        closures = self.front.closure_items()
        if not (keyframe or ranges or closures):
            return []
        sends: list[Effect] = []
        for entry in self.team.entries(
            self.front.traits, (keyframe,) if keyframe else (), ranges, closures
        ):
            decoded, sealed = self.team.append(entry, utime)
            self.back.insert(self.own, decoded)
            if neighbours:
                sends.append(self.team.send_sealed(self.own.robot, sealed))
        return sends

    # ---- the three modules ----

    def _module1(self, utime: int) -> list[Effect]:
        if self._rests("relative_pose", utime):
            return []
        neighbours = self.neighbours(utime)
        busy = [job.pair for job in self._jobs.values() if job.module == "relative_pose"]
        return [
            self._solve(_Job("relative_pose", pair, request), run)
            for pair, request, run in self.front.module1(
                neighbours, self.back.graph, self.back.estimate, utime
            )
            if pair not in busy
        ]

    def _module2(self, utime: int) -> list[Effect]:
        return [
            self._solve(_Job("consistency", pair), run)
            for pair, run in self.front.module2(self.back.graph)
        ]

    def _module3(self, utime: int) -> list[Effect]:
        busy = any(job.module == "optimizer" for job in self._jobs.values())
        if busy or self._rests("optimizer", utime):
            return []
        public = {k: peer.public for k, peer in self.team.peers.items() if peer.public}
        run = self.back.job(self.team.present(utime), self.team.shifts(utime), public)
        return [self._solve(_Job("optimizer"), run)] if run else []

    def _solve(self, job: _Job, run: Callable[[], object]) -> Solve:
        self._jobs_begun += 1
        self._jobs[self._jobs_begun] = job
        return Solve(self._jobs_begun, job.module, run)

    def _on_job(self, event: JobDone) -> list[Effect]:
        job = self._jobs.pop(event.job_id)
        self._tire(job.module, event)
        if job.pair is not None and job.request is not None:
            job.pair.estimated(job.request, event.result)
            return []
        if job.pair is not None:
            job.pair.settle(event.result)
            return []
        self.back.solved(event.result)
        self.memory.update(self.back.estimate, self.own.robot, self.front.pairs)
        public = self.back.public_poses()
        sends = self.team.send_public(public, event.utime) if public else []
        return [*self.broadcast.pose(self.pose(), event.utime), *sends]

    def _rests(self, module: str, utime: int) -> bool:
        return module in self.cycles and utime < self.cycles[module][1]

    def _tire(self, module: str, event: JobDone) -> None:
        began = event.utime - event.elapsed_us
        since, until = self.cycles.get(module, (began, began))
        if until <= began:
            since, until = began, event.utime
        self.cycles[module] = since, max(until, event.utime) + REST * event.elapsed_us

    # ---- what we know of ourselves ----

    def pose(self) -> tuple[int, Array, Array] | None:
        """Our latest pose in the frame of the team: utime, w_T_a (3,), covariance (3, 3).

        None while we are not localised.
        """
        solved = self.back.trajectory(self.own.robot)
        track = self.front.reckoning.track
        if solved is None or self.back.estimate is None or not len(track):
            return None
        last, now = int(solved.n[-1]), track.end - 1
        if not track.covers(last, now):
            return None
        pose = se2.compose(solved.poses[-1], se2.between(track.at(last), track.at(now)))
        covariance = self.back.estimate.covariances[self.own.robot]
        return now * GRID_US, np.append(pose[:2], se2.wrap(pose[2])), covariance

    def _check_health(self, utime: int) -> list[Effect]:
        self.team.forget_silent(utime)
        notes: list[Effect] = []
        for key, sentence in diagnosis.conditions(self, utime):
            notes += self.health.set(key, sentence, utime)
        return [*notes, *self._restart_if_superseded(utime)]

    def _restart_if_superseded(self, utime: int) -> list[Effect]:
        """Peers know a later start of ours, so our own memory was lost: begin above it."""
        above = self.team.superseded_by
        if above is None or self.team.is_own_id_used(utime):
            return []
        fields = {"epoch": self.own.epoch, "known_to_peers": above}
        return [Note(Level.WARNING, "epoch.superseded", fields), Restart(above + 1)]

    # ---- time passes, and ends ----

    def _on_tick(self, event: Tick) -> list[Effect]:
        effects: list[Effect] = []
        for action, period in self._timers.items():
            due = self._due.setdefault(action, event.utime)
            if event.utime >= due:
                # after a stall the timer starts afresh instead of catching up in a burst
                late = event.utime - due > period
                self._due[action] = event.utime + period if late else due + period
                effects += action(event.utime)
        self.next_tick = min(self._due.values())
        return effects

    def state(self) -> dict[str, Any]:
        """What must outlive this start."""
        state = {"epoch": self.own.epoch, "epochs": self.team.seal.epochs}
        return {**state, "calibration": self.memory.latest.state()}

    def _save(self, utime: int) -> list[Effect]:
        if self.team.seal.epochs == self._saved_epochs and not self.memory.is_news():
            return []
        self.memory.saved()
        self._saved_epochs = dict(self.team.seal.epochs)
        return [Save(self.state())]

    def _on_stop(self, event: Stop) -> list[Effect]:
        goodbye = self.broadcast.status([], None, event.utime, leaving=True)
        sends = [self.team.send(goodbye, event.utime) for _ in range(GOODBYES)]
        return [*sends, Save(self.state())]
