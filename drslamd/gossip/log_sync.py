"""The logs of all robots, and what to repeat to whom.

What a robot adds to the pose graph is a log: messages numbered from 0 within its epoch. Holding
the same logs is holding the same graph, so loss, order and repetition cannot change a result. Each
status names how far the sender has got with every log; whoever holds what it lacks sends it
again, sealed as it came: at once when it is the owner's own log, a little later and only if nobody
else did when it is someone else's.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import islice

from drslamd.conventions import MILLISECOND_US, Chain
from drslamd.gossip.messages import MAX_LOGS, LogState
from drslamd.slam.items import GraphEntry

MAX_ENTRIES = 36_000
"""Of one log: ten hours at one entry a second, about 9 MB; the oldest go first."""
REPEATS_AT_ONCE = 12
"""Entries repeated to one lagging peer for each of its statuses: a robot that comes back after an
hour catches up in five minutes without crowding the channel."""
QUIET_US = 800 * MILLISECOND_US
"""An entry that was on the air so recently is not repeated again."""
RELAY_DELAY_US = 300 * MILLISECOND_US
"""How long a relay waits for the owner to repeat its own entry."""


@dataclass
class _Log:
    epoch: int
    entries: dict[int, GraphEntry] = field(default_factory=dict)
    sealed: dict[int, bytes] = field(default_factory=dict)
    aired: dict[int, int] = field(default_factory=dict)
    first: int = 0
    complete: int = 0
    newest: int = 0


class LogSync:
    """Logs by robot; only the newest epoch of each is kept."""

    def __init__(self, robot: int) -> None:
        self._robot = robot
        self._logs: dict[int, _Log] = {}
        self._repeats: deque[tuple[int, int, int, int]] = deque(maxlen=20 * REPEATS_AT_ONCE)
        """(due, robot, epoch, seq)"""
        self.repeated = 0

    def add(self, origin: Chain, entry: GraphEntry, sealed: bytes, utime: int) -> bool:
        """Take one entry; False when it is not new.

        Args:
            origin: robot and epoch that made it.
            sealed: the message as it came, to be repeated unchanged.
        """
        log = self._logs.get(origin.robot)
        if log is None or origin.epoch > log.epoch:
            log = self._logs[origin.robot] = _Log(origin.epoch)
        if origin.epoch < log.epoch or entry.seq < log.first:
            return False
        log.aired[entry.seq] = utime
        if entry.seq in log.entries:
            return False
        log.entries[entry.seq], log.sealed[entry.seq] = entry, sealed
        log.newest = max(log.newest, entry.seq + 1)
        self._advance(log)
        return True

    def _advance(self, log: _Log) -> None:
        while log.complete in log.entries:
            log.complete += 1
        while log.complete - log.first > MAX_ENTRIES:
            for table in (log.entries, log.sealed, log.aired):
                table.pop(log.first, None)
            log.first += 1

    def states(self) -> tuple[LogState, ...]:
        """For our status: our own log first, then those of the lowest ids."""
        order = sorted(self._logs, key=lambda robot: (robot != self._robot, robot))
        return tuple(
            LogState(robot, log.epoch, log.first, log.complete, log.newest)
            for robot, log in ((r, self._logs[r]) for r in order[:MAX_LOGS])
        )

    def epoch(self, robot: int) -> int | None:
        log = self._logs.get(robot)
        return log.epoch if log else None

    def lacking(self, robot: int) -> int:
        """Entries of a robot's log that we know of and do not hold."""
        log = self._logs.get(robot)
        return log.newest - log.first - len(log.entries) if log else 0

    def peer_holds(self, states: tuple[LogState, ...], sender: int, utime: int) -> None:
        """A peer said what it holds: learn what we lack, plan to repeat what it lacks."""
        named = {state.id: state for state in states}
        for robot, state in named.items():
            log = self._logs.get(robot)
            if log is None or log.epoch < state.epoch:
                continue
            if log.epoch == state.epoch:
                log.newest = max(log.newest, state.newest)
                if robot == sender and state.first > log.complete:
                    self._skip(log, state.first)
        for robot, log in self._logs.items():
            theirs = named.get(robot)
            if theirs is None or theirs.epoch < log.epoch:
                start = log.first
            elif theirs.epoch == log.epoch:
                start = max(theirs.complete, log.first)
            else:
                continue
            if robot != sender:
                self._plan(robot, log, start, utime)

    def _skip(self, log: _Log, first: int) -> None:
        """The owner itself no longer holds what we lack."""
        for seq in [s for s in log.entries if s < first]:
            for table in (log.entries, log.sealed, log.aired):
                table.pop(seq, None)
        log.first = log.complete = first
        self._advance(log)

    def _plan(self, robot: int, log: _Log, start: int, utime: int) -> None:
        own = robot == self._robot
        due = utime if own else utime + RELAY_DELAY_US * (1 + self._robot % 4)
        wanted = (seq for seq in range(start, log.newest) if seq in log.sealed)
        self._repeats.extend(
            (due, robot, log.epoch, seq) for seq in islice(wanted, REPEATS_AT_ONCE)
        )

    def due(self, utime: int) -> list[tuple[int, bytes]]:
        """What to repeat now: owner's id and sealed message."""
        out = []
        for _ in range(len(self._repeats)):
            due, robot, epoch, seq = self._repeats.popleft()
            if due > utime:
                self._repeats.append((due, robot, epoch, seq))
                continue
            log = self._logs.get(robot)
            if log is None or log.epoch != epoch or seq not in log.sealed:
                continue
            if utime - log.aired.get(seq, -QUIET_US) >= QUIET_US:
                log.aired[seq] = utime
                self.repeated += 1
                out.append((robot, log.sealed[seq]))
        return out
