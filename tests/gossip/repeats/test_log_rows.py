"""Which logs a status names, and what it says of them."""

from __future__ import annotations

from log_scenes import OWNER, state

from drslamd.conventions import Chain
from drslamd.gossip.message_types import LogState
from drslamd.gossip.repeats.log_rows import Holding, holdings, leaves_any_out, rows
from drslamd.gossip.replicated_log import ReplicatedLog


def a_log(*held: int) -> ReplicatedLog:
    log = ReplicatedLog(1)
    for seq in held:
        log.put(seq, b"")
    return log


def test_rows_of_another_start_say_nothing_of_this_one() -> None:
    rows = state(OWNER, 2) + state(Chain(3, 2), 9, first=5) + state(OWNER, 1, first=0)
    assert holdings(rows) == {3: Holding(1, 2)}


def test_a_status_with_room_for_another_log_leaves_none_out() -> None:
    """26 logs and 22 bytes about gaps are as long as 27."""
    for logs, gaps, is_full in ((27, 0, False), (28, 0, True), (26, 11, False), (26, 12, True)):
        rows = [LogState(robot, 1, 0, 0, 50) for robot in range(logs)]
        rows += [LogState(logs - 1, 1, k, k + 1, 50) for k in range(1, 2 * gaps, 2)]
        assert leaves_any_out(rows) == is_full


def test_where_logs_lack_little_more_of_them_are_named() -> None:
    """One with a gap takes 22 bytes and two for a stretch, 616 are there; 254 lack nothing."""
    logs = {robot: a_log(0, 2) for robot in range(254)}
    told = rows(logs, sorted(logs))
    assert [len({row.id for row in told}), len(told)] == [616 // 24, 2 * (616 // 24)]
    whole = {robot: a_log(0, 1) for robot in range(254)}
    assert rows(whole, [9, 3, *range(10, 254)])[:2] == [
        LogState(9, 1, 0, 2, 2),
        LogState(3, 1, 0, 2, 2),
    ]
    assert len(rows(whole, sorted(whole))) == 28


def test_the_end_of_a_log_is_told_before_the_stretches_between() -> None:
    """Twenty logs with gaps get fourteen bytes: three for the end, then two for each stretch."""
    logs = {robot: a_log(*range(1, 200, 2), 200, 201) for robot in range(20)}
    told = [(row.first, row.complete) for row in rows(logs, sorted(logs)) if row.id == 0]
    assert told == [(0, 0), (1, 2), (3, 4), (5, 6), (7, 8), (9, 10), (199, 202)]
