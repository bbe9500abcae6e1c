"""Our side of the conversation: what comes in is judged and sorted, what goes out is sealed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterator, Sequence, Set

from drslamd.conventions import SECOND_US, Chain
from drslamd.events import ChannelMessage, Datagram, Send
from drslamd.gossip import messages
from drslamd.gossip.bounds import LAST_SEQ, Measurement, is_sayable
from drslamd.gossip.entries.chapter_writer import ChapterWriter, audience_of
from drslamd.gossip.envelopes.opening import Opened, entry_of, opened
from drslamd.gossip.envelopes.splitting import entries_of, parts_of
from drslamd.gossip.log_sync import LogSync
from drslamd.gossip.membership.acquaintance import Acquaintance, vouched
from drslamd.gossip.membership.flood import BUDGET, Flood
from drslamd.gossip.membership.namesakes import Namesakes, unanswered
from drslamd.gossip.membership.refusals import Fault, Refusals
from drslamd.gossip.message_types import Received
from drslamd.gossip.messages import Heard, Message, OdometryBatch, Pose, Status
from drslamd.gossip.peer import Peer, carrier, shared_module
from drslamd.gossip.repeats.allowance import said_of
from drslamd.gossip.repeats.log_repeats import Place
from drslamd.gossip.replicated_log import AHEAD
from drslamd.gossip.seal import Header, Seal, SealFault
from drslamd.gossip.starts import Starts
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.robot_model import RobotModel

FORGET_US = 600 * SECOND_US
"""A peer that was silent for ten minutes is no longer listed."""


class Team:
    """Peers, their logs, and the seal on everything.

    Attributes:
        refused: messages that were turned away, by reason; accepted are those that said something
            new, `repeats_heard` log entries that we had, `own_echoes` what we sent ourselves.
            Together they are all that came.
        unsayable: measurements of ours that were beyond what a message can say.
        last_echo: when we last heard ourselves, which proves that the network carries us.
    """

    def __init__(self, seal: Seal, budget: int = BUDGET) -> None:
        """`budget`: bytes a second that robots of this team may say."""
        self.seal = seal
        self.flood = Flood(budget)
        self.own = Chain(seal.robot, seal.epoch)
        self.logs = LogSync(seal.robot)
        self.peers: dict[int, Peer] = {}
        self.refusals = Refusals()
        self.accepted = 0
        self.unsayable = 0
        self.repeats_heard = 0
        self.own_echoes = 0
        self.last_echo: int | None = None
        self._next_seq = 0
        self._chapters = ChapterWriter()
        self._told_model: RobotModel | None = None
        self._named_last = -1
        """The robot after which the next status goes on, when it cannot name all that are heard."""
        self.starts = Starts(self.own, seal.epochs)
        self.acquaintance = Acquaintance(self.own)
        self.namesakes = Namesakes(self.own)

    @property
    def refused(self) -> Counter[str]:
        return self.refusals.counts

    def send(self, message: Message, utime: int) -> Send:
        """Seal a message."""
        channel = messages.channel(messages.kind_of(message), self.own.robot)
        payload = messages.encode(self.seal.header(utime), message)
        self.logs.repeats.pace.on_air(len(payload), utime, said_of(message), self.own.robot)
        return Send(channel, self.seal.close(channel, payload))

    def send_public(self, public: PublicPoses, utime: int) -> list[Send]:
        """Lifted poses, as many in one message as one datagram takes."""
        return [self.send(part, utime) for part in parts_of(public)]

    def append(self, entry: GraphEntry, utime: int) -> tuple[GraphEntry, bytes]:
        """Put an entry on our own log; the caller sends it when anybody is there to hear it."""
        channel = messages.channel("GRAPH", self.own.robot)
        sealed = self.seal.close(channel, messages.encode(self.seal.header(utime), entry))
        decoded = messages.decode("GRAPH", sealed)
        if not isinstance(decoded, GraphEntry):
            raise AssertionError(f"own graph entry does not decode: {decoded}")
        self.logs.say(self.own, decoded, sealed, utime)
        self._chapters.take(decoded, utime)
        self._next_seq = decoded.seq + 1
        return decoded, sealed

    def entries(
        self,
        model: RobotModel,
        keyframes: Sequence[Keyframe],
        ranges: Sequence[RangeMeasurement],
        closures: Sequence[ClosureMeasurement],
    ) -> Iterator[GraphEntry]:
        """The next entries of our log, a datagram each; what no reader would take is counted."""
        measured: list[Measurement] = [*keyframes, *ranges, *closures]
        measurements = [item for item in measured if is_sayable(item)]
        self.unsayable += len(measured) - len(measurements)
        is_news = model != self._told_model
        self._told_model = model if measurements else self._told_model
        yield from entries_of(model, measurements, self._next_seq, is_news=is_news)

    def write_chapters(self, utime: int, graph: PoseGraph, *, aloud: bool) -> list[GraphEntry]:
        """Entries that follow where a chapter is due; they are said later, if `aloud`."""
        team = audience_of(graph, self.own, 1 + len(self.living(utime)))
        entries = [
            self.append(e, utime)[0] for e in self._chapters.due(self._next_seq, utime, team)
        ]
        for entry in entries if aloud else ():
            self.logs.repeats.say_when_there_is_room(Place(*self.own, entry.seq), utime)
        return entries

    def is_asking(self, utime: int) -> bool:
        """Do we lack odometry that may still come, or entries that are not on their way?"""
        return self.logs.is_asking(utime) or any(p.lacks_odometry for p in self.peers.values())

    def send_sealed(self, owner: int, sealed: bytes) -> Send:
        """A log entry as it was sealed, ours or another's."""
        return Send(messages.channel("GRAPH", owner), sealed)

    def repeats(self, utime: int) -> list[Send]:
        """Log entries that somebody lacks; ask several times a second."""
        return [self.send_sealed(*repeat) for repeat in self.logs.repeats.take_due(utime)]

    def audible(self, utime: int) -> Set[Chain]:
        """Whom we hear."""
        twice, named = self.namesakes.twice(utime), self.namesakes.named(utime)
        alive = (peer.chain for peer in self.everybody.values() if peer.is_alive(utime))
        return {chain for chain in alive if chain.robot not in twice} | named

    @property
    def everybody(self) -> dict[int, Peer]:
        """Peers, and strangers who have not answered this start."""
        return {**self.peers, **self.acquaintance.strangers}

    def next_heard(self, utime: int, needed: Container[int] = ()) -> tuple[Heard, ...]:
        """For our next status: whom we hear, in turn when they are too many.

        Args:
            needed: robots whose odometry we need.
        """
        chains = sorted(self.audible(utime))
        if len(chains) > messages.MAX_HEARD:
            later = [chain for chain in chains if chain.robot > self._named_last]
            chains = (later + chains)[: messages.MAX_HEARD]
            self._named_last = chains[-1].robot
        doubtful = self.namesakes.named(utime)
        return tuple(
            self.peers[chain.robot].named(chain.robot in needed)
            if self._is_peer(chain) and chain not in doubtful
            else unanswered(chain)
            for chain in chains
        )

    def _is_peer(self, chain: Chain) -> bool:
        peer = self.peers.get(chain.robot)
        return peer is not None and peer.chain == chain

    def receive(self, event: Datagram | ChannelMessage) -> Received | None:
        """Judge one datagram; whatever is wrong with it is counted by its reason."""
        found = opened(self.seal, event)
        if not isinstance(found, Opened):
            if isinstance(found, str):
                self.refused[found] += 1
            elif found is not None:
                self._refuse(found, event)
            return None
        header, message, payload, _ = found
        fault = self._fault(found, event)
        if fault is not None:
            self._refuse(fault, event)
            return None
        if not self._is_acquainted(header, message, event):
            self.refused["of a robot that has not answered this start"] += 1
            return None
        origin = Chain(header.origin, header.epoch)
        if isinstance(message, GraphEntry) and not self._is_near(origin, message.seq):
            self.refused["entry far ahead of its log"] += 1
            return None
        # entries of the past come through others, at their cost
        is_late = isinstance(message, GraphEntry) and message.seq < self.logs.end(origin)
        if not (is_late or self.flood.leaves_room(origin.robot, len(payload), event.utime)):
            self.refused["more than the share of one robot"] += 1
            return None
        self.seal.accept(header, once=not isinstance(message, GraphEntry))
        return self._sort(header, message, payload, event.utime)

    def _fault(self, found: Opened, event: Datagram | ChannelMessage) -> Fault | None:
        """Is it of the start that speaks for its robot, and of the only robot of this id?"""
        header, message, utime = found.header, found.message, event.utime
        if not isinstance(message, GraphEntry):
            answers = isinstance(message, Status) and self.acquaintance.answers(message)
            self.namesakes.hear(header, answers, utime, event.sender)
        origin = Chain(header.origin, header.epoch)
        return (
            found.fault
            or self.namesakes.fault(origin.robot, utime)
            or self.starts.judge(origin, self.peers.get(origin.robot), utime)
        )

    def _is_acquainted(
        self, header: Header, message: Message, event: Datagram | ChannelMessage
    ) -> bool:
        """Is it no recording of the past? What a stranger says is remembered only as a voice."""
        origin = Chain(header.origin, header.epoch)
        peer, is_peer = self.peers.get(origin.robot), self._is_peer(origin)
        if isinstance(message, GraphEntry):
            is_begun = self.logs.epoch(origin.robot) == origin.epoch
            return is_begun or is_peer or vouched(origin, self.peers.values())
        if isinstance(message, Status) and self.acquaintance.answers(message):
            self.meet(origin, header.counter, event.utime)
            return True
        if peer is not None and is_peer:
            return not peer.is_past(header.counter)
        self.acquaintance.hear(origin, header.utime, event.utime, event.sender)
        if isinstance(message, Status):
            self.acquaintance.read(origin, message, event.utime)
            # who holds us for a later start does not hear us, and cannot answer
            self.starts.on_status(origin.robot, message, self._said(), event.utime)
        return False

    def meet(self, origin: Chain, counter: int, utime: int) -> None:
        """A robot has answered this start, with the message that has this counter."""
        peer = self.peers.get(origin.robot)
        if peer is None or peer.chain != origin:
            peer = self.peers[origin.robot] = self.acquaintance.met(origin, utime)
            self.logs.begin(origin)
        peer.answered(counter)

    def _is_near(self, origin: Chain, seq: int) -> bool:
        """Is it near the end of its log as we, or the latest status of any peer, know it?"""
        return self.logs.is_near(origin, seq) or any(
            seq < peer.newest_of(origin) + AHEAD for peer in self.peers.values()
        )

    def _refuse(self, fault: Fault, event: Datagram | ChannelMessage) -> None:
        """Count a message that is not to be heard; our own echo is none that anybody refused."""
        if fault is SealFault.OWN:
            self.own_echoes += 1
            self.last_echo = event.utime
            self.logs.on_echo(self.own, entry_of(event), event.utime)
            return
        self.refusals.add(fault, event.utime, event.sender)

    def _sort(self, header: Header, message: Message, sealed: bytes, utime: int) -> Received | None:
        origin = Chain(header.origin, header.epoch)
        latest = self.peers[origin.robot].latest_counter if self._is_peer(origin) else None
        said, pace = said_of(message, header.counter, latest), self.logs.repeats.pace
        pace.on_air(len(sealed), utime, said, header.origin, heard=True)
        if isinstance(message, GraphEntry):
            # may come late and from a relay: says nothing of its origin's clock or life
            if not self.logs.add(origin, message.seq, sealed, utime, message.chapter):
                self.repeats_heard += 1
                return None
            self.accepted += 1
            return Received(origin, message)
        self.accepted += 1
        peer = self.peers[origin.robot]
        peer.on_message(header.utime, utime)
        if isinstance(message, Status):
            self._status(peer, message, header.counter, utime)
        elif isinstance(message, OdometryBatch):
            peer.extend_track(message, utime)
        elif isinstance(message, Pose):
            peer.take_pose(message, header.counter)
        return Received(origin, message)

    def _status(self, peer: Peer, status: Status, counter: int, utime: int) -> None:
        if not peer.take_status(status, counter, self.own, utime):
            return
        self.namesakes.on_status(peer.chain.robot, status, utime)
        if not peer.waits_for(self.own):
            self.logs.repeats.pace.reckon([p.usual_loss for p in self.living(utime).values()])
            self.logs.on_states(status.logs, peer.chain.robot, utime)
            self._chapters.on_states(self.own, status.logs)
        self.starts.on_status(peer.chain.robot, status, self._said(), utime)

    def _said(self) -> int | None:
        return self._next_seq if self.seal.has_spoken else None

    @property
    def superseded_by(self) -> int | None:
        """A start of ours above which we have to begin again: our messages are refused as old."""
        return self.starts.superseded_by()

    @property
    def is_spent(self) -> bool:
        """Does this start run out of numbers for its messages or its log?"""
        return self.seal.is_spent or self._next_seq >= LAST_SEQ

    def living(self, utime: int) -> dict[int, Peer]:
        """Peers that are alive, hear us and share no id; nobody while we share ours."""
        twice = self.namesakes.twice(utime)
        if self.own.robot in twice:
            return {}
        alive = ((r, p) for r, p in self.peers.items() if p.is_alive(utime) and p.hears(self.own))
        return {robot: peer for robot, peer in alive if robot not in twice}

    def present(self, utime: int) -> set[int]:
        """Robots that live: those we talk to, and those that they vouch for."""
        direct = self.living(utime)
        audible = {chain for peer in direct.values() for chain in peer.audible}
        vouched_for = {c.robot for c in audible if c.epoch == self.logs.epoch(c.robot)}
        return set(direct) | (vouched_for - self.namesakes.twice(utime)) | {self.own.robot}

    def compare_radio_clocks(self, own_minus_system: int | None, utime: int) -> None:
        """Use LinkTrack's system_time, where both sides know their clock against it."""
        if own_minus_system is not None:
            for peer in self.peers.values():
                peer.compare_radio_clock(own_minus_system, utime)

    def begin_clocks_again(self, utime: int) -> None:
        """Our own clock may have jumped."""
        for peer in self.peers.values():
            peer.clock.begin_again(utime)

    def conditions(self, utime: int) -> list[tuple[str, str | None]]:
        """What is wrong with the conversation, by key, in sentences with a remedy."""
        return [
            *self.refusals.conditions(utime),
            *self.namesakes.conditions(utime),
            ("team.flood", self.flood.sentence(utime)),
            ("team.recording", self.acquaintance.recording(utime)),
            ("team.uwb_id", shared_module(self.peers.values(), utime)),
        ]

    def robot_of_uwb(self, uwb_id: int) -> int | None:
        """The robot that carries this UWB module, None when it is not (yet) known."""
        return carrier(self.peers.values(), uwb_id)

    def forget_silent(self, utime: int) -> None:
        """Drop the peers that were not heard for long; their logs remain."""
        for robot in [r for r, p in self.peers.items() if utime - p.last_heard > FORGET_US]:
            del self.peers[robot]
        self.acquaintance.forget_silent(utime)
