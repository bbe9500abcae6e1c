"""The robot: every event goes in here, every effect comes out, and nothing else is touched.

`Robot.handle` reads no clock, draws no random number and does no I/O. The story is the paper's:

    ranges and motions in           `_on_serial`, `_on_can`
    module 1  relative poses        `Modules.relative_poses`
    module 2  consistency           `Modules.consistency`
    our log: keyframes, ranges and closures that are kept, to the team     `_extend_log`
    module 3  pose graph            `Modules.optimize`
    our pose out                    `pose`
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from drslamd.broadcast import Broadcast
from drslamd.conditions import diagnosis
from drslamd.conditions.health import Health
from drslamd.config import Config
from drslamd.conventions import SECOND_US, Chain
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
    SaveDone,
    Send,
    SerialData,
    Slept,
    Stop,
    Tick,
    Write,
)
from drslamd.gossip.bounds import is_sayable
from drslamd.gossip.membership.neighbourhood import Neighbourhood
from drslamd.gossip.message_types import OdometryBatch
from drslamd.gossip.outbox import Outbox
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team
from drslamd.jobs import OPTIMIZER, RELATIVE_POSE, Jobs
from drslamd.memory import Memory
from drslamd.modules import Modules
from drslamd.near.surroundings import Surroundings
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from drslamd.sensors.samples import Motion
from drslamd.sensors.wheels.wheel_input import WheelInput
from drslamd.slam.back_end import BackEnd
from drslamd.slam.calibration.calibration_store import CalibrationStore
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.estimate import PoseNow
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.relocation.last_place import LastPlace
from drslamd.slam.settings import closure_method
from drslamd.slam.tuning import DEFAULTS, Tuning
from drslamd.standing import Standing
from drslamd.timers import PLACE_US, POLL_US, REPEAT_US, SAVE_US, TURN_US, Action, Timers
from drslamd.whereabouts import Whereabouts

GOODBYES = 3
"""Last messages of an orderly stop; at 30 % loss one gets through in 97 % of cases."""


class Robot:
    """One robot of a team."""

    def __init__(
        self,
        config: Config,
        key: bytes,
        epoch: int,
        epochs: dict[int, int],
        kept: SensorCalibration = UNLEARNED,
        dbc_text: str = "",
        tuning: Tuning = DEFAULTS,
        taped: SensorCalibration = UNLEARNED,
        place: LastPlace | None = None,
    ) -> None:
        """
        Args:
            key: of `seal.team_key`.
            epoch: of this start, above all earlier ones. epochs: last known ones of the peers.
            kept: what the last start learned of our sensors; taped: what a person measured.
            place: where the last start was.
            dbc_text: content of `wheels.dbc_file`, if there is one. tuning: of the estimator.
        """
        self.config = config
        self.own = Chain(config.robot.id, epoch)
        self.uwb = LinkTrackInput(config.uwb_id, config.uwb.max_range_m, config.uwb.line)
        self.wheels = WheelInput(config.wheels, dbc_text, config.odometry)
        self.team = Team(Seal(key, config.robot.id, epoch, epochs), config.gossip.max_bytes_per_s)
        uses_kept = closure_method(config.relative_pose).uses_calibration
        self.calibration = CalibrationStore(kept, uses_kept, taped)
        self.front = FrontEnd(config, self.own, self.calibration.used, tuning, place)
        self.back = BackEnd(config, self.own, tuning)
        self.broadcast = Broadcast(config, self.team, self.front, self.back)
        self.standing = Standing(config, self.team, self.front, self.back, self.wheels.rhythm)
        self.near = Surroundings(config, self.own, self.front, self.back, self.team, self.standing)
        self.outbox = Outbox(config.robot.id, config.gossip.max_bytes_per_s)
        self.health = Health()
        self.ports: dict[str, PortState] = {}
        self.network: NetworkState | None = None
        self.slept: Slept | None = None
        self.jobs = Jobs()
        self.neighbourhood = Neighbourhood(self.own, self.team.living, self.front.ranged)
        self.neighbours = self.neighbourhood.at
        self.modules = Modules(self.front, self.back, self.team, self.jobs, self.neighbours)
        self.timers = Timers(self._periods(), {self._extend_log, *self.modules.pauses})
        self.memory = Memory(self.own, self.team.seal, self.calibration, place)
        self._speaking = {self._repeat, self._send_status, self._send_odometry, self._extend_log}
        self._handlers: dict[type[Any], Callable[[Any], list[Effect]]] = {
            SerialData: self._on_serial,
            CanFrame: self._on_can,
            PortState: self._on_port,
            Datagram: self._on_message,
            ChannelMessage: self._on_message,
            NetworkState: self._on_network,
            Tick: self._on_tick,
            Slept: self._on_slept,
            JobDone: self._on_job,
            SaveDone: self.memory.on_saved,
            Stop: self._on_stop,
        }

    def _periods(self) -> dict[Action, int]:
        """What comes round, and how often, us."""
        config = self.config
        periods: dict[Action, int] = {
            self._repeat: TURN_US if config.optimizer.algorithm == "rbcd" else REPEAT_US,
            self._send_status: SECOND_US,
            self._send_odometry: PLACE_US,
            self._place: PLACE_US,
            self._extend_log: SECOND_US,
            self.modules.relative_poses: round(SECOND_US / config.relative_pose.rate_hz),
            self.modules.what_if: SECOND_US,
            self.modules.consistency: round(SECOND_US / config.consistency.rate_hz),
            self.modules.optimize: round(SECOND_US / config.optimizer.rate_hz),
            self._check_health: SECOND_US,
            lambda utime: [*self.memory.save()]: SAVE_US,
        }
        return {**periods, self._poll_wheels: POLL_US} if self.wheels.must_be_asked else periods

    @property
    def next_tick(self) -> int:
        """When the robot wants to be woken, us."""
        return self.timers.next

    def handle(self, event: Event) -> list[Effect]:
        """Take one event; what follows from it."""
        effects, outbox = self._handlers[type(event)](event), self.outbox
        if self.back.is_looking:
            self.timers.hurry(self.modules.optimize, event.utime)
        if not effects or self.memory.is_listening(event.utime):
            return [e for e in effects if not isinstance(e, Send)]
        return [e for e in effects if not isinstance(e, Send) or outbox.passes(e, event.utime)]

    # sensors

    def _on_serial(self, event: SerialData) -> list[Effect]:
        if event.port == "uwb":
            for sample in self.uwb.feed(event.data, event.utime):
                self.front.on_range(sample)
            return []
        return self._on_motions(self.wheels.feed(event.data, event.utime))

    def _on_can(self, event: CanFrame) -> list[Effect]:
        return self._on_motions(self.wheels.on_frame(event))

    def _on_motions(self, motions: list[Motion]) -> list[Effect]:
        for motion in motions:
            self.front.on_motion(motion)
            self.near.on_motion(motion)
        return [*self.near.send(motions[-1].utime)] if motions else []

    def _on_port(self, event: PortState) -> list[Effect]:
        self.ports[event.port] = event
        level = Level.INFO if event.condition is PortCondition.OPEN else Level.WARNING
        fields = {"state": event.condition.value, "detail": event.detail}
        notes = diagnosis.diagnose(self, event.utime, event.port)
        return [Note(level, f"{event.port}.port", fields), *notes]

    def _poll_wheels(self, utime: int) -> list[Effect]:
        data = self.wheels.poll(utime)
        return [Write("wheels", data)] if data else []

    # the team

    def _on_network(self, event: NetworkState) -> list[Effect]:
        self.network = event
        level, name = (Level.INFO, "network.up") if event.up else (Level.WARNING, "network.down")
        notes = diagnosis.diagnose(self, event.utime, "network")
        return [Note(level, name, {"detail": event.detail}), *notes]

    def _on_message(self, event: Datagram | ChannelMessage) -> list[Effect]:
        received = self.team.receive(event)
        if received is None:
            return []
        self.back.on_start(received.origin)
        if isinstance(received.message, GraphEntry):
            self.back.insert(received.origin, received.message)
            if received.message.closures and self.back.estimate is None:
                return self.modules.optimize(event.utime)
        elif isinstance(received.message, OdometryBatch):
            return self.modules.on_odometry(received.origin.robot, event.utime)
        elif isinstance(received.message, PublicPoses):
            self.back.hear(received.origin, received.message)
            return self._take_turn(event.utime)
        return []

    def _repeat(self, utime: int) -> list[Effect]:
        is_in_a_graph = self.back.estimate is not None or bool(self.neighbours(utime))
        repeats = list(self.team.repeats(utime)) if is_in_a_graph else []
        return [*repeats, *self._take_turn(utime)]

    def _send_status(self, utime: int) -> list[Effect]:
        clock, where = self.uwb.system_offset_us(utime), self.whereabouts(utime)
        neighbours = self.neighbours(utime)
        status = self.broadcast.heartbeat(neighbours, clock, where.state, utime)
        self.neighbourhood.look_again()  # the clocks of peers were compared with ours
        status += self.broadcast.hypotheses(neighbours, utime)
        # solutions come with news; that a pose grew old or doubtful is said without any
        if where.is_old or where.doubt:
            status += self.broadcast.pose(where, utime)
        return status

    def _send_odometry(self, utime: int) -> list[Effect]:
        return self.broadcast.odometry(self.neighbours(utime), utime)

    # our log

    def _extend_log(self, utime: int) -> list[Effect]:
        """One entry of our log: where our wheels went, what we ranged, what module 2 kept."""
        neighbours = self.neighbours(utime)
        is_own_doubted, is_any_doubted = self.standing.is_doubted()
        keyframes = self.front.make_keyframes(is_own_doubted, self.standing.turns_otherwise)
        ranges = self.front.sample_ranges(neighbours, self.back.graph, utime, is_any_doubted)
        closures = self.front.tell_closures()
        if not (keyframes or ranges or closures):
            return []
        if self.team.is_spent or not all(map(is_sayable, keyframes)):
            return [Restart(self.own.epoch, "it has used up the numbers of its messages")]
        entries = self.team.entries(self.front.model, keyframes, ranges, closures)
        said = [self.team.append(entry, utime) for entry in entries]
        for decoded, _ in said:
            self.back.insert(self.own, decoded)
        for chapter in self.team.write_chapters(utime, self.back.graph, aloud=bool(neighbours)):
            self.back.insert(self.own, chapter)
        return [self.team.send_sealed(self.own.robot, s) for _, s in said] if neighbours else []

    # the three modules

    def _place(self, utime: int) -> list[Effect]:
        return self.modules.place(self.standing, self.neighbours(utime), utime)

    def _take_turn(self, utime: int) -> list[Effect]:
        """With `rbcd`: move if it is our turn now, and say what others wait for."""
        exchange = self.back.exchange
        is_due = exchange.is_waiting or self.back.is_urgent
        effects = self.modules.optimize(utime) if is_due else []
        would_move = exchange.is_waiting and not self.jobs.is_resting(OPTIMIZER, utime)
        at_rest = not would_move and not self.jobs.is_busy(OPTIMIZER)
        return [*effects, *self.broadcast.public(exchange.answers(utime, at_rest), utime)]

    def _on_job(self, event: JobDone) -> list[Effect]:
        job = self.jobs.finish(event)
        if job.told is not None:
            is_news = job.told(event.result, event.utime)
            return self._tell_at_once(event.utime) if is_news else []
        if job.tell_pairs(event.result):
            return [e for pair in job.pairs for e in self._hurry(job.module, pair, event.utime)]
        said = self.back.on_solution(event.result, event.utime)
        public = self.broadcast.public(said, event.utime)
        self.calibration.update(self.back.estimate, self.own.robot, self.front.pairs)
        return [*self.broadcast.pose(self.whereabouts(event.utime), event.utime), *public]

    def _hurry(self, module: str, pair: PairTracker, utime: int) -> list[Effect]:
        """What leads to a first pose does not wait for its turn."""
        if pair.is_told:
            return []
        if pair.connected and not pair.is_refused:
            return self._tell_at_once(utime)
        return self.modules.consistency(utime, pair) if module == RELATIVE_POSE else []

    def _tell_at_once(self, utime: int) -> list[Effect]:
        told = [*self._extend_log(utime), *self.modules.optimize_soon(utime)]
        return [*told, *self.broadcast.pose(self.whereabouts(utime), utime)]

    # what we know of ourselves

    def pose(self) -> PoseNow | None:
        """Our latest pose in the frame of the team; None while we are not localised."""
        return self.standing.pose()

    def whereabouts(self, utime: int) -> Whereabouts:
        """What that pose is worth now."""
        return self.standing.whereabouts(utime)

    def _check_health(self, utime: int) -> list[Effect]:
        self.team.forget_silent(utime)
        self.front.watch_ranges(self.neighbours(utime), self.back.graph, self.back.estimate, utime)
        self.back.exchange.keep({peer.chain for peer in self.team.peers.values()})
        self._remember(utime)
        notes: list[Effect] = [*diagnosis.diagnose(self, utime)]
        above = self.team.superseded_by
        if above is None or self.team.namesakes.is_own_id_heard(utime):
            return notes
        # our own memory was lost, or a lie is believed
        return [*notes, Restart(above, "peers know a later start of this robot")]

    def _remember(self, utime: int) -> None:
        place = self.standing.last_place(self.neighbours(utime), utime)
        chain = self.back.graph.chains.get(self.own.robot)
        if chain is not None:
            self.memory.remember(place, int(chain.keyframes.n[-1]))

    # time passes, and ends

    def _on_tick(self, event: Tick) -> list[Effect]:
        due = self.timers.take_due(event.utime)
        if self.memory.is_listening(event.utime):
            due = [action for action in due if action not in self._speaking]
        with self.neighbourhood.held():
            return [effect for action in due for effect in action(event.utime)]

    def _on_slept(self, event: Slept) -> list[Effect]:
        """Nothing was seen meanwhile, and the clocks of the others may have gone elsewhere."""
        self.slept = event
        self.front.interrupt()
        self.team.begin_clocks_again(event.utime)
        return self._check_health(event.utime)

    def _on_stop(self, event: Stop) -> list[Effect]:
        state = self.whereabouts(event.utime).state
        goodbye = self.broadcast.make_status([], None, state, event.utime, leaving=True)
        sends = (self.team.send(goodbye, event.utime) for _ in range(GOODBYES))
        self._remember(event.utime)
        return [*sends, Save(self.memory.state())]
