"""The logs of the team: what is kept, what is said of it, what is repeated, when and by whom."""

from __future__ import annotations

import random

import pytest
from message_builders import MS, SECOND

from drslamd.conventions import Chain
from drslamd.gossip import log_sync
from drslamd.gossip.log_sync import LogSync
from drslamd.gossip.message_types import LogState

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
    return [sealed for _, sealed in logs.due(utime)]


def all_repeated(logs: LogSync) -> list[bytes]:
    """Everything that a newcomer without anything gets, status by status."""
    out: list[bytes] = []
    (held,) = logs.states()
    for complete in range(held.first, held.complete, log_sync.REPEATS_AT_ONCE):
        logs.peer_holds(state(OWNER, complete), OTHER.robot, T0 + complete * SECOND)
        out += repeated(logs, T0 + (complete + 2) * SECOND)
    return out


# ---- what is kept ------------------------------------------------------------------------------


def test_an_entry_is_new_once() -> None:
    logs = LogSync(5)
    assert logs.add(OWNER, 0, b"a", T0)
    assert not logs.add(OWNER, 0, b"a", T0 + 1)


def test_two_hundred_orders_of_arrival_give_the_same_log() -> None:
    wanted = [said(OWNER, seq) for seq in range(30)]
    for seed in range(200):
        draw = random.Random(seed)
        arrivals = [*range(30), *draw.choices(range(30), k=40)]
        draw.shuffle(arrivals)
        logs = LogSync(5)
        taken = [
            seq for k, seq in enumerate(arrivals) if logs.add(OWNER, seq, said(OWNER, seq), k * MS)
        ]
        assert sorted(taken) == list(range(30)), f"seed {seed}"
        assert logs.states() == state(OWNER, 30), f"seed {seed}"
        assert all_repeated(logs) == wanted, f"seed {seed}"


def test_a_missing_entry_keeps_the_log_incomplete_until_it_comes() -> None:
    logs = holding(5, OWNER, 0, 1, 3, 4)
    assert logs.states() == state(OWNER, 2, newest=5)
    assert logs.lacking(3) == 1
    logs.add(OWNER, 2, b"", T0)
    assert logs.states() == state(OWNER, 5)
    assert logs.lacking(3) == 0


def test_a_new_epoch_replaces_the_log_of_the_old_one() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    again = Chain(3, 2)
    assert logs.add(again, 1, b"new", T0)
    assert logs.states() == state(again, 0, newest=2)
    assert not logs.add(OWNER, 3, b"late", T0)
    assert logs.states() == state(again, 0, newest=2)


def test_a_start_that_was_only_heard_of_replaces_the_old_log_too() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    assert logs.begin(Chain(3, 2))
    assert logs.epoch(3) == 2
    assert logs.states() == state(Chain(3, 2))
    assert not logs.begin(OWNER)
    assert logs.epoch(3) == 2


def test_a_start_that_is_known_already_changes_nothing() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    assert logs.begin(OWNER)
    assert logs.states() == state(OWNER, 3)


def test_of_a_robot_that_was_never_heard_nothing_is_known() -> None:
    assert LogSync(5).epoch(3) is None
    assert LogSync(5).lacking(3) == 0
    assert LogSync(5).states() == ()


# ---- bounds ------------------------------------------------------------------------------------


def test_the_oldest_entries_go_when_a_log_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_sync, "MAX_ENTRIES", 10)
    logs = holding(5, OWNER, *range(10))
    assert logs.states() == state(OWNER, 10, first=0)
    logs.add(OWNER, 10, b"", T0)
    assert logs.states() == state(OWNER, 11, first=1)
    assert not logs.add(OWNER, 0, b"", T0)


def test_a_full_log_with_holes_gives_them_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_sync, "MAX_ENTRIES", 10)
    logs = holding(5, OWNER, *range(1, 10))
    assert logs.states() == state(OWNER, 0, newest=10)
    logs.add(OWNER, 10, b"", T0)
    assert logs.states() == state(OWNER, 11, first=1)
    logs.add(OWNER, 15, b"", T0)
    assert logs.states() == state(OWNER, 11, newest=16, first=6)
    assert logs.lacking(3) == 4


def test_a_full_log_is_the_same_in_any_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_sync, "MAX_ENTRIES", 10)
    for seed in range(50):
        order = list(range(25))
        random.Random(seed).shuffle(order)
        logs = LogSync(5)
        for seq in order:
            logs.add(OWNER, seq, said(OWNER, seq), 0)
        assert logs.states() == state(OWNER, 25, first=15)
        assert all_repeated(logs) == [said(OWNER, seq) for seq in range(15, 25)]


def test_the_largest_number_there_is_costs_only_the_log_that_has_it() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    logs.add(PEER, 0, b"", T0)
    last = 2**31 - 2
    assert logs.add(OWNER, last, b"", T0)
    first = last + 1 - log_sync.MAX_ENTRIES
    assert logs.states() == (*state(PEER, 1), *state(OWNER, first, last + 1, first))


def test_what_the_owner_no_longer_holds_is_not_waited_for() -> None:
    logs = holding(5, OWNER, 0, 4, 5)
    logs.peer_holds(state(OWNER, 6, first=4), OWNER.robot, T0)
    assert logs.states() == state(OWNER, 6, first=4)
    assert logs.lacking(3) == 0


def test_what_another_peer_no_longer_holds_is_waited_for() -> None:
    logs = holding(5, OWNER, 0, 4, 5)
    logs.peer_holds(state(OWNER, 6, first=4), OTHER.robot, T0)
    assert logs.states() == state(OWNER, 1, newest=6)
    assert logs.lacking(3) == 3


def test_what_is_held_stays_when_the_owner_forgets_it() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    logs.peer_holds(state(OWNER, 3, first=3), OWNER.robot, T0)
    assert logs.states() == state(OWNER, 3, first=0)


def test_a_peer_tells_of_entries_that_we_have_not_heard_of() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.peer_holds(state(OWNER, 0, newest=9), OTHER.robot, T0)
    assert logs.lacking(3) == 7
    assert logs.states() == state(OWNER, 2, newest=9)


def test_what_a_peer_says_of_another_epoch_is_not_taken_for_this_one() -> None:
    logs = holding(5, OWNER, 0, 1)
    for epoch in (0, 2):
        logs.peer_holds(state(Chain(3, epoch), 0, newest=9), OTHER.robot, T0)
        assert logs.lacking(3) == 0


def test_nobody_knows_more_of_our_own_log_than_we() -> None:
    logs = holding(3, OWNER, 0, 1)
    logs.peer_holds(state(OWNER, 0, newest=2**31 - 1), OTHER.robot, T0)
    assert logs.states() == state(OWNER, 2)


def test_a_boast_about_a_log_is_no_reason_to_count_to_it() -> None:
    logs = holding(5, OWNER, 0)
    for sender in (OWNER.robot, OTHER.robot):
        logs.peer_holds(state(OWNER, 0, newest=2**31 - 1), sender, T0)
    assert repeated(logs, T0 + 2 * SECOND) == [said(OWNER, 0)]


# ---- what is said of it ------------------------------------------------------------------------


def test_a_status_names_our_own_log_first() -> None:
    logs = holding(5, OWNER, 0)
    logs.add(PEER, 0, b"", T0)
    assert [s.id for s in logs.states()] == [5, 3]


@pytest.mark.parametrize(("others", "statuses"), [(27, 1), (28, 2), (54, 2), (55, 3), (254, 10)])
def test_logs_that_do_not_fit_one_status_take_turns(others: int, statuses: int) -> None:
    logs = LogSync(0)
    for robot in range(others + 1):
        logs.begin(Chain(robot, 1))
    named: set[int] = set()
    for _ in range(statuses):
        ids = [s.id for s in logs.states()]
        assert ids[0] == 0
        assert len(set(ids)) == len(ids) == min(28, others + 1)
        assert named != set(range(others + 1))
        named |= set(ids)
    assert named == set(range(others + 1))


def test_a_log_that_a_full_status_leaves_out_may_be_held() -> None:
    named = tuple(LogState(100 + k, 1, 0, 0, 0) for k in range(28))
    logs = holding(5, OWNER, 0)
    logs.peer_holds(named, OTHER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []
    logs.peer_holds(named[:27], OTHER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == [said(OWNER, 0)]


# ---- what is repeated --------------------------------------------------------------------------


def test_the_owner_repeats_what_a_peer_lacks_at_once_and_in_order() -> None:
    logs = holding(3, OWNER, *range(10))
    logs.peer_holds(state(OWNER, 7), PEER.robot, T0)
    assert logs.due(T0) == [(3, said(OWNER, seq)) for seq in (7, 8, 9)]
    assert logs.repeated == 3
    assert logs.due(T0 + 100 * MS) == []


def test_one_status_asks_for_twelve_entries() -> None:
    logs = holding(3, OWNER, *range(30))
    logs.peer_holds(state(OWNER, 5), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, seq) for seq in range(5, 17)]
    assert repeated(logs, T0 + SECOND) == []


def test_a_peer_that_lacks_nothing_gets_nothing() -> None:
    logs = holding(3, OWNER, *range(10))
    logs.peer_holds(state(OWNER, 10), PEER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_nobody_gets_its_own_log() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.peer_holds((), OWNER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_a_peer_that_does_not_know_of_a_log_gets_it_from_the_start() -> None:
    logs = holding(3, OWNER, 0, 1)
    logs.peer_holds((), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, 0), said(OWNER, 1)]


def test_a_peer_with_an_older_epoch_of_a_log_gets_the_new_one_from_the_start() -> None:
    logs = holding(3, Chain(3, 2), 0, 1)
    logs.peer_holds(state(OWNER, 50), PEER.robot, T0)
    assert repeated(logs, T0) == [said(Chain(3, 2), 0), said(Chain(3, 2), 1)]


def test_a_peer_with_a_newer_epoch_of_a_log_does_not_get_the_old_one() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.peer_holds(state(Chain(3, 2)), OTHER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_a_plan_for_a_log_that_was_replaced_meanwhile_is_dropped() -> None:
    logs = holding(4, OWNER, 0, 1)
    logs.peer_holds((), OTHER.robot, T0)
    logs.add(Chain(3, 2), 0, b"new", T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_what_was_on_the_air_within_800_ms_before_the_status_is_not_repeated() -> None:
    logs = holding(3, OWNER, 0, utime=T0)
    logs.peer_holds((), PEER.robot, T0 + 799 * MS)
    assert repeated(logs, T0 + 799 * MS) == []
    logs.peer_holds((), PEER.robot, T0 + 800 * MS)
    assert repeated(logs, T0 + 800 * MS) == [said(OWNER, 0)]


def test_two_peers_that_lack_the_same_get_it_once() -> None:
    logs = holding(3, OWNER, 0, 1)
    logs.peer_holds((), PEER.robot, T0)
    logs.peer_holds((), OTHER.robot, T0 + 10 * MS)
    assert len(repeated(logs, T0 + 20 * MS)) == 2
    assert repeated(logs, T0 + 30 * MS) == []


@pytest.mark.parametrize(("robot", "wait_ms"), [(4, 300), (5, 600), (6, 900), (7, 1200), (8, 300)])
def test_a_relay_leaves_the_owner_time(robot: int, wait_ms: int) -> None:
    logs = holding(robot, OWNER, 0)
    logs.peer_holds((), 9, T0)
    assert repeated(logs, T0 + (wait_ms - 1) * MS) == []
    assert repeated(logs, T0 + wait_ms * MS) == [said(OWNER, 0)]


@pytest.mark.parametrize("robot", [4, 5, 6, 7])
def test_a_relay_stays_silent_when_somebody_else_repeated_the_entry(robot: int) -> None:
    logs = holding(robot, OWNER, 0, 1)
    logs.peer_holds((), 9, T0)
    assert not logs.add(OWNER, 0, said(OWNER, 0), T0 + 100 * MS)
    assert repeated(logs, T0 + 1200 * MS) == [said(OWNER, 1)]


def asked_four_times(
    logs: LogSync, repeated_by_another: bool, states: tuple[LogState, ...] = ()
) -> list[list[int]]:
    """When an entry leaves, in ms after each of four statuses a second apart."""
    out: list[list[int]] = []
    for k in range(4):
        logs.peer_holds(states, 9, T0 + k * SECOND)
        out.append([])
        for ms in range(0, 1000, 100):
            if ms == 100 and repeated_by_another:
                logs.add(OWNER, 0, said(OWNER, 0), T0 + k * SECOND + ms * MS)
            if logs.due(T0 + k * SECOND + ms * MS):
                out[-1].append(ms)
    return out


def test_a_relay_goes_first_when_three_repeats_of_the_owner_did_not_help() -> None:
    """The owner may be heard by the relay, and not by the one who asks."""
    logs = holding(4, OWNER, 0)
    assert asked_four_times(logs, repeated_by_another=True) == [[], [], [], [0]]


def test_statuses_that_leave_a_log_out_do_not_begin_the_count_anew() -> None:
    """Whoever holds many logs names each in some of its statuses only."""
    others = tuple(LogState(100 + k, 1, 0, 0, 0) for k in range(28))
    logs = holding(4, OWNER, 0)
    assert asked_four_times(logs, True, (*state(OWNER), *others[1:])) == [[], [], [], [0]]
    logs = holding(4, OWNER, 0)
    for k in range(3):
        logs.peer_holds((*state(OWNER), *others[1:]), 9, T0 + 2 * k * SECOND)
        logs.add(OWNER, 0, said(OWNER, 0), T0 + 2 * k * SECOND + 100 * MS)
        assert logs.due(T0 + (2 * k + 1) * SECOND) == []
        logs.peer_holds(others, 9, T0 + (2 * k + 1) * SECOND)
    logs.peer_holds((*state(OWNER), *others[1:]), 9, T0 + 6 * SECOND)
    assert logs.due(T0 + 6 * SECOND) == [(OWNER.robot, said(OWNER, 0))]


@pytest.mark.parametrize("robot", [0, 5, 254])
def test_a_log_of_anybody_that_is_not_complete_is_lacked(robot: int) -> None:
    logs = LogSync(0)
    for k in range(255):
        logs.begin(Chain(k, 1))
        logs.add(Chain(k, 1), 0, b"", T0)
    assert not logs.lacks_any()
    logs.add(Chain(robot, 1), 2, b"", T0)
    assert logs.lacks_any()
    logs.add(Chain(robot, 1), 1, b"", T0)
    assert not logs.lacks_any()


def test_the_owner_comes_last_when_three_of_its_repeats_did_not_help() -> None:
    logs = holding(3, OWNER, 0)
    assert asked_four_times(logs, repeated_by_another=False) == [[0], [0], [0], []]
    assert repeated(logs, T0 + 3 * SECOND + 1199 * MS) == []
    assert repeated(logs, T0 + 3 * SECOND + 1200 * MS) == [said(OWNER, 0)]


@pytest.mark.parametrize(("after_ms", "again"), [(3499, False), (3500, True)])
def test_the_owner_answers_again_when_the_next_status_is_overdue(
    after_ms: int, again: bool
) -> None:
    logs = holding(3, OWNER, 0)
    logs.peer_holds((), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, 0)]
    assert (repeated(logs, T0 + after_ms * MS) == [said(OWNER, 0)]) == again


def times_of_repeats(logs: LogSync, seconds: int) -> list[int]:
    """In ms after T0, with a look every 100 ms."""
    return [ms for ms in range(0, 1000 * seconds, 100) if logs.due(T0 + ms * MS)]


def test_the_owner_answers_a_silent_peer_for_five_seconds() -> None:
    logs = holding(3, OWNER, 0)
    logs.peer_holds((), PEER.robot, T0)
    assert times_of_repeats(logs, 20) == [0, 3500, 4500]


def test_a_relay_answers_a_silent_peer_once() -> None:
    logs = holding(4, OWNER, 0)
    logs.peer_holds((), OTHER.robot, T0)
    assert times_of_repeats(logs, 20) == [300]


def test_the_next_status_ends_the_answers_to_the_last_one() -> None:
    logs = holding(3, OWNER, 0)
    logs.peer_holds((), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, 0)]
    logs.peer_holds(state(OWNER, 1), PEER.robot, T0 + SECOND)
    assert times_of_repeats(logs, 20) == []


def test_an_overdue_status_is_no_reason_to_repeat_what_came_after_it() -> None:
    logs = holding(3, OWNER, 0)
    logs.peer_holds(state(OWNER, 1), PEER.robot, T0)
    logs.add(OWNER, 1, said(OWNER, 1), T0 + 100 * MS)
    assert times_of_repeats(logs, 20) == []


def test_no_more_than_twelve_messages_leave_at_once() -> None:
    logs = holding(4, OWNER, *range(12))
    for seq in range(12):
        logs.add(PEER, seq, said(PEER, seq), 0)
    logs.peer_holds((), OTHER.robot, T0)
    sent = [len(logs.due(T0 + ms * MS)) for ms in (299, 300, 400, 500)]
    assert sent == [0, 12, 12, 0]


def test_no_more_than_240_repeats_are_planned() -> None:
    logs = LogSync(4)
    for robot in range(10, 40):
        for seq in range(12):
            logs.add(Chain(robot, 1), seq, b"", 0)
    logs.peer_holds((), OTHER.robot, T0)
    assert sum(len(logs.due(T0 + ms * MS)) for ms in range(0, 10_000, 100)) == 240
