"""What holds after every event, whatever happens: the promises P1 to P8, each with its number.

    P1  no input ends a robot                  P5  what is not proven changes only counters
    P2  a valid pose is finite and of now      P6  the same entries make the same graph
    P3  every datagram is counted once         P7  the same events lead to the same effects
    P4  containers keep to their bounds        P8  a number is used once

P9 and P10 are about processes: configuration errors, and how fast a daemon starts and stops.
"""

from __future__ import annotations

import math
import pickle
from collections import defaultdict, deque
from collections.abc import Sized
from dataclasses import replace
from hashlib import blake2b
from typing import Any

from drslamd.conditions.health import MAX_CONDITIONS
from drslamd.conventions import MAX_ROBOT_ID, SECOND_US
from drslamd.events import Datagram, Effect, Event, JobDone, Restart, Send, Solve
from drslamd.gossip import messages, seal
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.gossip.repeats.log_repeats import MAX_PLANNED
from drslamd.gossip.replicated_log import MAX_ENTRIES
from drslamd.robot import Robot
from drslamd.sensors.frame_scanner import MAX_BUFFER_BYTES
from drslamd.slam.relative_pose.range_buffer import MAX_UWB_IDS
from lab.play.simulator import Disk, Member, Simulator
from lab.soak import agreement

VALID_US = SECOND_US
"""A pose that is older is not localised."""
_FINGERPRINTS = {kind: frozenset([value]) for kind, value in messages.FINGERPRINTS.items()}


class Broken(Exception):
    """A promise that was not kept: its number, and what was seen."""

    def __init__(self, promise: str, robot: int, what: str) -> None:
        super().__init__(f"{promise}: robot {robot}: {what}")
        self.promise, self.robot = promise, robot


def sizes(robot: Robot) -> dict[str, tuple[int, int]]:
    """Containers that the world fills: how much is in them, and how much may be."""
    team, robots = robot.team, MAX_ROBOT_ID + 1
    out: dict[str, tuple[Sized, int]] = {
        "peers": (team.peers, robots),
        "epochs": (team.seal.epochs, robots),
        "windows": (team.seal._windows, robots),
        "logs": (team.logs._logs, robots),
        "chains": (robot.back.graph.chains, robots),
        "ranges": (robot.front.ranges, MAX_UWB_IDS),
        "pairs": (robot.front.pairs, robots),
        "conditions": (robot.health._conditions, MAX_CONDITIONS),
        "reasons": (team.refused, 64),
        "jobs": (robot.jobs._under_way, 2 * robots),
        "scanner": (robot.uwb._scanner._rest, MAX_BUFFER_BYTES),
        "namesakes": (team.namesakes._voices, robots),
        "planned": (team.logs.repeats._planned, MAX_PLANNED),
    }
    out |= {f"log of {owner}": (log.sealed, MAX_ENTRIES) for owner, log in team.logs._logs.items()}
    return {name: (len(what), most) for name, (what, most) in out.items()}


def imprint(robot: Robot) -> bytes:
    """All that datagrams may change, without counters of what was refused."""
    team = robot.team
    what = (
        team.seal,
        team.peers,
        team.namesakes.latest,
        sorted(agreement.held(robot).items()),
        agreement.whole_digest(robot),
    )
    return blake2b(pickle.dumps(what), digest_size=16).digest()


class Numbers:
    """P8: which numbers were used, by everybody, over all starts."""

    def __init__(self) -> None:
        self._latest: dict[int, tuple[int, int]] = {}
        self._entries: dict[int, dict[int, bytes]] = {}

    def use(self, header: seal.Header, kind: str, payload: bytes) -> str:
        """A message that a robot made leaves it; what is wrong with its number."""
        epoch, counter = self._latest.get(header.origin, (-1, 0))
        digest = blake2b(payload, digest_size=8).digest()
        entries = self._entries.setdefault(header.origin, {})
        if header.epoch == epoch and header.counter <= counter:
            is_repeated = kind == "GRAPH" and entries.get(header.counter, digest) == digest
            return "" if is_repeated else f"number {header.counter} of epoch {epoch} again"
        if header.epoch < epoch:
            return f"epoch {header.epoch} after {epoch}"
        if header.epoch > epoch:
            entries.clear()
        self._latest[header.origin] = header.epoch, header.counter
        if kind == "GRAPH":
            entries[header.counter] = digest
        return ""


class Journal:
    """P7: all events of a robot, and what followed from each."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.events: list[Event] = []
        self.answers: list[bytes] = []

    def add(self, event: Event, effects: list[Effect]) -> None:
        self.events.append(event)
        self.answers.append(_digest(effects))

    def first_difference(self, fresh: Robot) -> int | None:
        """Play it to a robot that has not begun; the event to which it answers otherwise."""
        results: dict[int, Any] = {}
        for k, (event, answer) in enumerate(zip(self.events, self.answers, strict=True)):
            if isinstance(event, JobDone):
                # computed anew, because the robot goes on to write into what it was given
                event = replace(event, result=results.pop(event.job_id))
            effects = fresh.handle(event)
            if _digest(effects) != answer:
                return k
            results |= {e.job_id: e.run() for e in effects if isinstance(e, Solve)}
        return None


def _digest(effects: list[Effect]) -> bytes:
    said = [(e.job_id, e.name) if isinstance(e, Solve) else e for e in effects]
    return blake2b(repr(said).encode(), digest_size=8).digest()


class Invariants:
    """Watches a simulator; raises `Broken`.

    Attributes:
        bytes_sent: by second of the run, of all robots.
    """

    def __init__(self, simulator: Simulator, keeps_journal: bool) -> None:
        self._simulator = simulator
        self._keeps_journal = keeps_journal
        self._received: dict[Disk, tuple[Robot, int]] = {}
        """By computer, which is its disk; so are the numbers that were used."""
        self._numbers: dict[Disk, Numbers] = defaultdict(Numbers)
        self._sent = b""
        """A digest of all that was sent, each over the one before: a hash cannot be put aside."""
        self.journals: dict[int, tuple[Member, Journal]] = {}
        self.bytes_sent: deque[int] = deque([0], maxlen=1_000)
        self.seconds = 0
        simulator.watchers.append(self.after)

    @property
    def digest(self) -> str:
        """Of all that was sent so far."""
        return self._sent.hex()

    def after(self, member: Member, event: Event, effects: list[Effect]) -> None:
        """An event was handled."""
        robot = member.robot
        if isinstance(event, Datagram):
            self._count(member)
        for effect in effects:
            if isinstance(effect, Send):
                self._on_send(member, event.utime, effect)
        if any(isinstance(effect, Restart) for effect in effects):
            self.journals.pop(id(member), None)
        elif self._keeps_journal:
            if id(member) not in self.journals and not isinstance(event, JobDone):
                self.journals[id(member)] = member, Journal(robot)
            if id(member) in self.journals:
                self.journals[id(member)][1].add(event, effects)

    def _count(self, member: Member) -> None:
        robot, team = member.robot, member.robot.team
        known, count = self._received.get(member.disk, (robot, 0))
        count = count + 1 if known is robot else 1
        self._received[member.disk] = robot, count
        counted = team.accepted + team.repeats_heard + team.own_echoes + sum(team.refused.values())
        if counted != count:
            raise Broken("P3", robot.own.robot, f"{count} datagrams came, {counted} were counted")

    def _on_send(self, member: Member, utime: int, effect: Send) -> None:
        robot = member.robot
        said = self._sent + effect.channel.encode() + effect.payload
        self._sent = blake2b(said, digest_size=8).digest()
        self.bytes_sent[-1] += len(effect.payload)
        kind = messages.kind_of_channel(effect.channel)
        if kind is None:
            raise Broken("P3", robot.own.robot, f"speaks on {effect.channel}")
        header = seal.header_of(effect.payload, _FINGERPRINTS[kind])
        if isinstance(header, seal.SealFault):
            raise Broken("P3", robot.own.robot, f"says what is refused: {header.value}")
        if header.origin != robot.own.robot:
            return
        fault = self._numbers[member.disk].use(header, kind, effect.payload)
        if fault:
            raise Broken("P8", robot.own.robot, fault)
        if kind == "POSE":
            self._on_pose(robot, utime, messages.decode(kind, effect.payload))

    def _on_pose(self, robot: Robot, utime: int, pose: object) -> None:
        own = robot.own.robot
        if not isinstance(pose, Pose):
            raise Broken("P2", own, f"says a pose that nobody takes: {pose}")
        if not all(map(math.isfinite, (*pose.pose, *pose.covariance))):
            raise Broken("P2", own, f"says {pose.pose}")
        if min(pose.covariance[0], pose.covariance[3], pose.covariance[5]) <= 0:
            raise Broken("P2", own, f"claims the covariance {pose.covariance}")
        age_us = utime - pose.pose_utime
        if pose.state is PoseState.LOCALISED and age_us > VALID_US:
            raise Broken("P2", own, f"calls a pose localised that is {age_us / 1e6:.1f} s old")

    def look(self) -> None:
        """A second has passed."""
        self.bytes_sent.append(0)
        self.seconds += 1
        robots = [m.robot for m in self._simulator.members.values() if m.running]
        for robot in robots:
            for name, (count, most) in sizes(robot).items():
                if count > most:
                    raise Broken("P4", robot.own.robot, f"{count} {name}, at most {most}")
        _, unequal = agreement.compared(robots)
        for one, other in unequal:
            raise Broken("P6", one, f"holds what robot {other} holds and has another graph")

    def end(self) -> None:
        """The run is over: everything once more (P7)."""
        for member, journal in self.journals.values():
            fresh = member.renew(journal.robot.own.epoch)
            k = journal.first_difference(fresh)
            if k is not None:
                name = type(journal.events[k]).__name__
                raise Broken("P7", fresh.own.robot, f"answers otherwise to event {k}, a {name}")
