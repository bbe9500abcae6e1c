"""What an onlooker believes: with a key what it proves, without one what could be true."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest
from message_builders import OTHER_SECRET, SECRET, a_status, forged, kinds
from onlooked_team import Actor

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02
from drslamd.gossip.seal import VERSION
from drslamd.view.scene.hearing import Hearing, Said

MOST_COUNTED = 40


def of(channel: str, payload: bytes, utime: int = 0) -> Datagram:
    return Datagram(utime, lc02.encode(0, channel, payload), "10.0.0.9")


@pytest.mark.parametrize("kind", sorted(kinds()))
def test_every_kind_of_a_robot_with_the_same_key_is_believed(kind: str) -> None:
    message = kinds()[kind]
    said = Hearing(SECRET, True).receive(of(*forged(message, robot=3, epoch=11, utime=77)))
    assert said is not None
    assert (said.origin, said.utime, type(said.message)) == (Chain(3, 11), 77, type(message))


def test_a_message_that_does_not_fit_the_key_is_not_shown_and_spoken_of_for_ten_seconds() -> None:
    hearing = Hearing(SECRET, True)
    assert hearing.receive(of(*forged(a_status(), secret=OTHER_SECRET), 1_000_000)) is None
    assert hearing.refused == {"tag does not fit the team key": 1}
    (sentence,) = hearing.problems(10_999_999)
    assert sentence.startswith("messages from 10.0.0.9 do not fit the team key and are not shown")
    assert hearing.problems(11_000_000) == []


def test_without_a_key_it_is_shown_and_the_page_says_that_nothing_is_proven() -> None:
    hearing = Hearing(None, False)
    assert hearing.receive(of(*forged(a_status(), secret=OTHER_SECRET))) is not None
    assert hearing.trust().startswith("not verified")
    assert Hearing(SECRET, True).trust() == "every message was proven with the team key"


def test_what_was_seen_is_not_believed_again_with_a_key() -> None:
    hearing, datagram = Hearing(SECRET, True), of(*forged(a_status()))
    assert hearing.receive(datagram) is not None
    assert hearing.receive(datagram) is None
    assert hearing.refused == {"already seen": 1}


def test_another_version_is_named_with_its_remedy() -> None:
    hearing = Hearing(None, False)
    assert hearing.receive(of(*forged(a_status(), version=VERSION + 1))) is None
    assert "install the same version" in hearing.problems(0)[0]


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        (Datagram(0, b""), "datagram too short"),
        (Datagram(0, os.urandom(3_000)), "datagram too long"),
        (of("OTHER", b"x" * 60), "channel of another program"),
        (of("DRSLAM_POSE_255", b"x" * 60), "channel of another program"),
        (of("DRSLAM_POSE_003", b"x" * 60), "unknown message type"),
        (ChannelMessage(0, "DRSLAM_POSE_003", b"x"), "message too short"),
        (of("DRSLAM_STATUS_004", forged(a_status(), robot=3)[1]), "channel of another robot"),
        (of("DRSLAM_STATUS_003", forged(a_status())[1] + b"!"), "content out of range"),
    ],
)
@pytest.mark.parametrize("verifies", [False])
def test_what_is_malformed_is_counted_by_its_reason(
    event: Datagram | ChannelMessage, reason: str, verifies: bool
) -> None:
    hearing = Hearing(None, verifies)
    assert hearing.receive(event) is None
    assert hearing.refused == {reason: 1}


def test_without_a_key_an_earlier_start_speaks_only_after_three_seconds_of_silence() -> None:
    hearing = Hearing(None, False)
    assert hearing.receive(of(*forged(a_status(), epoch=9), 0)) is not None
    assert hearing.receive(of(*forged(a_status(), epoch=8), 2_999_999)) is None
    assert hearing.receive(of(*forged(a_status(), epoch=8), 3_000_000)) is not None
    assert hearing.receive(of(*forged(a_status(), epoch=9), 3_000_001)) is not None


def test_all_that_is_counted_is_bounded_whatever_comes() -> None:
    hearing = Hearing(None, False)
    actor = Actor(3)
    whole = actor.datagram(actor.pose(0.0), 0.0).data
    for k in range(len(whole)):
        for byte in (0, 255, whole[k] ^ 1):
            data = whole[:k] + bytes([byte]) + whole[k + 1 :]
            hearing.receive(replace(actor.datagram(actor.status(), 0.0), data=data))
            hearing.receive(Datagram(0, whole[:k]))
    assert 0 < hearing.accepted < 4 * len(whole)
    assert len(hearing.refused) < MOST_COUNTED


def test_bytes_and_messages_are_counted() -> None:
    hearing = Hearing(None, False)
    channel, payload = forged(a_status())
    said = hearing.receive(of(channel, payload))
    assert isinstance(said, Said)
    assert (hearing.accepted, hearing.octets) == (1, len(payload))
