"""Nobody is believed before it has answered this very start: a recording cannot."""

from __future__ import annotations

import pytest
from message_builders import SECOND, a_seal, a_status, an_entry, forged, kinds, sealed
from snapshots import plain
from teams import EASY, VirtualTeam

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02
from drslamd.gossip.membership.acquaintance import vouched
from drslamd.gossip.message_types import UNANSWERED, Heard, LogState, Message
from drslamd.gossip.peer import Peer
from drslamd.gossip.team import Team

OWN = Chain(1, 10)
T0 = 100 * SECOND
ANSWER = a_status((Heard(*OWN, 0),))
STRANGER = "of a robot that has not answered this start"


def says(
    team: Team, message: Message, counter: int, robot: int = 3, utime: int = T0, sender: str = ""
) -> bool:
    event = ChannelMessage(utime, *forged(message, robot=robot, counter=counter), sender)
    return team.receive(event) is not None


def of_others(team: Team) -> object:
    """What is known of others, but for voices and counters."""
    left_out = {"refusals", "acquaintance"}
    return {key: plain(value) for key, value in vars(team).items() if key not in left_out}


# the handshake


def test_nothing_of_a_stranger_is_taken_but_that_its_voice_is_named() -> None:
    team = Team(a_seal(*OWN))
    before = of_others(team)
    seal = a_seal(3, epoch=11)
    for message in kinds().values():
        assert team.receive(ChannelMessage(T0, *sealed(seal, message))) is None
    assert of_others(team) == before
    assert dict(team.refused) == {STRANGER: len(kinds())}
    team = Team(a_seal(*OWN))
    assert not says(team, a_status(), 1)
    assert team.next_heard(T0) == (Heard(3, 1, UNANSWERED),)


def test_a_robot_counts_from_its_first_status_on_that_names_this_start() -> None:
    team = Team(a_seal(*OWN))
    assert not says(team, a_status((Heard(1, 9, 0),)), 1)
    assert not says(team, a_status((Heard(2, 10, 0),)), 2)
    assert not says(team, an_entry(0, 1), 3)
    assert says(team, ANSWER, 4)
    assert says(team, an_entry(0, 1), 3)
    assert says(team, a_status(), 5)
    assert set(team.living(T0)) == set()


@pytest.mark.parametrize(("counter", "taken"), [(49, False), (50, False), (51, True)])
def test_what_was_said_before_the_answer_never_counts(counter: int, taken: bool) -> None:
    team = Team(a_seal(*OWN))
    assert says(team, ANSWER, 50)
    assert says(team, a_status(), counter) == taken


def test_an_answer_with_a_false_counter_mutes_nobody() -> None:
    team = Team(a_seal(*OWN))
    assert says(team, ANSWER, 2**31 - 1)
    assert not says(team, kinds()["POSE"], 7)
    assert says(team, ANSWER, 8)
    assert says(team, kinds()["POSE"], 9)


def test_two_fresh_robots_have_met_after_two_statuses_each() -> None:
    first, second = Team(a_seal(1)), Team(a_seal(2))
    for utime in (T0, T0 + SECOND):
        for speaker, hearer in ((first, second), (second, first)):
            status = a_status(speaker.next_heard(utime), speaker.logs.next_states())
            send = speaker.send(status, utime)
            hearer.receive(ChannelMessage(utime + 1, send.channel, send.payload))
    assert set(first.living(T0 + SECOND)) == {2}
    assert set(second.living(T0 + SECOND)) == {1}


def test_who_is_only_waited_for_is_not_vouched_for_as_living() -> None:
    team = Team(a_seal(*OWN))
    assert says(team, ANSWER, 1, robot=4)
    logs = (LogState(3, 1, 0, 1, 1),)
    assert says(team, a_status((Heard(*OWN, 0), Heard(3, 1, UNANSWERED)), logs), 2, robot=4)
    assert says(team, an_entry(0, 1), 1)
    assert team.present(T0) == {1, 4}
    assert says(team, a_status((Heard(*OWN, 0), Heard(3, 1, 5)), logs), 3, robot=4)
    assert team.present(T0) == {1, 3, 4}


# logs that come through others


def test_a_log_counts_when_an_acquaintance_holds_it() -> None:
    peer = Peer(Chain(4, 1), T0)
    peer.take_status(a_status((), (LogState(3, 7, 0, 5, 5),)), 1, OWN, T0)
    assert vouched(Chain(3, 7), [peer])
    assert not vouched(Chain(3, 6), [peer])
    assert not vouched(Chain(5, 7), [peer])
    assert not vouched(Chain(3, 7), [])


def test_the_word_of_a_stranger_brings_in_no_log() -> None:
    team = Team(a_seal(*OWN))
    assert not says(team, a_status((), (LogState(3, 1, 0, 1, 1),)), 1, robot=4)
    assert not says(team, an_entry(0, 1), 1)
    assert says(team, a_status((Heard(*OWN, 0),), (LogState(3, 1, 0, 1, 1),)), 2, robot=4)
    assert says(team, an_entry(0, 1), 1)


# what is said of it


def sentence(team: Team, utime: int) -> str | None:
    return dict(team.conditions(utime))["team.recording"]


@pytest.mark.parametrize(("seconds", "is_said"), [(9, False), (10, True)])
def test_two_robots_with_one_voice_that_answer_nothing_are_a_recording(
    seconds: int, is_said: bool
) -> None:
    team = Team(a_seal(*OWN))
    for second in range(seconds + 1):
        for robot in (3, 4):
            utime = T0 + second * SECOND
            says(team, a_status(), 1 + second, robot, utime, "10.0.0.66")
    said = sentence(team, T0 + seconds * SECOND)
    assert (said is not None) == is_said
    assert said is None or ("from 10.0.0.66" in said and "plays a recording" in said)


def test_robots_at_two_places_that_do_not_hear_us_are_none() -> None:
    team = Team(a_seal(*OWN))
    for second in range(20):
        for robot in (3, 4):
            says(team, a_status(), 1 + second, robot, T0 + second * SECOND, f"10.0.0.{robot}")
    assert sentence(team, T0 + 19 * SECOND) is None


@pytest.mark.parametrize(("after", "is_said"), [(10 * SECOND - 1, False), (10 * SECOND, True)])
def test_who_speaks_of_an_earlier_start_of_ours_for_long_is_a_recording(
    after: int, is_said: bool
) -> None:
    team = Team(a_seal(*OWN))
    says(team, a_status((Heard(1, 9, 0),)), 1)
    says(team, a_status((Heard(1, 9, 0),)), 2, utime=T0 + after)
    assert (sentence(team, T0 + after) is not None) == is_said
    assert sentence(team, T0 + after + 5 * SECOND) is None


# the whole of it


@pytest.mark.row("S4")
@pytest.mark.parametrize("epochs", [{}, {1: 1, 2: 1}], ids=["memory lost", "epochs kept"])
@pytest.mark.slow
def test_a_recording_of_absent_robots_changes_nothing_and_is_called_one(
    epochs: dict[int, int],
) -> None:
    """S4: what two robots said in half a minute, from one address, to a third that begins anew."""
    team = VirtualTeam(EASY)
    team.run(30.0)
    said = sorted((t, c, p) for r in (1, 2) for t, c, p in team.member(r).traces.sent)
    for member in team.simulator.members.values():
        team.simulator.kill(member)
    fresh, simulator = team.start(0, epoch=9, epochs=epochs), team.simulator
    begins, digest = simulator.now, fresh.robot.back.digest()
    for number, (t, channel, payload) in enumerate(said):
        data = lc02.encode(number, channel, payload)

        def play(data: bytes = data) -> None:
            simulator.handle(fresh, lambda utime: Datagram(utime, data, "10.0.0.66"))

        simulator.at(begins + t, play)
    team.run(55.0)
    assert "plays a recording" in team.problems(0)
    team.run(75.0)
    heard = fresh.robot.team
    assert heard.accepted == 0
    assert dict(heard.refused) == {STRANGER: len(said)}
    assert len(said) > 100
    assert fresh.robot.back.digest() == digest
    # it has a log of its own by now, and has heard nobody
    assert heard.peers == {}
    assert heard.acquaintance.strangers == {}
    assert set(heard.logs._logs) <= {0}
    assert heard.seal.epochs == epochs
    assert set(fresh.robot.back.graph.chains) <= {0}
