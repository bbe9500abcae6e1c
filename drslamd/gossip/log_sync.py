"""The logs of all robots: holding the same logs is holding the same graph.

What a robot adds to the pose graph is a log: messages numbered from 0 within its epoch. So loss,
order and repetition cannot change a result. Each status names how far its sender has got with every
log; `log_repeats` says who then repeats what is missing.
"""

from __future__ import annotations

from drslamd.conventions import Chain
from drslamd.gossip.log_repeats import LogRepeats
from drslamd.gossip.message_types import MAX_LOGS, LogState
from drslamd.gossip.replicated_log import AHEAD, ReplicatedLog
from drslamd.slam.graph.measurements import Chapter, GraphEntry


class LogSync:
    """Logs by robot; only the newest epoch of each is kept."""

    def __init__(self, robot: int) -> None:
        self._robot = robot
        self._logs: dict[int, ReplicatedLog] = {}
        self._turn = 0
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
            log.put(seq, sealed, chapter)
        if log.is_held(seq):
            log.aired[seq] = utime
        return new

    def say(self, own: Chain, entry: GraphEntry, sealed: bytes, utime: int) -> None:
        """An entry of our own; chapters are said as if they were repeated, when there is room."""
        self.add(own, entry.seq, sealed, utime, entry.chapter)
        if entry.chapter is None:
            self.repeats.pace.on_air(len(sealed), utime)

    def next_states(self) -> tuple[LogState, ...]:
        """For our status: our own log, and those of the others, in turn when they are too many."""
        others = sorted(robot for robot in self._logs if robot != self._robot)
        named = [self._robot] if self._robot in self._logs else []
        room = MAX_LOGS - len(named)
        if len(others) > room:
            start = self._turn % len(others)
            others = (others[start:] + others[:start])[:room]
            self._turn = start + room
        return tuple(
            LogState(robot, log.epoch, log.start, log.complete, log.newest)
            for robot, log in ((robot, self._logs[robot]) for robot in named + others)
        )

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

    def on_states(self, states: tuple[LogState, ...], sender: int, utime: int) -> None:
        """A peer said what it holds: learn what we lack, plan to repeat what it lacks."""
        for theirs in states:
            log = self._logs.get(theirs.id)
            if log is not None and theirs.epoch == log.epoch:
                self._learn(log, theirs, is_owner=theirs.id == sender)
        named = {state.id: state for state in states}
        left_out = self._logs.keys() - named if len(states) == MAX_LOGS else set()
        self.repeats.on_status(sender, named, left_out, utime)

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
