"""The logs of the team: what is kept of each, and what is said of it."""

from __future__ import annotations

import random
from collections import Counter

import pytest
from log_scenes import OTHER, OWNER, PEER, T0, all_repeated, holding, repeated, said, state
from message_builders import MS, SECOND

from drslamd.conventions import Chain
from drslamd.gossip import replicated_log
from drslamd.gossip.log_sync import LogSync
from drslamd.gossip.message_types import LogState
from drslamd.gossip.repeats.log_rows import leaves_any_out
from drslamd.slam.graph.measurements import GraphEntry


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
        assert logs.next_states() == state(OWNER, 30), f"seed {seed}"
        assert all_repeated(logs) == wanted, f"seed {seed}"


def test_a_missing_entry_keeps_the_log_incomplete_until_it_comes() -> None:
    logs = holding(5, OWNER, 0, 1, 3, 4)
    assert logs.next_states() == state(OWNER, 2, newest=5) + state(OWNER, 5, first=3)
    assert logs.lacking(3) == 1
    logs.add(OWNER, 2, b"", T0)
    assert logs.next_states() == state(OWNER, 5)
    assert logs.lacking(3) == 0


def test_a_new_epoch_replaces_the_log_of_the_old_one() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    again = Chain(3, 2)
    assert logs.add(again, 1, b"new", T0)
    assert logs.next_states() == state(again, 0, newest=2) + state(again, 2, first=1)
    assert not logs.add(OWNER, 3, b"late", T0)
    assert logs.next_states() == state(again, 0, newest=2) + state(again, 2, first=1)


def test_a_start_that_was_only_heard_of_replaces_the_old_log_too() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    assert logs.begin(Chain(3, 2))
    assert logs.epoch(3) == 2
    assert logs.next_states() == state(Chain(3, 2))
    assert not logs.begin(OWNER)
    assert logs.epoch(3) == 2


def test_a_start_that_is_known_already_changes_nothing() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    assert logs.begin(OWNER)
    assert logs.next_states() == state(OWNER, 3)


def test_of_a_robot_that_was_never_heard_nothing_is_known() -> None:
    assert LogSync(5).epoch(3) is None
    assert LogSync(5).lacking(3) == 0
    assert LogSync(5).next_states() == ()


# bounds


def test_the_oldest_entries_go_when_a_log_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicated_log, "MAX_ENTRIES", 10)
    logs = holding(5, OWNER, *range(10))
    assert logs.next_states() == state(OWNER, 10, first=0)
    logs.add(OWNER, 10, b"", T0)
    assert logs.next_states() == state(OWNER, 11, first=1)
    assert not logs.add(OWNER, 0, b"", T0)


def test_a_full_log_with_holes_gives_them_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicated_log, "MAX_ENTRIES", 10)
    logs = holding(5, OWNER, *range(1, 10))
    assert logs.next_states() == state(OWNER, 0, newest=10) + state(OWNER, 10, first=1)
    logs.add(OWNER, 10, b"", T0)
    assert logs.next_states() == state(OWNER, 11, first=1)
    logs.add(OWNER, 15, b"", T0)
    assert logs.next_states() == state(OWNER, 11, 16, first=6) + state(OWNER, 16, first=15)
    assert logs.lacking(3) == 4


def test_a_full_log_is_the_same_in_any_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicated_log, "MAX_ENTRIES", 10)
    for seed in range(50):
        order = list(range(25))
        random.Random(seed).shuffle(order)
        logs = LogSync(5)
        for seq in order:
            logs.add(OWNER, seq, said(OWNER, seq), 0)
        assert logs.next_states() == state(OWNER, 25, first=15)
        assert all_repeated(logs) == [said(OWNER, seq) for seq in range(15, 25)]


def test_the_largest_number_there_is_costs_only_the_log_that_has_it() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    logs.add(PEER, 0, b"", T0)
    last = 2**31 - 2
    assert logs.add(OWNER, last, b"", T0)
    first = last + 1 - replicated_log.MAX_ENTRIES
    lacked = state(OWNER, first, last + 1, first) + state(OWNER, last + 1, first=last)
    assert logs.next_states() == state(PEER, 1) + lacked


def test_what_the_owner_no_longer_holds_is_not_waited_for() -> None:
    logs = holding(5, OWNER, 0, 4, 5)
    logs.on_states(state(OWNER, 6, first=4), OWNER.robot, T0)
    assert logs.next_states() == state(OWNER, 6, first=4)
    assert logs.lacking(3) == 0


def test_what_another_peer_no_longer_holds_is_waited_for() -> None:
    logs = holding(5, OWNER, 0, 4, 5)
    logs.on_states(state(OWNER, 6, first=4), OTHER.robot, T0)
    assert logs.next_states() == state(OWNER, 1, newest=6) + state(OWNER, 6, first=4)
    assert logs.lacking(3) == 3


def test_what_is_held_stays_when_the_owner_forgets_it() -> None:
    logs = holding(5, OWNER, 0, 1, 2)
    logs.on_states(state(OWNER, 3, first=3), OWNER.robot, T0)
    assert logs.next_states() == state(OWNER, 3, first=0)


def test_a_peer_tells_of_entries_that_we_have_not_heard_of() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.on_states(state(OWNER, 0, newest=9), OTHER.robot, T0)
    assert logs.lacking(3) == 7
    assert logs.next_states() == state(OWNER, 2, newest=9)


def test_what_a_peer_says_of_another_epoch_is_not_taken_for_this_one() -> None:
    logs = holding(5, OWNER, 0, 1)
    for epoch in (0, 2):
        logs.on_states(state(Chain(3, epoch), 0, newest=9), OTHER.robot, T0)
        assert logs.lacking(3) == 0


def test_nobody_knows_more_of_our_own_log_than_we() -> None:
    logs = holding(3, OWNER, 0, 1)
    logs.on_states(state(OWNER, 0, newest=2**31 - 1), OTHER.robot, T0)
    assert logs.next_states() == state(OWNER, 2)


def test_a_boast_about_a_log_is_no_reason_to_count_to_it() -> None:
    logs = holding(5, OWNER, 0)
    for sender in (OWNER.robot, OTHER.robot, OTHER.robot):
        logs.on_states(state(OWNER, 0, newest=2**31 - 1), sender, T0)
    assert repeated(logs, T0 + 2 * SECOND) == [said(OWNER, 0)]


# words that are not true


LAST = 2**31 - 1


def test_an_owner_that_takes_back_that_it_forgot_everything_is_believed() -> None:
    logs = holding(5, OWNER, 0, 1, 3)
    logs.on_states(state(OWNER, LAST, first=LAST), OWNER.robot, T0)
    assert logs.next_states() == state(OWNER, LAST, first=LAST)
    assert logs.add(OWNER, 4, said(OWNER, 4), T0)
    logs.on_states(state(OWNER, 5), OWNER.robot, T0 + SECOND)
    assert logs.next_states() == state(OWNER, 2, newest=5) + state(OWNER, 5, first=3)
    assert logs.lacking(3) == 1
    assert logs.add(OWNER, 2, said(OWNER, 2), T0)
    assert logs.next_states() == state(OWNER, 5)


def test_an_owner_that_takes_back_a_boast_is_believed() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.on_states(state(OWNER, 2, newest=LAST), OWNER.robot, T0)
    assert logs.lacks_any()
    logs.on_states(state(OWNER, 2), OWNER.robot, T0 + SECOND)
    assert not logs.lacks_any()
    assert logs.next_states() == state(OWNER, 2)


def test_what_somebody_else_boasts_of_a_log_counts_1024_entries_ahead_until_its_owner_speaks() -> (
    None
):
    logs = holding(5, OWNER, 0, 1)
    logs.on_states(state(OWNER, 0, newest=LAST), OTHER.robot, T0)
    assert logs.lacking(3) == 1024
    logs.on_states(state(OWNER, 3), OWNER.robot, T0)
    assert logs.lacking(3) == 1


@pytest.mark.parametrize(("seq", "near"), [(1_025, True), (1_026, False), (LAST - 1, False)])
def test_an_entry_is_near_up_to_1023_beyond_what_is_known_of_its_log(seq: int, near: bool) -> None:
    logs = holding(5, OWNER, 0, 1)
    assert logs.is_near(OWNER, seq) == near
    assert logs.is_near(OTHER, seq - 2) == near
    assert logs.is_near(Chain(3, 2), seq - 2) == near


def test_a_robot_that_was_away_for_hours_finds_entries_near_that_the_owner_spoke_of() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.on_states(state(OWNER, 20_000), OWNER.robot, T0)
    assert logs.is_near(OWNER, 21_023)
    assert not logs.is_near(OWNER, 21_024)


def test_a_log_of_which_the_owner_knows_nothing_begins_anew() -> None:
    logs = holding(5, OWNER, 0, LAST - 1)
    logs.on_states(state(OWNER, 2), OWNER.robot, T0)
    assert logs.next_states() == state(OWNER)
    assert logs.add(OWNER, 0, said(OWNER, 0), T0)


# what is said of it


def test_a_status_names_our_own_log_first() -> None:
    logs = holding(5, OWNER, 0)
    logs.add(PEER, 0, b"", T0)
    assert [s.id for s in logs.next_states()] == [5, 3]


@pytest.mark.parametrize(("others", "statuses"), [(27, 1), (28, 2), (54, 2), (55, 3), (254, 10)])
def test_logs_that_do_not_fit_one_status_take_turns(others: int, statuses: int) -> None:
    logs = LogSync(0)
    for robot in range(others + 1):
        logs.begin(Chain(robot, 1))
    named: set[int] = set()
    for _ in range(statuses):
        ids = [s.id for s in logs.next_states()]
        assert ids[0] == 0
        assert len(set(ids)) == len(ids) == min(28, others + 1)
        assert named != set(range(others + 1))
        named |= set(ids)
    assert named == set(range(others + 1))


def test_what_is_held_beyond_gaps_is_said_in_rows_of_its_log() -> None:
    logs = holding(5, OWNER, *range(1, 30, 2), 30)
    rows = logs.next_states()
    assert rows[0] == LogState(*OWNER, 0, 0, 31)
    ends = [(k, k + 1) for k in range(1, 29, 2)] + [(29, 31)]
    assert rows[1:] == tuple(LogState(*OWNER, first, end, 31) for first, end in ends)


def with_gaps(others: int, entries: int = 300) -> LogSync:
    """Of robot 0: of each log every second entry is there."""
    logs = LogSync(0)
    for robot in range(1, others + 1):
        for seq in range(1, entries, 2):
            logs.add(Chain(robot, 1), seq, said(Chain(robot, 1), seq), T0)
    return logs


def test_a_status_names_all_logs_of_a_small_team_and_says_what_lies_beyond_their_gaps() -> None:
    """What is said of gaps takes two bytes a stretch here, 240 in all, and the place of logs."""
    for others, entries, stretches in ((1, 300, 120), (5, 128, 120), (15, 128, 120)):
        rows = with_gaps(others, entries).next_states()
        assert len({row.id for row in rows}) == others
        assert stretches * 0.9 <= len(rows) - others <= stretches + others


@pytest.mark.parametrize(("others", "statuses"), [(17, 1), (18, 2), (34, 2), (49, 3), (254, 15)])
def test_logs_with_gaps_take_turns_and_none_is_named_without_what_lies_beyond_them(
    others: int, statuses: int
) -> None:
    """Each takes 22 bytes and 13 for six stretches, so seventeen of them fit 28 times 22."""
    logs, named = with_gaps(others), Counter[int]()
    for _status in range(statuses):
        rows = logs.next_states()
        told = Counter(row.id for row in rows)
        assert set(told.values()) == {1 + 6}
        assert sum(row.complete == 300 for row in rows) == len(told)
        assert leaves_any_out(rows)
        assert len(named) < others
        named.update(told.keys())
    assert len(named) == others
    assert max(named.values()) <= 2


def test_what_a_newcomer_to_a_crowd_holds_beyond_gaps_is_not_said_to_it_again() -> None:
    """Forty owners are silent, so one that holds their logs says what is lacked."""
    newcomer, helper = with_gaps(40, 14), LogSync(41)
    for robot in range(1, 41):
        for seq in range(14):
            helper.add(Chain(robot, 1), seq, said(Chain(robot, 1), seq), T0)
    came = 0
    for step in range(300):
        utime = T0 + 10 * SECOND + step * SECOND // 10
        if step % 10 == 0:
            helper.on_states(newcomer.next_states(), 0, utime)
        for robot, sealed in helper.repeats.take_due(utime):
            seq = next(k for k in range(14) if said(Chain(robot, 1), k) == sealed)
            assert newcomer.add(Chain(robot, 1), seq, sealed, utime)
            came += 1
    assert came == 40 * 7
    assert not newcomer.lacks_any()


def test_whoever_gets_what_it_asked_for_does_not_ask_again_at_once() -> None:
    logs = holding(5, OWNER, 0, 5)
    logs.next_states()
    assert not logs.is_filling(T0)
    logs.add(OWNER, 1, b"", T0)
    assert logs.is_filling(T0 + SECOND)
    assert not logs.is_filling(T0 + 2 * SECOND)
    logs.add(OWNER, 2, b"", T0 + SECOND)
    assert logs.is_filling(T0 + 2 * SECOND)
    logs.add(OWNER, 3, b"", T0 + 2 * SECOND)
    assert logs.is_filling(T0 + 2 * SECOND)
    logs.repeats.pace.reckon([0.4])  # then no more is expected of the five
    assert not logs.is_filling(T0 + 2 * SECOND)


def test_an_owner_does_not_say_again_what_somebody_else_just_did() -> None:
    logs, entry = holding(3, OWNER, 0, 1), GraphEntry(0)
    logs.on_states(state(OWNER, 0), PEER.robot, T0)
    logs.on_echo(OWNER, (entry, said(OWNER, 0)), T0)
    assert repeated(logs, T0 + MS) == [said(OWNER, 1)]


def test_what_an_owner_never_said_keeps_it_from_nothing() -> None:
    for came in (None, (GraphEntry(0), b"forged"), (GraphEntry(7), b"forged")):
        logs = holding(3, OWNER, 0)
        logs.on_states(state(OWNER, 0), PEER.robot, T0)
        logs.on_echo(OWNER, came, T0)
        assert logs.end(OWNER) == 1
        assert repeated(logs, T0 + MS) == [said(OWNER, 0)]


def test_what_comes_in_its_turn_was_not_asked_for() -> None:
    logs = holding(5, OWNER, 0, 9)
    logs.next_states()
    logs.add(OWNER, 10, b"", T0)
    assert not logs.is_filling(T0)


def test_a_log_that_a_full_status_leaves_out_may_be_held() -> None:
    named = tuple(LogState(100 + k, 1, 0, 0, 0) for k in range(28))
    logs = holding(5, OWNER, 0)
    logs.on_states(named, OTHER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []
    logs.on_states(named[:27], OTHER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == [said(OWNER, 0)]
