"""What is repeated of a log, when and by whom."""

from __future__ import annotations

import pytest
from log_scenes import OTHER, OWNER, PEER, T0, holding, repeated, said, state
from message_builders import MS, SECOND

from drslamd.conventions import Chain
from drslamd.gossip.log_sync import LogSync
from drslamd.gossip.message_types import LogState
from drslamd.slam.graph.measurements import Chapter


def test_the_owner_repeats_what_a_peer_lacks_at_once_and_in_order() -> None:
    logs = holding(3, OWNER, *range(10))
    logs.on_states(state(OWNER, 7), PEER.robot, T0)
    assert logs.repeats.take_due(T0) == [(3, said(OWNER, seq)) for seq in (7, 8, 9)]
    assert logs.repeats.repeated == 3
    assert logs.repeats.take_due(T0 + 100 * MS) == []


def test_one_status_asks_for_twelve_entries() -> None:
    logs = holding(3, OWNER, *range(30))
    logs.on_states(state(OWNER, 5), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, seq) for seq in range(5, 17)]
    assert repeated(logs, T0 + SECOND) == []


def test_a_peer_that_lacks_nothing_gets_nothing() -> None:
    logs = holding(3, OWNER, *range(10))
    logs.on_states(state(OWNER, 10), PEER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_nobody_gets_its_own_log() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.on_states((), OWNER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_a_peer_that_does_not_know_of_a_log_gets_it_from_the_start() -> None:
    logs = holding(3, OWNER, 0, 1)
    logs.on_states((), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, 0), said(OWNER, 1)]


def test_a_peer_with_an_older_epoch_of_a_log_gets_the_new_one_from_the_start() -> None:
    logs = holding(3, Chain(3, 2), 0, 1)
    logs.on_states(state(OWNER, 50), PEER.robot, T0)
    assert repeated(logs, T0) == [said(Chain(3, 2), 0), said(Chain(3, 2), 1)]


def test_a_peer_with_a_newer_epoch_of_a_log_does_not_get_the_old_one() -> None:
    logs = holding(5, OWNER, 0, 1)
    logs.on_states(state(Chain(3, 2)), OTHER.robot, T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_a_plan_for_a_log_that_was_replaced_meanwhile_is_dropped() -> None:
    logs = holding(4, OWNER, 0, 1)
    logs.on_states((), OTHER.robot, T0)
    logs.add(Chain(3, 2), 0, b"new", T0)
    assert repeated(logs, T0 + 2 * SECOND) == []


def test_what_was_on_the_air_within_800_ms_before_the_status_is_not_repeated() -> None:
    logs = holding(3, OWNER, 0, utime=T0)
    logs.on_states((), PEER.robot, T0 + 799 * MS)
    assert repeated(logs, T0 + 799 * MS) == []
    logs.on_states((), PEER.robot, T0 + 800 * MS)
    assert repeated(logs, T0 + 800 * MS) == [said(OWNER, 0)]


def test_two_peers_that_lack_the_same_get_it_once() -> None:
    logs = holding(3, OWNER, 0, 1)
    logs.on_states((), PEER.robot, T0)
    logs.on_states((), OTHER.robot, T0 + 10 * MS)
    assert len(repeated(logs, T0 + 20 * MS)) == 2
    assert repeated(logs, T0 + 30 * MS) == []


@pytest.mark.parametrize(("robot", "wait_ms"), [(4, 300), (5, 600), (6, 900), (7, 1200), (8, 300)])
def test_a_relay_leaves_the_owner_time(robot: int, wait_ms: int) -> None:
    logs = holding(robot, OWNER, 0)
    logs.on_states((), 9, T0)
    assert repeated(logs, T0 + (wait_ms - 1) * MS) == []
    assert repeated(logs, T0 + wait_ms * MS) == [said(OWNER, 0)]


@pytest.mark.parametrize("robot", [4, 5, 6, 7])
def test_a_relay_stays_silent_when_somebody_else_repeated_the_entry(robot: int) -> None:
    logs = holding(robot, OWNER, 0, 1)
    logs.on_states((), 9, T0)
    assert not logs.add(OWNER, 0, said(OWNER, 0), T0 + 100 * MS)
    assert repeated(logs, T0 + 1200 * MS) == [said(OWNER, 1)]


def asked_four_times(
    logs: LogSync, repeated_by_another: bool, states: tuple[LogState, ...] = ()
) -> list[list[int]]:
    """When an entry leaves, in ms after each of four statuses a second apart."""
    out: list[list[int]] = []
    for k in range(4):
        logs.on_states(states, 9, T0 + k * SECOND)
        out.append([])
        for ms in range(0, 1000, 100):
            if ms == 100 and repeated_by_another:
                logs.add(OWNER, 0, said(OWNER, 0), T0 + k * SECOND + ms * MS)
            if logs.repeats.take_due(T0 + k * SECOND + ms * MS):
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
        logs.on_states((*state(OWNER), *others[1:]), 9, T0 + 2 * k * SECOND)
        logs.add(OWNER, 0, said(OWNER, 0), T0 + 2 * k * SECOND + 100 * MS)
        assert logs.repeats.take_due(T0 + (2 * k + 1) * SECOND) == []
        logs.on_states(others, 9, T0 + (2 * k + 1) * SECOND)
    logs.on_states((*state(OWNER), *others[1:]), 9, T0 + 6 * SECOND)
    assert logs.repeats.take_due(T0 + 6 * SECOND) == [(OWNER.robot, said(OWNER, 0))]


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
    logs.on_states((), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, 0)]
    assert (repeated(logs, T0 + after_ms * MS) == [said(OWNER, 0)]) == again


def times_of_repeats(logs: LogSync, seconds: int) -> list[int]:
    """In ms after T0, with a look every 100 ms."""
    return [ms for ms in range(0, 1000 * seconds, 100) if logs.repeats.take_due(T0 + ms * MS)]


def test_the_owner_answers_a_silent_peer_for_five_seconds() -> None:
    logs = holding(3, OWNER, 0)
    logs.on_states((), PEER.robot, T0)
    assert times_of_repeats(logs, 20) == [0, 3500, 4500]


def test_a_relay_answers_a_silent_peer_once() -> None:
    logs = holding(4, OWNER, 0)
    logs.on_states((), OTHER.robot, T0)
    assert times_of_repeats(logs, 20) == [300]


def test_the_next_status_ends_the_answers_to_the_last_one() -> None:
    logs = holding(3, OWNER, 0)
    logs.on_states((), PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, 0)]
    logs.on_states(state(OWNER, 1), PEER.robot, T0 + SECOND)
    assert times_of_repeats(logs, 20) == []


def test_an_overdue_status_is_no_reason_to_repeat_what_came_after_it() -> None:
    logs = holding(3, OWNER, 0)
    logs.on_states(state(OWNER, 1), PEER.robot, T0)
    logs.add(OWNER, 1, said(OWNER, 1), T0 + 100 * MS)
    assert times_of_repeats(logs, 20) == []


def test_no_more_than_twelve_messages_leave_at_once() -> None:
    logs = holding(4, OWNER, *range(12))
    for seq in range(12):
        logs.add(PEER, seq, said(PEER, seq), 0)
    logs.on_states((), OTHER.robot, T0)
    sent = [len(logs.repeats.take_due(T0 + ms * MS)) for ms in (299, 300, 400, 500)]
    assert sent == [0, 12, 12, 0]


@pytest.mark.row("O7")
def test_no_more_than_240_repeats_are_planned() -> None:
    logs = LogSync(4)
    for robot in range(10, 40):
        for seq in range(12):
            logs.add(Chain(robot, 1), seq, b"", 0)
    logs.on_states((), OTHER.robot, T0)
    assert sum(len(logs.repeats.take_due(T0 + ms * MS)) for ms in range(0, 10_000, 100)) == 240


# what is held beyond a gap


def test_what_a_peer_holds_beyond_a_gap_is_not_repeated() -> None:
    logs = holding(3, OWNER, *range(10))
    rows = state(OWNER, 2, newest=9) + state(OWNER, 5, first=3) + state(OWNER, 8, first=7)
    logs.on_states(rows, PEER.robot, T0)
    assert repeated(logs, T0) == [said(OWNER, seq) for seq in (2, 5, 6, 8, 9)]


def test_what_a_peer_got_from_somebody_else_meanwhile_is_not_repeated_for_it() -> None:
    """We may not have heard who said it again."""
    logs = holding(4, OWNER, 0, 1)
    logs.on_states((), OTHER.robot, T0)
    logs.on_states(state(OWNER, 1), OTHER.robot, T0 + 200 * MS)
    assert repeated(logs, T0 + 300 * MS) == [said(OWNER, 1)]


def test_what_somebody_else_still_lacks_is_repeated() -> None:
    logs = holding(4, OWNER, 0)
    for peer in (OTHER.robot, 9):
        logs.on_states((), peer, T0)
    logs.on_states(state(OWNER, 1), OTHER.robot, T0 + 200 * MS)
    assert repeated(logs, T0 + 300 * MS) == [said(OWNER, 0)]


@pytest.mark.parametrize(("after_ms", "is_said"), [(4_999, False), (5_000, True)])
def test_what_is_asked_for_the_first_time_is_left_to_an_owner_that_speaks(
    after_ms: int, is_said: bool
) -> None:
    logs = holding(4, OWNER, 0)
    logs.on_states((), OWNER.robot, T0)
    logs.on_states((), OTHER.robot, T0 + after_ms * MS)
    assert bool(repeated(logs, T0 + after_ms * MS + 300 * MS)) is is_said


def test_what_is_asked_for_the_second_time_a_relay_says_too() -> None:
    logs = holding(4, OWNER, 0)
    for k in range(2):
        logs.on_states((), OWNER.robot, T0 + k * SECOND)
        logs.on_states((), OTHER.robot, T0 + k * SECOND)
    assert repeated(logs, T0 + SECOND) == []
    assert repeated(logs, T0 + SECOND + 300 * MS) == [said(OWNER, 0)]


# entries that are said again unasked


def present(logs: LogSync, loss: float, utime: int, *peers: int) -> None:
    """Peers say that they hold the first entry of robot 3."""
    for peer in peers:
        logs.on_states(state(OWNER, 1), peer, utime)
    logs.repeats.pace.reckon([loss])


def pushed(loss: float, seconds: int, acknowledged_ms: int | None = None) -> list[int]:
    """When entry 1 of robot 3 is said again, ms; one of two peers says soon that it has it."""
    logs = holding(3, OWNER, 0)
    present(logs, loss, T0, 5, 6)
    logs.add(OWNER, 1, said(OWNER, 1), T0)
    logs.repeats.push(1, T0)
    out = []
    for ms in range(0, 1000 * seconds, 100):
        if ms == 200:
            logs.on_states(state(OWNER, 2), 5, T0 + ms * MS)
        if ms == acknowledged_ms:
            logs.on_states(state(OWNER, 2), 6, T0 + ms * MS)
        if logs.repeats.take_due(T0 + ms * MS):
            out.append(ms)
    return out


@pytest.mark.parametrize(("loss", "count"), [(0.39, 0), (0.4, 40)])
def test_where_most_is_lost_an_entry_is_said_twice_a_second_for_twenty_seconds(
    loss: float, count: int
) -> None:
    assert pushed(loss, 25) == list(range(500, 500 * count + 1, 500))


def test_what_everybody_has_is_not_said_again() -> None:
    assert pushed(0.7, 12, acknowledged_ms=1_600) == [500, 1_000, 1_500]


def test_for_those_who_were_silent_for_half_a_minute_nothing_is_said_again() -> None:
    for seconds, is_said in ((29, True), (30, False)):
        logs = holding(3, OWNER, 0)
        present(logs, 0.7, T0, 6)
        later = T0 + seconds * SECOND
        logs.add(OWNER, 1, said(OWNER, 1), later)
        logs.repeats.push(1, later)
        assert bool(repeated(logs, later + 500 * MS)) is is_said


# chapters


def with_chapters(robot: int, entries: int) -> LogSync:
    """Entries 0 to 99 as a chapter in two parts, 110 and 111, and so many entries from 100 on."""
    logs = LogSync(robot)
    for seq in range(100, 100 + entries):
        logs.add(OWNER, seq, said(OWNER, seq), 0)
    logs.add(OWNER, 220, said(OWNER, 220), 0, Chapter(0))
    logs.add(OWNER, 221, said(OWNER, 221), 0, Chapter(2, ((0, 100),)))
    return logs


def test_chapters_are_said_in_the_place_of_what_they_stand_for() -> None:
    logs = with_chapters(OWNER.robot, 10)
    logs.on_states(state(OWNER, 0, 222), PEER.robot, T0)
    assert repeated(logs, T0)[:4] == [said(OWNER, seq) for seq in (220, 221, 100, 101)]


@pytest.mark.parametrize(("entries", "others"), [(5, 5), (6, 0)])
def test_of_entries_of_which_their_owner_makes_a_chapter_others_say_none(
    entries: int, others: int
) -> None:
    logs = with_chapters(5, entries)
    logs.on_states(state(OWNER, 0, 222), OWNER.robot, T0)
    for k in range(2):
        logs.on_states(state(OWNER, 0, 222), PEER.robot, T0 + k * SECOND)
    found = repeated(logs, T0 + 4 * SECOND)
    assert found[:2] == [said(OWNER, 220), said(OWNER, 221)]
    assert len(found) == 2 + others
