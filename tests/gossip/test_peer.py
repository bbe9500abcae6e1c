"""What is known of one peer: its loss, its life, its odometry, its latest words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from message_builders import MS, SECOND, a_status

from drslamd.conventions import Chain
from drslamd.gossip.message_types import Heard, LogState, OdometryBatch, Pose, PoseState, Status
from drslamd.gossip.peer import DRIVES_US, LOST_US, Peer
from drslamd.slam.se2 import Array

OWN, CHAIN = Chain(1, 10), Chain(3, 11)
T0 = 100 * SECOND


def a_peer() -> Peer:
    return Peer(CHAIN, T0)


def own_log(entries: int) -> tuple[LogState, ...]:
    """A peer's log state of its own log."""
    return (LogState(*CHAIN, 0, entries, entries),)


# loss


def loss_after(messages: list[str], lost: set[int]) -> float:
    """Of a peer that sent these ("status", "other", "entry"), of which some numbers were lost."""
    peer, entries = a_peer(), 0
    for k, kind in enumerate(messages):
        if kind == "entry":
            entries += 1
        elif k not in lost:
            peer.on_message(k * 100 * MS, T0 + k * 100 * MS)
            if kind == "status":
                peer.take_status(a_status(logs=own_log(entries)), k + 1, OWN, 0)
    return peer.loss


def test_a_peer_of_which_everything_comes_has_lost_nothing() -> None:
    assert a_peer().loss == 0.0
    assert loss_after(["status", "other", "other"] * 10, set()) == 0.0


def test_a_peer_that_has_spoken_once_has_lost_nothing_yet() -> None:
    assert loss_after(["status"], set()) == 0.0
    assert loss_after(["other", "status", "other"], set()) == 0.0
    assert loss_after(["status", "other", "status"], {1}) == pytest.approx(1 / 2)


def test_a_peer_of_which_every_fourth_message_is_lost_has_a_loss_of_a_quarter() -> None:
    messages = ["status", "other", "other", "other"] * 20
    assert loss_after(messages, set(range(2, 80, 4))) == pytest.approx(0.25)


def test_lost_statuses_count_when_the_next_one_comes() -> None:
    messages = ["status", "other"] * 20
    assert loss_after(messages, set(range(2, 36))) == pytest.approx(1 - 4 / 38)


def test_log_entries_have_numbers_too_and_do_not_count_as_lost() -> None:
    assert loss_after(["status", "other", "entry", "entry"] * 20, set()) == 0.0
    messages = ["status", "other", "entry", "other"] * 20
    assert loss_after(messages, set(range(1, 80, 4))) == pytest.approx(1 / 3)


def test_the_loss_is_that_of_the_last_thirty_statuses() -> None:
    messages = ["status", "other"] * 100
    assert loss_after(messages, {k for k in range(100) if k % 2}) == 0.0
    assert loss_after(messages, {k for k in range(100, 200) if k % 2}) == pytest.approx(0.5)


def test_a_peer_that_lies_about_its_log_has_some_loss_and_breaks_nothing() -> None:
    peer = a_peer()
    for counter, entries in ((1, 0), (2, 1), (3, 10**6), (4, 0)):
        peer.take_status(a_status(logs=own_log(entries)), counter, OWN, 0)
        assert 0.0 <= peer.loss <= 1.0


# life


def test_a_peer_lives_for_five_seconds_after_its_last_message() -> None:
    peer = a_peer()
    peer.on_message(0, T0 + SECOND)
    assert peer.is_alive(T0 + 6 * SECOND - 1)
    assert not peer.is_alive(T0 + 6 * SECOND)


def test_a_peer_that_says_goodbye_is_gone_at_once() -> None:
    peer = a_peer()
    peer.take_status(a_status(leaving=True), 1, OWN, 0)
    assert not peer.is_alive(T0)


def test_a_peer_hears_us_when_its_latest_status_names_this_very_start() -> None:
    peer = a_peer()
    assert not peer.hears(OWN)
    for counter, (named, hears) in enumerate(
        [(Heard(1, 10, 5), True), (Heard(1, 9, 5), False), (Heard(2, 10, 5), False)], start=1
    ):
        peer.take_status(a_status((Heard(7, 7, 0), named)), counter, OWN, 0)
        assert peer.hears(OWN) == hears


def full(*named: Heard, others: int) -> Status:
    """A status that names these, and so many others."""
    return a_status((*named, *(Heard(100 + k, 1, 0) for k in range(others))), ranged=(1,))


@pytest.mark.parametrize(("others", "remembered"), [(27, False), (28, True)])
def test_a_status_with_room_for_us_says_that_we_are_not_heard_and_a_full_one_does_not(
    others: int, remembered: bool
) -> None:
    peer = a_peer()
    peer.on_message(T0 + SECOND, T0)
    peer.take_status(full(Heard(*OWN, SECOND, 70), others=27), 1, OWN, T0)
    peer.take_status(full(others=others), 2, OWN, T0 + 3 * SECOND)
    assert peer.hears(OWN) == remembered
    assert (OWN in peer.audible) == remembered
    neighbour = peer.neighbour(OWN, T0 + 3 * SECOND)
    assert neighbour.ranges_to_us == remembered
    assert neighbour.wanted_n == (70 if remembered else -1)
    assert not remembered or neighbour.wanted_at == T0
    offset = peer.clock.offset(T0)
    assert offset is not None
    assert offset.source == ("messages" if remembered else "one way")


@pytest.mark.parametrize(("later", "remembered"), [(40 * SECOND - 1, True), (40 * SECOND, False)])
def test_whom_full_statuses_no_longer_name_is_remembered_for_forty_seconds(
    later: int, remembered: bool
) -> None:
    peer = a_peer()
    peer.take_status(full(Heard(*OWN, 0), others=27), 1, OWN, T0)
    peer.take_status(full(others=28), 2, OWN, T0 + later)
    assert peer.hears(OWN) == remembered


def test_what_is_said_of_us_anew_replaces_what_is_remembered() -> None:
    peer = a_peer()
    peer.take_status(full(Heard(*OWN, 0, 70), others=27), 1, OWN, T0)
    peer.take_status(full(Heard(*OWN, 0, 90), others=27), 2, OWN, T0 + SECOND)
    neighbour = peer.neighbour(OWN, T0 + SECOND)
    assert (neighbour.wanted_n, neighbour.wanted_at) == (90, T0 + SECOND)
    peer.take_status(full(Heard(1, 9, 0), others=27), 3, OWN, T0 + 2 * SECOND)
    assert not peer.hears(OWN)


def test_what_it_hears_of_us_makes_its_clock_known() -> None:
    peer = a_peer()
    peer.on_message(T0 + SECOND, T0 + 10 * MS)
    peer.take_status(a_status((Heard(*OWN, SECOND + 10 * MS),)), 1, OWN, 0)
    offset = peer.clock.offset(T0)
    assert offset is not None
    assert (offset.us, offset.source) == (SECOND, "messages")
    peer.take_status(a_status((Heard(1, 9, 0),)), 2, OWN, 0)
    offset = peer.clock.offset(T0)
    assert offset is not None
    assert offset.source == "one way"


def test_a_status_that_was_overtaken_says_nothing_new() -> None:
    peer = a_peer()
    late, latest = a_status(leaving=False), a_status(leaving=True)
    assert peer.take_status(latest, 5, OWN, 0)
    assert not peer.take_status(late, 4, OWN, 0)
    assert not peer.take_status(late, 5, OWN, 0)
    assert peer.status is latest


def test_a_pose_that_was_overtaken_says_nothing_new() -> None:
    peer = a_peer()
    late, latest = (Pose(PoseState.LOCALISED, 3, 11, utime) for utime in (1, 2))
    peer.take_pose(latest, 5)
    peer.take_pose(late, 4)
    assert peer.pose is latest


@pytest.mark.parametrize(("ahead", "taken"), [(63, False), (64, True), (2**31 - 6, True)])
def test_a_status_and_a_pose_far_ahead_of_all_others_overtake_nothing(
    ahead: int, taken: bool
) -> None:
    """A false one with the last counter there is would silence its robot."""
    peer = a_peer()
    peer.take_status(a_status(leaving=True), 5 + ahead, OWN, 0)
    peer.take_pose(Pose(PoseState.LOCALISED, 3, 11, 1), 5 + ahead)
    assert peer.take_status(a_status(), 5, OWN, 0) == taken
    pose = Pose(PoseState.LOCALISED, 3, 11, 2)
    peer.take_pose(pose, 5)
    assert (peer.pose is pose) == taken


# odometry


def steps(first: int, count: int) -> Array:
    """Sample n is at x = n, y = 2 n, theta = 3 n."""
    return np.array([[n, 2.0 * n, 3.0 * n] for n in range(first, first + count)])


def batch(first: int, count: int, segment_start: int = 0) -> OdometryBatch:
    return OdometryBatch(segment_start, first, steps(first, count))


def test_overlapping_batches_make_one_track() -> None:
    peer = a_peer()
    for first in (0, 5, 10):
        peer.extend_track(batch(first, 15), 0)
    assert (peer.track.n0, peer.track.end) == (0, 25)
    assert np.array_equal(peer.track.steps(0, 25), steps(0, 25))
    assert peer.track.covers(0, 24)


def test_batches_that_come_twice_or_late_change_nothing() -> None:
    peer = a_peer()
    for first in (0, 10, 5, 0, 10):
        peer.extend_track(batch(first, 15), 0)
    assert np.array_equal(peer.track.steps(0, 25), steps(0, 25))


def test_a_batch_that_leaves_a_gap_waits_for_what_was_lost() -> None:
    peer = a_peer()
    peer.extend_track(batch(0, 10), 0)
    peer.extend_track(batch(20, 10), SECOND)
    assert peer.track.end == 10
    assert peer.lacks_odometry
    peer.extend_track(batch(10, 30), 2 * SECOND)
    assert peer.track.covers(0, 39)
    assert not peer.lacks_odometry


@pytest.mark.parametrize(("later", "taken"), [(8 * SECOND - 1, False), (8 * SECOND, True)])
def test_after_eight_seconds_a_gap_is_a_hole(later: int, taken: bool) -> None:
    peer = a_peer()
    peer.extend_track(batch(0, 10), 0)
    peer.extend_track(batch(20, 10), SECOND)
    peer.extend_track(batch(30, 10), SECOND + later)
    assert peer.track.covers(30, 39) == taken
    assert not peer.track.covers(0, 39)


@pytest.mark.parametrize(("count", "taken"), [(149, False), (150, True)])
def test_a_batch_of_all_that_fits_is_the_beginning(count: int, taken: bool) -> None:
    peer = a_peer()
    peer.extend_track(batch(500, count), 0)
    assert len(peer.track) == (count if taken else 0)


def test_a_break_in_the_odometry_of_the_peer_is_a_break_in_its_track() -> None:
    peer = a_peer()
    peer.extend_track(batch(0, 15), 0)
    peer.extend_track(batch(15, 5, segment_start=15), 0)
    assert not peer.track.covers(14, 15)
    assert peer.track.covers(15, 19)


LAST = 2**31 - 2


def test_a_false_batch_from_the_end_of_all_numbers_is_given_up_for_true_ones() -> None:
    peer = a_peer()
    peer.extend_track(batch(0, 100), 0)
    peer.extend_track(OdometryBatch(LAST - 149, LAST - 149, steps(0, 150)), SECOND)
    assert peer.track.end == LAST + 1
    peer.extend_track(batch(100, 150), 2 * SECOND)
    assert (peer.track.n0, peer.track.end) == (100, 250)
    assert np.array_equal(peer.track.steps(100, 150), steps(100, 150))


@pytest.mark.parametrize(("late", "anew"), [(599, False), (600, True)])
def test_a_batch_that_ends_a_minute_before_the_track_begins_it_anew(late: int, anew: bool) -> None:
    peer = a_peer()
    peer.extend_track(batch(1_000, 150), 0)
    peer.extend_track(batch(1_150 - late - 150, 150), 0)
    assert peer.track.end == (1_150 - late if anew else 1_150)


# what the front end learns


def test_a_neighbour_carries_what_the_peer_said() -> None:
    peer = a_peer()
    peer.on_message(T0 + SECOND, T0 + 10 * MS)
    peer.take_status(a_status((Heard(*OWN, SECOND),), ranged=(1, 9), uwb_id=44), 1, OWN, 0)
    neighbour = peer.neighbour(OWN, T0)
    assert (neighbour.chain, neighbour.uwb_id, neighbour.ranges_to_us) == (CHAIN, 44, True)
    assert neighbour.ahead_us == SECOND - 5 * MS
    peer.take_status(a_status(ranged=(9,)), 2, OWN, 0)
    assert not peer.neighbour(OWN, T0).ranges_to_us


@pytest.mark.parametrize("state", PoseState)
def test_a_neighbour_is_lost_whose_pose_is_stale_and_no_other(state: PoseState) -> None:
    peer = a_peer()
    peer.take_status(replace(a_status(), state=state), 1, OWN, T0)
    neighbour = peer.neighbour(OWN, T0)
    assert neighbour.is_lost is (state is PoseState.STALE)
    assert (neighbour.frame is not None) is (state is PoseState.LOCALISED)


def test_who_is_lost_for_long_is_so_only_while_it_drives() -> None:
    """Every further status that says so leaves the beginning as it is; a pose ends it."""
    peer, stale = a_peer(), replace(a_status(), state=PoseState.STALE)
    peer.take_status(stale, 1, OWN, T0)
    peer.take_status(stale, 2, OWN, T0 + LOST_US // 2)
    assert peer.neighbour(OWN, T0 + LOST_US - 1).is_lost
    later = T0 + LOST_US
    assert not peer.neighbour(OWN, later).is_lost
    peer.extend_track(batch(0, 5), later)
    assert peer.neighbour(OWN, later + DRIVES_US - 1).is_lost
    assert not peer.neighbour(OWN, later + DRIVES_US).is_lost
    # what is known already is not driven once more
    peer.extend_track(batch(0, 5), later + DRIVES_US)
    assert not peer.neighbour(OWN, later + DRIVES_US).is_lost
    peer.take_status(replace(stale, state=PoseState.LOCALISED), 3, OWN, later)
    peer.take_status(stale, 4, OWN, later + LOST_US)
    assert peer.neighbour(OWN, later + 2 * LOST_US - 1).is_lost


@pytest.mark.parametrize(("excess_us", "known"), [(0, True), (2, False)])
def test_a_clock_that_is_known_worse_than_a_grid_step_is_not_used(
    excess_us: int, known: bool
) -> None:
    """The sum of both delays, halved, and 3.2 ms for the drift make 100 ms."""
    peer = a_peer()
    peer.on_message(T0, T0 + 96_800)
    peer.take_status(a_status((Heard(*OWN, 96_800 + excess_us),)), 1, OWN, T0)
    assert (peer.neighbour(OWN, T0).ahead_us is not None) == known


@pytest.mark.parametrize("state", PoseState)
def test_only_who_says_that_it_is_localised_can_tell_others_where_they_are(
    state: PoseState,
) -> None:
    peer = a_peer()
    peer.take_status(replace(a_status(), state=state, frame=2), 1, OWN, T0)
    expected = 2 if state is PoseState.LOCALISED else None
    assert peer.neighbour(OWN, T0).frame == expected
