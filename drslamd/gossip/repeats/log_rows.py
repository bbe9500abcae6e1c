"""Which logs a status names, and how much it says of what is held beyond their gaps.

Whoever holds more logs than have room names them in turn; and what it says of gaps goes before
more names, because of a log of which it tells nothing but where the first gap is it would get again
what it has. A status that has room for another log leaves none out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from drslamd.gossip.entries import stretches
from drslamd.gossip.message_types import LOG_BYTES, MAX_BEYOND, MAX_LOGS, LogState
from drslamd.gossip.replicated_log import ReplicatedLog

ROOM = LOG_BYTES * MAX_LOGS
"""Bytes of logs and of gaps, without the one of each log that says how many stretches follow."""
USUAL_BYTES = 14
"""About the gaps of a log where many have some, seven stretches or fewer: so seventeen logs fill a
status and what it may say of gaps."""


class Holding(NamedTuple):
    """What a peer says it holds of one log: all before `complete`, and what lies beyond a gap."""

    epoch: int
    complete: int
    beyond: tuple[tuple[int, int], ...] = ()

    def has(self, seq: int) -> bool:
        return seq < self.complete or any(first <= seq < end for first, end in self.beyond)


def holdings(states: Iterable[LogState]) -> dict[int, Holding]:
    """By robot, of the rows of a status: the first one of a log says where its first gap is."""
    out: dict[int, Holding] = {}
    for row in states:
        known = out.setdefault(row.id, Holding(row.epoch, row.complete))
        if row.epoch == known.epoch and row.first > known.complete:
            out[row.id] = known._replace(beyond=(*known.beyond, (row.first, row.complete)))
    return out


def rows(logs: Mapping[int, ReplicatedLog], order: Sequence[int]) -> list[LogState]:
    """Rows of as many logs as have room.

    Args:
        order: in which they are named, all of them.
    """
    lacking = sum(log.complete < log.newest for log in logs.values())
    # (with room for one log more none seems to be left out)
    spare = min(MAX_BEYOND - MAX_LOGS, LOG_BYTES * (MAX_LOGS - 1 - len(order)))
    share = max(USUAL_BYTES, spare // max(1, lacking))
    room, of_gaps, out = ROOM, MAX_BEYOND - MAX_LOGS, list[LogState]()
    for robot in order:
        if room < LOG_BYTES:
            break
        room -= LOG_BYTES
        found = _rows_of(robot, logs[robot], min(share, room, of_gaps))
        told = stretches.size(found) - 1
        room, of_gaps = room - told, of_gaps - told
        out += found
    return out


def _rows_of(robot: int, log: ReplicatedLog, most: int) -> list[LogState]:
    """Of one log, with as much about gaps as so many bytes say: its end, which is heard as it is
    said and must not look as if it were lacked, then from the first gap on."""
    out = [LogState(robot, log.epoch, log.start, log.complete, log.newest)]
    told = log.stretches() if log.complete < log.newest else []
    for first, end in [*told[-1:], *told[:-1]]:
        row = LogState(robot, log.epoch, first, end, log.newest)
        more = sorted([*out, row], key=lambda row: row.complete)
        if stretches.size(more) - 1 > most:
            break
        out = more
    return out


def leaves_any_out(states: Sequence[LogState]) -> bool:
    """Had a status no room for another log?"""
    first, about_gaps = stretches.packed(states)
    used = LOG_BYTES * len(first) + len(about_gaps) - len(first)
    return used + LOG_BYTES > ROOM
