"""What the encoder writes: messages under their own names, everything once."""

from __future__ import annotations

import io

import pytest

from drslamd.events import CanFrame, ChannelMessage, Datagram, Level, Note, Send, SerialData, Tick
from drslamd.gossip import lc02
from drslamd.recording.encoder import Encoder
from drslamd.recording.event_log import Entry, entries
from drslamd.recording.records import RECENT, SENDERS

STATUS = Send("DRSLAM_STATUS_003", b"status")


def written(*pieces: bytes) -> list[Entry]:
    found = list(entries(io.BytesIO(b"".join(pieces))))
    assert all(isinstance(entry, Entry) for entry in found)
    return [entry for entry in found if isinstance(entry, Entry)]


def names(*pieces: bytes) -> list[str]:
    return [entry.channel for entry in written(*pieces)]


def datagram(
    channel: str = "DRSLAM_POSE_001", payload: bytes = b"x", sender: str = "a"
) -> Datagram:
    return Datagram(5, lc02.encode(9, channel, payload), sender)


@pytest.fixture
def encoder() -> Encoder:
    return Encoder(3, is_framed=True)


def test_a_message_that_was_heard_stands_on_its_channel_as_it_was_made(encoder: Encoder) -> None:
    _, entry = written(encoder.event(datagram()))
    assert entry == Entry(1, 5, "DRSLAM_POSE_001", b"x")


def test_who_sent_it_is_said_when_it_is_another_one(encoder: Encoder) -> None:
    heard = [datagram(sender=sender) for sender in "aab"]
    names_ = [names(encoder.event(d)) for d in heard]
    assert [len(n) for n in names_] == [2, 1, 2]
    assert names_[2][0] == "REC_FROM_003"


@pytest.mark.row("O7")
def test_of_names_without_end_no_more_senders_are_remembered_than_fit() -> None:
    encoder = Encoder(3, is_framed=True)
    for k in range(3 * SENDERS):
        encoder.event(datagram(f"OTHER_{k}"))
        assert len(encoder._senders) <= SENDERS


def test_a_message_that_was_sent_stands_once_though_it_comes_back(encoder: Encoder) -> None:
    sent = names(encoder.effects(4, [STATUS]))
    assert sent == ["REC_SENT_003", STATUS.channel]
    assert names(encoder.event(datagram(STATUS.channel, STATUS.payload))) == ["REC_OWN_003"]
    other = datagram(STATUS.channel, b"of another start")
    assert names(encoder.event(other)) == ["REC_FROM_003", STATUS.channel]


@pytest.mark.parametrize(("more", "name"), [(RECENT - 1, "REC_OWN_003"), (RECENT, STATUS.channel)])
def test_only_recent_ones_are_recognised(encoder: Encoder, more: int, name: str) -> None:
    encoder.effects(4, [STATUS, *(Send("DRSLAM_POSE_003", b"%d" % k) for k in range(more))])
    assert names(encoder.event(datagram(STATUS.channel, STATUS.payload)))[-1] == name


@pytest.mark.parametrize(
    "odd",
    [
        Datagram(5, b"no LCM", "a"),
        Datagram(5, lc02.encode(0, "REC_TICK_003", b""), "a"),
        ChannelMessage(5, "DRSLAM_POSE_001", b"x", "a"),
    ],
)
def test_what_would_be_misread_stands_as_it_came(encoder: Encoder, odd: Datagram) -> None:
    assert names(encoder.event(odd)) == ["REC_RAW_003"]


def test_bytes_of_devices_stand_as_they_were_read(encoder: Encoder) -> None:
    uwb, wheels, can = written(
        encoder.event(SerialData(1, "uwb", b"\x55\x04")),
        encoder.event(SerialData(2, "wheels", b"$ODO")),
        encoder.event(CanFrame(3, 0x1ABCDEF0, True, b"\1\2")),
    )
    assert uwb == Entry(0, 1, "REC_UWB_003", b"\x55\x04")
    assert wheels == Entry(1, 2, "REC_WHEELS_003", b"$ODO")
    assert can == Entry(2, 3, "REC_CAN_003", b"\x1a\xbc\xde\xf0\1\1\2")


def test_a_tick_tells_apart_what_was_done_before_it(encoder: Encoder) -> None:
    (before,) = written(encoder.event(Tick(1)))
    encoder.effects(1, [Note(Level.INFO, "pose.well", {"after_s": 26})])
    (after,) = written(encoder.event(Tick(1)))
    assert before.data == bytes(4)
    assert after.data != before.data
    assert encoder.effects(1, []) == b""
    assert written(encoder.event(Tick(1)))[0].data == after.data
