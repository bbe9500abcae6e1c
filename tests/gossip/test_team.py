"""Who is there and what they say: peers, presence, clocks, and the sentences for the user."""

from __future__ import annotations

from dataclasses import replace

import pytest
from acquainted import introduce
from message_builders import (
    MS,
    OTHER_SECRET,
    SECOND,
    a_seal,
    a_status,
    an_entry,
    forged,
    kinds,
    sealed,
)

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02
from drslamd.gossip.message_types import Heard, LogState, Message, OdometryBatch, Status
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.robot_model import UNTOLD, RobotModel

OWN = Chain(1, 10)
T0 = 100 * SECOND


def a_team() -> Team:
    return Team(a_seal(*OWN))


def tell(team: Team, seal: Seal, message: Message, utime: int = T0, sender: str = "") -> bool:
    """Robot `seal`, which has answered us, says something; was it accepted?"""
    if seal.robot != team.own.robot:
        introduce(team, seal, utime=utime)
    event = ChannelMessage(utime, *sealed(seal, message, utime), sender)
    return team.receive(event) is not None


def hearing(*chains: Chain, logs: tuple[LogState, ...] = (), uwb_id: int = 7) -> Status:
    return a_status(tuple(Heard(*chain, 0) for chain in chains), logs, uwb_id=uwb_id)


# what comes in


def test_a_datagram_and_the_message_in_it_are_heard_alike() -> None:
    channel, payload = sealed(a_seal(3), a_status())
    datagram = Datagram(T0, lc02.encode(9, channel, payload))
    for event in (ChannelMessage(T0, channel, payload), datagram):
        team = introduce(a_team(), Chain(3, 1))
        received = team.receive(event)
        assert received is not None
        assert (received.origin, received.message) == (Chain(3, 1), a_status())
        assert team.accepted == 1


def test_every_kind_reaches_the_peer_that_said_it() -> None:
    team, seal = a_team(), a_seal(3, epoch=11)
    said = kinds()
    for kind in ("STATUS", "ODOMETRY", "POSE", "PUBLIC"):
        assert tell(team, seal, said[kind])
    peer = team.peers[3]
    assert isinstance(said["ODOMETRY"], OdometryBatch)
    assert peer.chain == Chain(3, 11)
    assert peer.status == said["STATUS"]
    assert peer.pose == said["POSE"]
    assert (peer.track.n0, peer.track.end) == (40, 43)
    assert peer.received == 4


def test_our_own_messages_make_no_peer() -> None:
    team = a_team()
    for message in kinds().values():
        send = team.send(message, T0)
        assert team.receive(ChannelMessage(T0 + 7, send.channel, send.payload)) is None
    assert team.peers == {}
    assert (team.own_echoes, team.last_echo, dict(team.refused)) == (len(kinds()), T0 + 7, {})


def test_a_log_entry_says_nothing_of_whether_its_origin_lives() -> None:
    team = a_team()
    introduce(team, Chain(4, 1), utime=T0)
    tell(team, a_seal(4), hearing(logs=(LogState(3, 1, 0, 0, 0),)))
    assert team.receive(ChannelMessage(T0, *sealed(a_seal(3), an_entry(0, 1)))) is not None
    assert set(team.peers) == {4}
    assert team.logs.next_states()[0] == LogState(3, 1, 0, 1, 1)


@pytest.mark.parametrize(("newest", "taken"), [(3_977, True), (3_976, False)])
def test_an_entry_far_from_what_we_hold_is_taken_when_any_status_speaks_of_its_log(
    newest: int, taken: bool
) -> None:
    """A newcomer may hear an old robot through others only."""
    team = a_team()
    tell(team, a_seal(4), hearing(logs=(LogState(3, 1, 0, newest, newest),)))
    event = ChannelMessage(T0, *sealed(a_seal(3), an_entry(5_000, 1)))
    assert (team.receive(event) is not None) == taken
    assert dict(team.refused) == ({} if taken else {"entry far ahead of its log": 1})


def test_a_log_entry_is_handed_out_once_whoever_sends_it() -> None:
    team, event = a_team(), ChannelMessage(T0, *sealed(a_seal(3), an_entry(0, 1)))
    introduce(team, Chain(3, 1))
    assert team.receive(event) is not None
    assert team.receive(event) is None
    assert (team.accepted, team.repeats_heard, dict(team.refused)) == (1, 1, {})


def test_a_robot_that_starts_again_is_a_new_peer() -> None:
    team = a_team()
    tell(team, a_seal(3, epoch=5), kinds()["ODOMETRY"])
    tell(team, a_seal(3, epoch=5), an_entry(0, 1))
    assert tell(team, a_seal(3, epoch=6), a_status(), T0 + 3 * SECOND)
    assert team.peers[3].chain == Chain(3, 6)
    assert len(team.peers[3].track) == 0
    assert team.logs.next_states() == (LogState(3, 6, 0, 0, 0),)
    past = ChannelMessage(T0, *sealed(a_seal(3, epoch=5), a_status((Heard(*OWN, 0),))))
    assert team.receive(past) is None
    assert team.peers[3].chain == Chain(3, 6)


def test_a_status_that_was_overtaken_is_no_reason_to_repeat_anything() -> None:
    team, seal = a_team(), a_seal(3)
    team.append(an_entry(0, 1), T0 - 2 * SECOND)
    late = ChannelMessage(T0, *sealed(seal, a_status()))
    tell(team, seal, hearing(logs=(LogState(*OWN, 0, 1, 1),)))
    assert team.receive(late) is not None
    assert team.repeats(T0) == []


# what goes out


def test_a_message_goes_out_sealed_on_the_channel_of_its_robot() -> None:
    team, other = a_team(), introduce(Team(a_seal(3)), OWN)
    send = team.send(a_status(), T0)
    assert send.channel == "DRSLAM_STATUS_001"
    received = other.receive(ChannelMessage(T0, send.channel, send.payload))
    assert received is not None
    assert received.origin == OWN


def test_our_entry_is_what_the_others_will_read() -> None:
    """0.1 is no float of 32 bits; the owner computes with what was sent."""
    model = RobotModel(OdometryNoise(0.1, 0.1, 0.1, 0.1))
    team = a_team()
    (entry,) = team.entries(model, an_entry(0, 5).keyframes, (), ())
    own, payload = team.append(entry, T0)
    received = introduce(Team(a_seal(3)), OWN).receive(
        ChannelMessage(T0, "DRSLAM_GRAPH_001", team.send_sealed(1, payload).payload)
    )
    assert received is not None
    assert received.message == own
    assert own.model is not None
    assert own.model.noise.scale != 0.1


def test_what_our_sensors_are_like_is_said_with_the_first_of_every_64_entries() -> None:
    team = a_team()
    for k in range(130):
        for entry in team.entries(UNTOLD, an_entry(0, k).keyframes, (), ()):
            own, _ = team.append(entry, T0)
            assert bool(own.model) == (own.seq in (0, 64, 128))


def test_nothing_to_say_makes_no_entry() -> None:
    assert list(a_team().entries(UNTOLD, (), (), ())) == []


def test_what_a_peer_lacks_is_repeated_as_it_was_sealed() -> None:
    team = a_team()
    _, payload = team.append(an_entry(0, 1), T0 - SECOND)
    tell(team, a_seal(3), a_status())
    (send,) = team.repeats(T0)
    assert (send.channel, send.payload) == ("DRSLAM_GRAPH_001", payload)


# who is there


def test_the_living_are_those_that_are_heard_and_hear_us() -> None:
    team = a_team()
    tell(team, a_seal(3), hearing(OWN))
    tell(team, a_seal(4), hearing())
    tell(team, a_seal(5), hearing(Chain(1, 9)))
    assert set(team.living(T0)) == {3}
    assert set(team.living(T0 + 5 * SECOND - 1)) == {3}
    assert set(team.living(T0 + 5 * SECOND)) == set()


def test_present_are_the_living_and_whom_they_vouch_for() -> None:
    team = a_team()
    tell(team, a_seal(4, epoch=2), an_entry(0, 1))
    tell(team, a_seal(5, epoch=2), an_entry(0, 1))
    tell(team, a_seal(3), hearing(OWN, Chain(4, 2), Chain(5, 1), Chain(6, 1)))
    assert team.present(T0) == {1, 3, 4}
    assert team.present(T0 + 5 * SECOND) == {1}


def test_a_robot_that_does_not_hear_us_vouches_for_nobody() -> None:
    team = a_team()
    tell(team, a_seal(4), an_entry(0, 1))
    tell(team, a_seal(3), hearing(Chain(4, 1)))
    assert team.present(T0) == {1}


def test_we_vouch_for_those_whom_we_heard_of_late() -> None:
    team = a_team()
    tell(team, a_seal(3), a_status())
    tell(team, a_seal(4), a_status(leaving=True))
    for utime, heard in ((T0 + 5 * SECOND - 1, [3]), (T0 + 5 * SECOND, [])):
        assert [h.id for h in team.next_heard(utime)] == heard


def test_we_name_those_whom_we_hear_and_what_their_messages_took() -> None:
    team = a_team()
    for robot, arrived in ((5, 40 * MS), (3, 30 * MS), (4, 50 * MS)):
        introduce(team, Chain(robot, 1))
        team.receive(ChannelMessage(T0 + arrived, *sealed(a_seal(robot), a_status(), T0)))
    named = (Heard(3, 1, 30 * MS), Heard(4, 1, 50 * MS), Heard(5, 1, 40 * MS))
    assert team.next_heard(T0 + 60 * MS) == named


@pytest.mark.parametrize(("others", "statuses"), [(28, 1), (29, 2), (56, 2), (57, 3), (254, 10)])
def test_peers_that_do_not_fit_one_status_take_turns(others: int, statuses: int) -> None:
    team = Team(a_seal(0))
    for robot in range(1, others + 1):
        tell(team, a_seal(robot), a_status())
    named: list[int] = []
    for _ in range(statuses):
        assert len(set(named)) < others
        ids = [h.id for h in team.next_heard(T0)]
        assert len(set(ids)) == len(ids) == min(28, others)
        named += ids
    assert set(named) == set(range(1, others + 1))
    assert len(team.audible(T0)) == others


def test_a_robot_that_falls_silent_costs_nobody_else_its_turn() -> None:
    """Of 40, the first 28 are named; then number 28, where the turn stands, is no longer heard."""
    team = Team(a_seal(0))
    for robot in range(1, 41):
        tell(team, a_seal(robot), a_status(), T0 if robot == 28 else T0 + SECOND)
    assert [h.id for h in team.next_heard(T0 + SECOND)] == list(range(1, 29))
    assert [h.id for h in team.next_heard(T0 + 5 * SECOND)] == [*range(29, 41), *range(1, 17)]


def test_a_peer_is_forgotten_after_ten_silent_minutes_and_its_log_is_not() -> None:
    team = a_team()
    tell(team, a_seal(3), a_status())
    team.forget_silent(T0 + 600 * SECOND)
    assert set(team.peers) == {3}
    team.forget_silent(T0 + 600 * SECOND + 1)
    assert team.peers == {}
    assert team.logs.epoch(3) == 1


# UWB modules and clocks


def test_a_module_belongs_to_the_robot_that_says_so() -> None:
    team = a_team()
    assert team.robot_of_uwb(70) is None
    tell(team, a_seal(3), kinds()["POSE"])
    tell(team, a_seal(4), hearing(uwb_id=70))
    assert team.robot_of_uwb(70) == 4
    assert team.robot_of_uwb(71) is None


def test_a_module_that_two_robots_claim_belongs_to_nobody_and_is_spoken_of() -> None:
    team = a_team()
    tell(team, a_seal(3), hearing(uwb_id=70))
    assert dict(team.conditions(T0))["team.uwb_id"] is None
    tell(team, a_seal(4), hearing(uwb_id=70))
    assert team.robot_of_uwb(70) is None
    assert dict(team.conditions(T0))["team.uwb_id"] == (
        "robots 3 and 4 all claim UWB module 70, so its ranges cannot be used; "
        "give every robot the uwb.id of its own module"
    )


def test_a_module_moves_with_its_robot_once_the_last_owner_is_silent() -> None:
    team, other = a_team(), a_seal(4)
    tell(team, a_seal(3), hearing(uwb_id=70))
    tell(team, other, hearing(uwb_id=70), T0 + 5 * SECOND - 1)
    assert team.robot_of_uwb(70) is None
    tell(team, other, hearing(uwb_id=70), T0 + 5 * SECOND)
    assert team.robot_of_uwb(70) == 4
    assert dict(team.conditions(T0 + 5 * SECOND))["team.uwb_id"] is None


PERIOD = 2**32 * MS


@pytest.mark.parametrize("wrap", [-PERIOD, 0, PERIOD])
def test_radio_clocks_are_compared_modulo_their_period(wrap: int) -> None:
    team = a_team()
    status = a_status((Heard(*OWN, 8 * SECOND + 9 * MS),), uwb_clock_us=50 * SECOND + wrap)
    team.receive(ChannelMessage(T0, *sealed(a_seal(3), status, T0 + 8 * SECOND - 1 * MS)))
    team.compare_radio_clocks(42 * SECOND, T0)
    assert team.peers[3].neighbour(OWN, T0).ahead_us == 8 * SECOND


@pytest.mark.parametrize(("own", "theirs"), [(None, 50 * SECOND), (42 * SECOND, -(2**63))])
def test_a_radio_clock_that_one_side_does_not_know_is_not_compared(
    own: int | None, theirs: int
) -> None:
    team = a_team()
    status = a_status((Heard(*OWN, 0),), uwb_clock_us=theirs)
    team.receive(ChannelMessage(T0, *sealed(a_seal(3), status, T0)))
    team.compare_radio_clocks(own, T0)
    offset = team.peers[3].clock.offset(T0)
    assert offset is not None
    assert offset.source == "messages"


def test_what_a_silent_peer_said_of_its_radio_clock_is_not_taken_for_fresh() -> None:
    team = a_team()
    status = a_status((Heard(*OWN, 0),), uwb_clock_us=0)
    team.receive(ChannelMessage(T0, *sealed(a_seal(3), status, T0)))
    team.compare_radio_clocks(0, T0 + 5 * SECOND)
    offset = team.peers[3].clock.offset(T0 + 5 * SECOND)
    assert offset is not None
    assert offset.source == "messages"


# our own id and epoch


def test_a_robot_that_lost_its_memory_learns_its_last_epoch_after_any_silence() -> None:
    peer = Team(a_seal(3))
    tell(peer, a_seal(1, epoch=12), a_status(), T0)
    team = a_team()
    for seconds in (60, 63):
        utime = T0 + seconds * SECOND
        status = a_status(peer.next_heard(utime), peer.logs.next_states())
        assert team.superseded_by is None
        tell(team, a_seal(3, epoch=seconds), status, utime)
    assert team.superseded_by == 12


def test_relays_of_our_own_log_from_another_start_do_not_look_like_another_robot() -> None:
    team = a_team()
    for epoch in (9, 12):
        assert not tell(team, a_seal(1, epoch), an_entry(0, 1))
    assert not team.namesakes.is_own_id_heard(T0)
    assert dict(team.refused) == {"of another start of this robot, repeated by a peer": 2}


# sentences


WRONG_TAG = (
    "hears messages that do not fit the team key, from 10.0.0.7; "
    "give all robots the same team.key_file"
)
WRONG_VERSION = (
    "hears messages of another version of drslamd, from 10.0.0.7; "
    "install the same version on all robots"
)
OWN_ID_HEARD = (
    "hears messages under its own id 1 that it did not make, from 10.0.0.7: another robot uses the "
    "id and does not hear this one, or somebody plays a recording; give every robot a robot.id of "
    "its own"
)


@pytest.mark.parametrize(
    ("key", "message", "sentence"),
    [
        ("team.wrong_tag", forged(a_status(), secret=OTHER_SECRET), WRONG_TAG),
        ("team.wrong_version", forged(a_status(), version=1), WRONG_VERSION),
        ("team.own_id_used", forged(a_status(), robot=1, epoch=11), OWN_ID_HEARD),
    ],
)
def test_what_somebody_must_do_something_about_is_said_for_ten_seconds(
    key: str, message: tuple[str, bytes], sentence: str
) -> None:
    team = a_team()
    assert all(said is None for _, said in team.conditions(T0))
    team.receive(ChannelMessage(T0, *message, "10.0.0.7"))
    assert dict(team.conditions(T0 + 10 * SECOND - 1))[key] == sentence
    assert [k for k, said in team.conditions(T0) if said] == [key]
    assert dict(team.conditions(T0 + 10 * SECOND))[key] is None
    assert team.namesakes.is_own_id_heard(T0) == (key == "team.own_id_used")


def test_a_sender_without_a_name_is_called_unknown() -> None:
    team = a_team()
    team.receive(ChannelMessage(T0, *forged(a_status(), secret=OTHER_SECRET)))
    assert "from an unknown sender" in str(dict(team.conditions(T0))["team.wrong_tag"])


def test_what_our_sensors_are_like_is_said_again_as_soon_as_it_is_another() -> None:
    team = a_team()
    turned = replace(UNTOLD, noise=replace(UNTOLD.noise, gyro=GyroNoise(0.25, 0.5, 70)))
    said = []
    for k in range(8):
        if k == 5:  # without measurements there is no entry that could say it
            assert not list(team.entries(turned, (), (), ()))
        for entry in team.entries(UNTOLD if k < 5 else turned, an_entry(0, k).keyframes, (), ()):
            said.append(team.append(entry, T0)[0].model)
    assert said[1:] == [None] * 4 + [turned_as_sent(said[5])] + [None] * 2


def turned_as_sent(model: RobotModel | None) -> RobotModel:
    assert model is not None
    assert model.noise.gyro == GyroNoise(0.25, 0.5, 70)
    return model
