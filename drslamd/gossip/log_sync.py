"""The logs of all robots: holding the same logs is holding the same graph.

What a robot adds to the pose graph is a log: messages numbered from 0 within its epoch. So loss,
order and repetition cannot change a result. Each status names how far its sender has got with every
log; `log_repeats` says who then repeats what is missing.
"""

from __future__ import annotations

from drslamd.conventions import MILLISECOND_US, SECOND_US, Chain
from drslamd.gossip.message_types import LogState
from drslamd.gossip.repeats import log_rows
from drslamd.gossip.repeats.allowance import Speech
from drslamd.gossip.repeats.log_repeats import REPEATS_AT_ONCE, LogRepeats
from drslamd.gossip.replicated_log import AHEAD, ReplicatedLog
from drslamd.slam.graph.measurements import Chapter, GraphEntry

ECHO_US = 200 * MILLISECOND_US
"""So late at most we hear ourselves."""
MUCH = 650
"""Bytes of a large repeat: where there is no room for it, others say again what they can."""


class LogSync:
    """Logs by robot; only the newest epoch of each is kept."""

    def __init__(self, robot: int) -> None:
        self._robot = robot
        self._logs: dict[int, ReplicatedLog] = {}
        self._turn = 0
        self._asked, self._came, self._came_utime = 0, 0, -(1 << 62)
        """Entries that our last status asked for, those that came since, and when the last did."""
        self.repeats = LogRepeats(robot, self._logs)

    def begin(self, origin: Chain) -> bool:
        """A start of a robot was heard of; False when we know of a later one."""
        log = self._logs.get(origin.robot)
        if log is None or origin.epoch > log.epoch:
            self._logs[origin.robot] = ReplicatedLog(origin.epoch)
            return True
        return origin.epoch == log.epoch

    def is_near(self, origin: Chain, seq: int) -> bool:
        """Is an entry so near to what is known of its log that it may be taken?"""
        log = self._logs.get(origin.robot)
        known = log.newest if log is not None and log.epoch == origin.epoch else 0
        return seq < known + AHEAD

    def add(
        self, origin: Chain, seq: int, sealed: bytes, utime: int, chapter: Chapter | None = None
    ) -> bool:
        """Take one entry; False when it is not new.

        Args:
            origin: robot and epoch that made it.
            sealed: the message as it came, to be repeated unchanged.
            chapter: what it says, if it is part of one.
        """
        if not self.begin(origin):
            return False
        log = self._logs[origin.robot]
        if seq < log.first:
            return False
        new = not log.is_known(seq)
        if new:
            if seq < log.newest:
                self._came, self._came_utime = self._came + 1, utime
            log.put(seq, sealed, chapter)
        if log.is_held(seq):
            log.aired[seq] = utime
        return new

    def say(self, own: Chain, entry: GraphEntry, sealed: bytes, utime: int) -> None:
        """An entry of our own; chapters are said as if they were repeated, when there is room."""
        self.add(own, entry.seq, sealed, utime, entry.chapter)
        if entry.chapter is None:
            self.repeats.pace.on_air(len(sealed), utime, Speech.NEW, own.robot)
            self.repeats.push(entry.seq, utime)

    def on_echo(self, own: Chain, came: tuple[GraphEntry, bytes] | None, utime: int) -> None:
        """Something came back that says it is of ours: an entry that somebody said again need not
        be said by us. What we no longer hold, as a chapter says it, is on the air like the rest."""
        log = self._logs.get(own.robot)
        if came is None or log is None:
            return
        seq, size = came[0].seq, len(came[1])
        is_held = log.sealed.get(seq) == came[1]
        if not is_held or utime - log.aired[seq] > ECHO_US:
            self.repeats.pace.on_air(size, utime, Speech.AGAIN, own.robot, heard=True)
        if is_held:
            log.aired[seq] = utime

    def next_states(self) -> tuple[LogState, ...]:
        """For our status: our own log, and those of the others, in turn when they are too many.
        Where there is room, what is held beyond a gap follows in rows of its own."""
        others = sorted(robot for robot in self._logs if robot != self._robot)
        turn = self._turn % max(1, len(others))
        own = [self._robot] if self._robot in self._logs else []
        rows = log_rows.rows(self._logs, own + others[turn:] + others[:turn])
        named = {row.id for row in rows}
        is_whole = len(named) == len(self._logs)
        self._turn = 0 if is_whole else turn + len(named) - len(own)
        logs = (self._logs[robot] for robot in named)
        self._asked = sum(min(log.newest - log.complete, REPEATS_AT_ONCE) for log in logs)
        self._came = 0
        return tuple(rows)

    def epoch(self, robot: int) -> int | None:
        log = self._logs.get(robot)
        return log.epoch if log else None

    def end(self, origin: Chain) -> int:
        """One past the last entry that is held of a start."""
        log = self._logs.get(origin.robot)
        return log.end if log is not None and log.epoch == origin.epoch else 0

    def known_below(self, origin: Chain) -> int:
        """The first entry of a start that is lacked, or one past the last."""
        log = self._logs.get(origin.robot)
        return log.complete if log is not None and log.epoch == origin.epoch else 0

    def is_known(self, origin: Chain, seq: int) -> bool:
        """Is an entry of a start here, or what a chapter says of it?"""
        log = self._logs.get(origin.robot)
        return log is not None and log.epoch == origin.epoch and log.is_known(seq)

    @property
    def bytes_held(self) -> int:
        """Of all logs."""
        return sum(len(sealed) for log in self._logs.values() for sealed in log.sealed.values())

    def lacking(self, robot: int) -> int:
        """Entries of a robot's log that we know of and do not hold."""
        log = self._logs.get(robot)
        return log.lacking if log else 0

    def lacks_any(self) -> bool:
        """Do we know of entries, of anybody's, that we do not hold?"""
        return any(log.complete < log.newest for log in self._logs.values())

    def is_filling(self, utime: int) -> bool:
        """Are the entries that our last status asked for on their way?"""
        expected = (1 - self.repeats.pace.loss) * self._asked
        return self._came < expected and utime - self._came_utime < 2 * SECOND_US

    def is_asking(self, utime: int) -> bool:
        """Do we lack entries that are not on their way, and has the channel room for them?"""
        is_waiting = self.lacks_any() and not self.is_filling(utime)
        return is_waiting and self.repeats.pace.has_room(utime, MUCH, is_one_of_many=True)

    def on_states(self, states: tuple[LogState, ...], sender: int, utime: int) -> None:
        """A peer said what it holds: learn what we lack, plan to repeat what it lacks."""
        first_rows = {state.id: state for state in reversed(states)}
        for theirs in first_rows.values():
            log = self._logs.get(theirs.id)
            if log is not None and theirs.epoch == log.epoch:
                self._learn(log, theirs, is_owner=theirs.id == sender)
        left_out = self._logs.keys() - first_rows if log_rows.leaves_any_out(states) else set()
        self.repeats.on_status(sender, log_rows.holdings(states), left_out, utime)

    def _learn(self, log: ReplicatedLog, theirs: LogState, is_owner: bool) -> None:
        if theirs.id == self._robot:
            return
        if not is_owner:
            log.on_hearsay(theirs.newest)
        elif theirs.newest < log.first:
            # all that we hold lies beyond what its owner has made: it is somebody else's
            self._logs[theirs.id] = ReplicatedLog(log.epoch)
        else:
            log.on_owner(theirs.first, theirs.newest)
