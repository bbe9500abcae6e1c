"""Which start of a robot may speak, and when we have to begin again: no single message decides."""

from __future__ import annotations

import pytest
from message_builders import SECOND, a_seal, a_status, an_entry, forged, sealed

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage
from drslamd.gossip.message_types import Heard, LogState, Message
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team

OWN = Chain(1, 10)
T0 = 100 * SECOND
YEAR_2255 = 2**53
STEP = 2**32
LAST_KEPT = 2**53 + 2**44
HIGHEST = YEAR_2255 + STEP
"""What one message can make believe of a robot."""


def a_team(epochs: dict[int, int] | None = None) -> Team:
    seal = a_seal(*OWN)
    return Team(Seal(seal._key, *OWN, epochs or {}))


ANSWER = a_status((Heard(*OWN, 0),))


def says(team: Team, message: Message, epoch: int, utime: int = T0, counter: int = 1) -> bool:
    """Robot 3 says something under an epoch; is it heard?"""
    event = ChannelMessage(utime, *forged(message, robot=3, epoch=epoch, counter=counter))
    return team.receive(event) is not None


# who speaks


@pytest.mark.parametrize("message", [ANSWER, a_status()], ids=["that answers", "of a stranger"])
@pytest.mark.parametrize(("after", "heard"), [(3 * SECOND - 1, False), (3 * SECOND, True)])
def test_a_later_start_is_heard_when_the_one_before_it_was_silent_for_three_seconds(
    message: Message, after: int, heard: bool
) -> None:
    team = a_team()
    assert says(team, ANSWER, 5)
    takes = heard and message is ANSWER
    assert says(team, message, 6, T0 + after) == takes
    assert team.seal.epochs == {3: 6 if takes else 5}
    assert team.logs.epoch(3) == (6 if takes else 5)
    too_soon = dict(team.refused) == {"of another start than the one that speaks": 1}
    assert too_soon == (not heard)


def test_a_robot_that_said_goodbye_may_begin_again_at_once() -> None:
    team = a_team()
    says(team, a_status((Heard(*OWN, 0),), leaving=True), 5)
    assert says(team, ANSWER, 6)


def test_a_robot_that_speaks_is_heard_on_whatever_is_said_under_its_id() -> None:
    team = a_team()
    for k in range(20):
        assert says(team, ANSWER, 5, T0 + k * SECOND, counter=1 + k)
        assert not says(team, ANSWER, HIGHEST - k, T0 + k * SECOND + 1)
    assert team.seal.epochs == {3: 5}


def test_a_message_that_says_nonsense_begins_no_start() -> None:
    team = a_team()
    assert says(team, ANSWER, 5)
    assert not says(team, an_entry(-1), 6, T0 + 10 * SECOND)
    assert team.seal.epochs == {3: 5}
    assert says(team, ANSWER, 5, T0 + 10 * SECOND, counter=2)


# how high


@pytest.mark.parametrize(
    ("known", "epoch", "heard"),
    [
        (None, HIGHEST, True),
        (None, HIGHEST + 1, False),
        (5, HIGHEST + 1, False),
        (HIGHEST, HIGHEST + STEP, True),
        (HIGHEST, HIGHEST + STEP + 1, False),
        (None, 2**62, False),
        (None, 2**63 - 1, False),
    ],
)
def test_one_message_lifts_what_is_believed_of_a_robot_by_a_step(
    known: int | None, epoch: int, heard: bool
) -> None:
    team = a_team({} if known is None else {3: known})
    assert says(team, ANSWER, epoch) == heard
    assert heard or dict(team.refused) == {"of a start later than any clock can say": 1}


def test_who_was_lied_high_is_heard_by_a_newcomer_after_as_many_messages_as_there_were_lies() -> (
    None
):
    team, high = a_team(), YEAR_2255 + 5 * STEP
    heard = [says(team, ANSWER, high, T0 + k, counter=1 + k) for k in range(6)]
    assert heard == [False] * 4 + [True] * 2
    assert team.seal.epochs == {3: high}


def test_a_start_beyond_all_clocks_is_spoken_of() -> None:
    team = a_team()
    event = ChannelMessage(T0, *forged(a_status(), robot=3, epoch=2**62), "10.0.0.7")
    team.receive(event)
    sentence = dict(team.conditions(T0))["team.beyond_clocks"]
    assert sentence is not None
    assert "10.0.0.7" in sentence


# our own start


def claims(
    heard: tuple[int, ...] = (),
    logs: tuple[LogState, ...] = (),
    *,
    seconds: float = 2.0,
    has_spoken: bool = True,
) -> int | None:
    """What we believe of our own start after a peer said this twice, some seconds apart."""
    team, seal = a_team(), a_seal(3)
    if has_spoken:
        team.send(a_status(), T0)
    for utime in (T0, T0 + round(seconds * SECOND)):
        assert team.superseded_by is None
        status = a_status(tuple(Heard(1, epoch, 0) for epoch in heard), logs)
        team.receive(ChannelMessage(utime, *sealed(seal, status, utime)))
    return team.superseded_by


def log(epoch: int, complete: int = 0, first: int = 0) -> tuple[LogState, ...]:
    return (LogState(1, epoch, first, complete, complete),)


def test_a_later_start_of_ours_counts_when_a_peer_says_so_twice_two_seconds_apart() -> None:
    assert claims(heard=(12,)) == 12
    assert claims(logs=log(12)) == 12
    assert claims(heard=(12,), seconds=1.999_999) is None


def test_another_peer_confirms_nothing() -> None:
    team = a_team()
    for robot, utime in ((3, T0), (4, T0 + 5 * SECOND)):
        status = a_status((Heard(1, 12, 0),))
        team.receive(ChannelMessage(utime, *sealed(a_seal(robot), status, utime)))
    assert team.superseded_by is None


def test_a_peer_that_takes_its_word_back_has_said_nothing() -> None:
    team, seal = a_team(), a_seal(3)
    team.send(a_status(), T0)
    for k, epoch in enumerate((12, 10, 12)):
        status = a_status((Heard(1, epoch, 0),))
        team.receive(ChannelMessage(T0 + 2 * k * SECOND, *sealed(seal, status, T0)))
    assert team.superseded_by is None


@pytest.mark.parametrize("epoch", [9, 10])
def test_a_peer_that_heard_this_start_or_an_earlier_one_says_nothing_of_the_kind(
    epoch: int,
) -> None:
    assert claims((epoch,), log(epoch)) is None


def test_a_peer_that_hears_us_has_taken_no_later_start_for_ours() -> None:
    assert claims(heard=(10, 12)) is None
    assert claims(heard=(10,), logs=log(12)) is None


@pytest.mark.parametrize("epoch", [HIGHEST, HIGHEST + 1, 2**62])
def test_a_claim_beyond_all_clocks_is_followed_by_a_step_only(epoch: int) -> None:
    assert claims(heard=(epoch,)) == HIGHEST


def test_of_several_claims_the_highest_counts() -> None:
    assert claims(heard=(11, 13), logs=log(12)) == 13


def test_a_robot_that_was_lied_high_and_lost_its_memory_comes_back_there_in_steps() -> None:
    high, own = YEAR_2255 + 3 * STEP, 10
    for _ in range(3):
        team, seal = Team(a_seal(1, own)), a_seal(3)
        for utime in (T0, T0 + 2 * SECOND):
            status = a_status((Heard(1, high, 0),))
            team.receive(ChannelMessage(utime, *sealed(seal, status, utime)))
        assert team.superseded_by is not None
        assert team.superseded_by > own
        own = team.superseded_by + 1
    assert own > high


@pytest.mark.parametrize(
    ("own", "followed"), [(LAST_KEPT - 3 * 10**6, True), (LAST_KEPT - 10**6, False)]
)
def test_no_claim_leads_beyond_what_can_be_kept(own: int, followed: bool) -> None:
    team, seal = Team(a_seal(1, own)), a_seal(3)
    for utime in (T0, T0 + 2 * SECOND):
        status = a_status((Heard(1, 2**62, 0),))
        team.receive(ChannelMessage(utime, *sealed(seal, status, utime)))
    assert team.superseded_by == (LAST_KEPT - 2 * 10**6 if followed else None)


def test_entries_of_our_log_that_we_never_made_show_that_this_epoch_was_used_before() -> None:
    assert claims(heard=(10,), logs=log(10, complete=1)) == 10
    assert claims(heard=(10,), logs=log(10, complete=0)) is None


@pytest.mark.row("S7")
def test_before_the_first_word_whoever_knows_our_number_knows_another_start() -> None:
    assert claims(heard=(10,), has_spoken=False) == 10
    assert claims(logs=log(10), has_spoken=False) == 10
    assert claims(heard=(9,), logs=log(9, complete=5), has_spoken=False) is None
    assert claims(logs=log(10)) is None


def test_what_was_claimed_before_our_first_word_counts_no_more_after_it() -> None:
    team, seal = a_team(), a_seal(3)
    for k, epoch in enumerate((10, 12)):
        utime = T0 + 2 * k * SECOND
        status = a_status((Heard(1, epoch, 0),))
        team.receive(ChannelMessage(utime, *sealed(seal, status, utime)))
        team.send(a_status(), utime)
    assert team.superseded_by is None


@pytest.mark.row("S9")
@pytest.mark.parametrize("twice", [True, False])
def test_a_peer_must_say_the_very_same_twice(twice: bool) -> None:
    for first, other in (((Heard(1, 12, 0),), (Heard(1, 13, 0),)), (log(10, 5), log(10, 6))):
        team, seal = a_team(), a_seal(3)
        team.send(a_status(), T0)
        for k, said in enumerate((first, first if twice else other)):
            utime = T0 + 2 * k * SECOND
            is_heard = isinstance(said[0], Heard)
            status = a_status(said, ()) if is_heard else a_status((), said)  # type: ignore[arg-type]
            team.receive(ChannelMessage(utime, *sealed(seal, status, utime)))
        assert (team.superseded_by is not None) == twice


def test_who_holds_none_of_our_entries_proves_nothing_by_where_it_waits() -> None:
    assert claims(logs=log(10, complete=2**31 - 1, first=2**31 - 1)) is None


def test_what_we_said_ourselves_proves_nothing() -> None:
    team, seal = a_team(), a_seal(3)
    team.append(an_entry(0, 1), T0)
    for utime in (T0, T0 + 2 * SECOND):
        status = a_status(logs=log(10, complete=1))
        team.receive(ChannelMessage(utime, *sealed(seal, status, utime)))
    assert team.superseded_by is None
