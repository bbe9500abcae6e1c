"""Strangers, replays and garbage: they change nothing but counters, and each counts once."""

from __future__ import annotations

import copy
import random
import struct
from collections.abc import Iterator
from typing import Any

import pytest
from acquainted import introduce
from message_builders import (
    OTHER_SECRET,
    SECOND,
    a_seal,
    a_status,
    an_entry,
    forged,
    kinds,
    resealed,
    sealed,
)
from snapshots import plain

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02, messages
from drslamd.gossip.message_types import Heard, LogState
from drslamd.gossip.team import Team

OWN = Chain(1, 10)
T0 = 100 * SECOND
COUNTERS = {"refusals", "own_echoes", "last_echo", "repeats_heard"}
"""What an unproven message may change: counts, and what the user is told of them."""


def snapshot(team: Team) -> Any:
    return {key: plain(value) for key, value in vars(team).items() if key not in COUNTERS}


def a_busy_team() -> tuple[Team, list[ChannelMessage]]:
    """A team in full conversation, and all that robot 3 has said in it."""
    team, seal = Team(a_seal(*OWN)), a_seal(3, epoch=11)
    team.append(an_entry(0, 4), T0)
    introduce(team, seal, utime=T0)
    said = [*kinds().values(), an_entry(0, 1), an_entry(1, 2), a_status((Heard(*OWN, 5),))]
    events = [ChannelMessage(T0, *sealed(seal, message, T0), "10.0.0.3") for message in said]
    for event in events:
        assert team.receive(event) is not None
    return team, events


def framed(event: ChannelMessage) -> bytes:
    return lc02.encode(0, event.channel, event.payload)


def hostile(events: list[ChannelMessage]) -> Iterator[Datagram]:
    """What a stranger who recorded everything and has no key can put on the air."""
    draw = random.Random(5)
    for event in events:
        data = framed(event)
        header = 8 + len(event.channel) + 1
        for length in range(0, len(data), 7):
            yield Datagram(T0 + 1, data[:length], "10.0.0.66")
        for _ in range(500):
            flipped = bytearray(data)
            # LCM's sequence number, bytes 4 to 7, is not ours to judge
            at = draw.choice([*range(4), *range(8, len(data))])
            flipped[at] ^= 1 << draw.randrange(8)
            yield Datagram(T0 + 1, bytes(flipped), "10.0.0.66")
        for counter in (1, 100, 2**30, 2**31 - 1):
            for epoch in (0, 11, 12, 2**63 - 1):
                altered = bytearray(event.payload)
                struct.pack_into(">qi", altered, 11, epoch, counter)
                fake = resealed(event.channel, bytes(altered), OTHER_SECRET)
                yield Datagram(T0 + 1, data[:header] + bytes(altered), "10.0.0.66")
                yield Datagram(T0 + 1, data[:header] + fake, "10.0.0.66")
        yield Datagram(T0 + 1, b"LC03" + data[4:], "10.0.0.66")
        yield Datagram(T0 + 1, data + bytes(1400), "10.0.0.66")
    for _ in range(500):
        yield Datagram(T0 + 1, draw.randbytes(draw.randrange(100)), "10.0.0.66")


@pytest.mark.row("S1")
@pytest.mark.row("N7")
def test_a_stranger_changes_nothing_but_counters() -> None:
    team, events = a_busy_team()
    before = snapshot(team)
    count = 0
    for datagram in hostile(events):
        assert team.receive(datagram) is None
        count += 1
    assert snapshot(team) == before
    assert team.refused.total() == count > 4500


@pytest.mark.row("S3")
def test_a_replay_of_the_whole_conversation_changes_nothing_but_counters() -> None:
    team, events = a_busy_team()
    before = snapshot(team)
    for event in events * 3:
        assert team.receive(event) is None
    after = snapshot(team)
    for s in (before, after):
        del s["logs"]["repeats"]["pace"]  # it counts what is on the air
    assert after == before
    assert dict(team.refused) == {"already seen": 3 * (len(events) - 3)}
    assert team.repeats_heard == 3 * 3


def test_a_replayed_entry_counts_as_on_the_air_and_changes_nothing_else() -> None:
    """It cannot be told from the repeat of a relay, which saves us our own."""
    team, events = a_busy_team()
    before = snapshot(team)
    entries = [event for event in events if "GRAPH" in event.channel]
    for event in entries:
        later = ChannelMessage(T0 + SECOND, event.channel, event.payload)
        assert team.receive(later) is None
    after = snapshot(team)
    aired = tuple(s["logs"]["_logs"][3].pop("aired") for s in (before, after))
    for s in (before, after):
        del s["logs"]["repeats"]["_logs"]  # the same logs once more
        del s["logs"]["repeats"]["pace"]
    assert after == before
    assert aired == ({0: T0, 1: T0, 2: T0}, {0: T0 + SECOND, 1: T0 + SECOND, 2: T0 + SECOND})


@pytest.mark.row("S4")
def test_a_recording_of_an_absent_robot_does_not_bring_it_back_to_a_robot_that_restarted() -> None:
    """The replay window is empty after a start, but no recording can name this very start."""
    _, events = a_busy_team()
    restarted = Team(a_seal(1, epoch=12))
    for event in events:
        restarted.receive(event)
    assert restarted.peers == {}
    assert restarted.living(T0) == {}
    assert restarted.logs.next_states() == ()
    assert restarted.accepted == 0
    assert restarted.present(T0) == {1}


@pytest.mark.row("S5")
def test_a_recording_from_before_the_last_known_start_is_refused_as_a_whole() -> None:
    _, events = a_busy_team()
    restarted = Team(a_seal(1, epoch=12))
    restarted.seal.epochs[3] = 12
    for event in events:
        assert restarted.receive(event) is None
    assert dict(restarted.refused) == {"from before a restart of its origin": len(events)}


@pytest.mark.row("N7")
def test_everything_that_comes_in_is_counted_exactly_once() -> None:
    team, events = a_busy_team()
    received = len(events)
    own = [team.send(message, T0) for message in kinds().values()]
    more: list[Datagram | ChannelMessage] = [
        *(ChannelMessage(T0, send.channel, send.payload) for send in own),
        *events,
        *hostile(events),
        ChannelMessage(T0, "MBOT_ODOMETRY", b"x"),
        ChannelMessage(T0, *forged(a_status(), robot=1, epoch=99)),
        ChannelMessage(T0, *sealed(a_seal(3, epoch=12), a_status())),
        ChannelMessage(T0 + 3 * SECOND, *sealed(a_seal(3, epoch=13), a_status((Heard(*OWN, 5),)))),
        ChannelMessage(T0, *forged(a_status(), robot=4, epoch=2**62)),
        ChannelMessage(T0, *forged(an_entry(5_000), robot=4)),
        ChannelMessage(T0, *forged(a_status(), robot=4, utime=-1)),
    ]
    for event in more:
        before = team.accepted + team.refused.total() + team.own_echoes + team.repeats_heard
        team.receive(event)
        after = team.accepted + team.refused.total() + team.own_echoes + team.repeats_heard
        assert after == before + 1
    received += len(more)
    assert team.accepted + team.refused.total() + team.own_echoes + team.repeats_heard == received
    assert team.accepted == len(events) + 1
    assert team.own_echoes == len(kinds())


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        (Datagram(T0, b"LC02"), "datagram too short"),
        (Datagram(T0, bytes(2000)), "datagram too long"),
        (Datagram(T0, b"12345678"), "not an LCM datagram"),
        (Datagram(T0, b"LC03" + bytes(20)), "fragmented LCM message"),
        (Datagram(T0, b"LC02\0\0\0\0CHANNEL"), "channel without its NUL"),
        (Datagram(T0, b"LC02\0\0\0\0\xff\0"), "channel is empty or not ASCII"),
        (Datagram(T0, b"LC02\0\0\0\0POSE\0xyz"), "channel of another program"),
        (ChannelMessage(T0, "POSE", b"xyz"), "channel of another program"),
        (ChannelMessage(T0, "DRSLAM_POSE_\N{SNOWMAN}", b"xyz"), "channel of another program"),
        (ChannelMessage(T0, "DRSLAM_POSE_003", b"xyz"), "message too short"),
        (ChannelMessage(T0, "DRSLAM_POSE_003", bytes(1401)), "message too long"),
        (ChannelMessage(T0, "DRSLAM_POSE_003", bytes(100)), "unknown message type"),
        (ChannelMessage(T0, *forged(a_status(), version=1)), "other version of the messages"),
        (ChannelMessage(T0, *forged(a_status(), epoch=-1)), "from before a restart of its origin"),
        (ChannelMessage(T0, *forged(a_status(), counter=0)), "already seen"),
        (
            ChannelMessage(T0, *forged(a_status(), secret=OTHER_SECRET)),
            "tag does not fit the team key",
        ),
        (ChannelMessage(T0, *forged(a_status(), robot=1, epoch=11)), "another robot uses this id"),
        (ChannelMessage(T0, *forged(a_status())), "of a robot that has not answered this start"),
        (
            ChannelMessage(T0, *forged(an_entry(0), robot=1, epoch=11)),
            "of another start of this robot, repeated by a peer",
        ),
        (ChannelMessage(T0, *forged(an_entry(-1))), "content out of range"),
        (ChannelMessage(T0, *forged(an_entry(1_024), robot=4)), "entry far ahead of its log"),
        (
            ChannelMessage(T0, *forged(a_status(), epoch=2**53 + 2**32 + 1)),
            "of a start later than any clock can say",
        ),
        (ChannelMessage(T0, *forged(a_status(), utime=-1)), "made at a time that no clock shows"),
    ],
)
def test_every_reason_has_a_counter_of_its_own(
    event: Datagram | ChannelMessage, reason: str
) -> None:
    team = introduce(Team(a_seal(*OWN)), Chain(4, 1))
    assert team.receive(event) is None
    assert dict(team.refused) == {reason: 1}
    assert (team.accepted, team.own_echoes, team.repeats_heard) == (0, 0, 0)


def test_a_message_on_the_channel_of_another_robot_is_refused() -> None:
    team, seal = Team(a_seal(*OWN)), a_seal(3)
    channel = messages.channel("STATUS", 4)
    payload = seal.close(channel, messages.encode(seal.header(0), a_status()))
    assert team.receive(ChannelMessage(T0, channel, payload)) is None
    assert dict(team.refused) == {"channel of another robot": 1}
    assert team.peers == {}


@pytest.mark.row("S10")
def test_a_relay_cannot_alter_an_entry() -> None:
    event = ChannelMessage(T0, *sealed(a_seal(3), kinds()["GRAPH"]))
    team = introduce(Team(a_seal(*OWN)), Chain(3, 1))
    for bit in range(8 * len(event.payload)):
        altered = bytearray(event.payload)
        altered[bit // 8] ^= 1 << bit % 8
        assert team.receive(ChannelMessage(T0, event.channel, bytes(altered))) is None
    assert team.logs.next_states() == (LogState(3, 1, 0, 0, 0),)
    assert team.receive(event) is not None


def test_the_tables_of_a_team_grow_with_proven_robots_only() -> None:
    team = Team(a_seal(*OWN))
    for robot in range(2, 255):
        team.receive(ChannelMessage(T0, *forged(a_status(), robot=robot, secret=OTHER_SECRET)))
    assert (team.peers, team.seal.epochs, team.logs.next_states()) == ({}, {}, ())


def test_a_snapshot_would_show_a_change() -> None:
    """The other tests rest on it."""
    team, _ = a_busy_team()
    before = copy.deepcopy(snapshot(team))
    assert snapshot(team) == before
    logs = (LogState(9, 1, 0, 0, 0),)
    team.receive(ChannelMessage(T0, *sealed(a_seal(9), a_status(logs=logs))))
    assert snapshot(team) != before
