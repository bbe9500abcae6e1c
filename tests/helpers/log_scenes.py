"""Logs for tests: entries of a made-up owner, held and lacked."""

from __future__ import annotations

from message_builders import SECOND

from drslamd.conventions import Chain
from drslamd.gossip.log_sync import LogSync
from drslamd.gossip.message_types import LogState
from drslamd.gossip.repeats.log_repeats import REPEATS_AT_ONCE

OWNER, PEER, OTHER = Chain(3, 1), Chain(5, 1), Chain(6, 1)
T0 = 100 * SECOND


def said(owner: Chain, seq: int) -> bytes:
    return b"%d.%d.%d" % (*owner, seq)


def holding(robot: int, owner: Chain, *seqs: int, utime: int = 0) -> LogSync:
    """What robot `robot` knows after it took these entries."""
    logs = LogSync(robot)
    for seq in seqs:
        assert logs.add(owner, seq, said(owner, seq), utime)
    return logs


def state(
    owner: Chain, complete: int = 0, newest: int | None = None, first: int = 0
) -> tuple[LogState, ...]:
    """The status of somebody who holds this much of one log."""
    return (LogState(*owner, first, complete, complete if newest is None else newest),)


def repeated(logs: LogSync, utime: int) -> list[bytes]:
    return [sealed for _, sealed in logs.repeats.take_due(utime)]


def all_repeated(logs: LogSync) -> list[bytes]:
    """Everything that a newcomer without anything gets, status by status."""
    out: list[bytes] = []
    (held,) = logs.next_states()
    for complete in range(held.first, held.complete, REPEATS_AT_ONCE):
        logs.on_states(state(OWNER, complete), OTHER.robot, T0 + complete * SECOND)
        out += repeated(logs, T0 + (complete + 2) * SECOND)
    return out
