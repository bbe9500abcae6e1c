"""What was encoded is decoded, whatever entered the robot; what nobody wrote is only named."""

from __future__ import annotations

import io
import json

import pytest
from event_strategies import effects, events, utimes
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drslamd.events import ChannelMessage, Datagram, Effect, Event, JobDone, Send, Tick
from drslamd.gossip import lc02
from drslamd.recording import decoder, digest
from drslamd.recording.decoder import Decoder, Unreadable
from drslamd.recording.encoder import Encoder
from drslamd.recording.event_log import Entry, entries
from drslamd.recording.records import KINDS, Beginning, Marked, Opening, Record, Sent, Told

SETTINGS = settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
PLACE = {"speed_mps": 0.5, "seen": [[1, 7, 120, 2**40, 1.5, -2.0, 0.2]]}
BEGINNING = Beginning(2**50, {1: 7, 2: 2**40}, {"scale": [0.1, 0.02]}, PLACE)
OPENING = Opening(5, BEGINNING, 3, {"host": "robot", "configuration": {"robot": {"id": 3}}})


def read(data: bytes, reader: Decoder | None = None) -> list[Record | Unreadable]:
    reader = reader or Decoder()
    found = []
    for entry in entries(io.BytesIO(data)):
        assert isinstance(entry, Entry)
        record = reader.decode(entry)
        if record is not None:
            found.append(record)
    return found


def as_decoded(event: Event) -> Record:
    """With what a recording does not keep left out: the number that a sender gave a datagram."""
    if isinstance(event, Tick):
        return Marked(event, 0)
    if isinstance(event, JobDone):
        return Marked(event, digest.of_result(None))
    return event


@SETTINGS
@given(st.lists(events, max_size=8), st.booleans())
def test_every_event_comes_back(happened: list[Event], is_framed: bool) -> None:
    encoder = Encoder(3, is_framed)
    data = encoder.opening(OPENING) + b"".join(encoder.event(event) for event in happened)
    assert read(data) == [OPENING, *map(as_decoded, happened)]


@SETTINGS
@given(st.lists(st.tuples(events, st.lists(effects, max_size=4)), max_size=6))
def test_what_was_sent_stands_between_the_events(
    happened: list[tuple[Event, list[Effect]]],
) -> None:
    encoder, data, wanted = Encoder(3, True), b"", []
    data += encoder.opening(OPENING)
    for event, done in happened:
        data += encoder.event(event) + encoder.effects(event.utime, done)
        wanted += [send for send in done if isinstance(send, Send)]
    found = read(data)
    assert [record.send for record in found if isinstance(record, Sent)] == wanted
    told = [record.kind for record in found if isinstance(record, Told)]
    rare = [e for _, done in happened for e in done if not isinstance(e, Send)]
    assert told == [type(effect).__name__.lower() for effect in rare]


@SETTINGS
@given(utimes, st.binary(max_size=30), st.booleans(), st.integers(0, 5))
def test_an_own_message_comes_back_as_it_was_heard(
    utime: int, payload: bytes, is_framed: bool, later: int
) -> None:
    encoder, send = Encoder(3, is_framed), Send("DRSLAM_GRAPH_001", payload)
    more: list[Effect] = [Send("DRSLAM_POSE_003", b"%d" % k) for k in range(later)]
    echo: Event = (
        Datagram(utime, lc02.encode(0, send.channel, payload), "10.0.0.3")
        if is_framed
        else ChannelMessage(utime, send.channel, payload, "")
    )
    data = encoder.opening(OPENING) + encoder.effects(utime, [send, *more]) + encoder.event(echo)
    assert read(data)[-1] == echo


def test_each_file_can_be_read_without_those_before_it() -> None:
    encoder, heard = Encoder(3, True), Datagram(5, lc02.encode(0, "DRSLAM_POSE_001", b"x"), "a")
    own = Datagram(5, lc02.encode(0, "DRSLAM_POSE_003", b"y"), "b")
    encoder.opening(OPENING)
    encoder.event(heard)
    encoder.effects(5, [Send("DRSLAM_POSE_003", b"y")])
    digest_before = encoder.digest
    second = encoder.opening(OPENING) + encoder.event(heard) + encoder.event(own)
    opening, *rest = read(second)
    assert isinstance(opening, Opening)
    assert opening.digest == digest_before != 0
    assert rest == [heard, own]


def test_after_a_gap_nothing_before_it_is_needed() -> None:
    encoder, own = Encoder(3, True), Datagram(5, lc02.encode(0, "DRSLAM_POSE_003", b"y"), "b")
    data = encoder.opening(OPENING)
    encoder.effects(5, [Send("DRSLAM_POSE_003", b"y")])  # lost
    data += encoder.gap(6, 17) + encoder.event(own)
    _, gap, found = read(data)
    assert isinstance(gap, Told)
    assert (gap.kind, gap.content["lost"]) == ("gap", 17)
    assert found == own


def test_another_robot_in_the_place_of_the_first_comes_back() -> None:
    encoder = Encoder(3, True)
    data = encoder.opening(OPENING) + encoder.beginning(9, BEGINNING)
    assert read(data)[1:] == [BEGINNING]


def opened() -> Decoder:
    reader = Decoder()
    read(Encoder(3, True).opening(OPENING), reader)
    return reader


@SETTINGS
@given(
    st.sampled_from(KINDS) | st.just("NEW") | st.text("AB_", max_size=3),
    st.binary(max_size=40)
    | st.dictionaries(st.text(), st.text()).map(lambda d: json.dumps(d).encode()),
)
def test_nothing_that_a_stranger_wrote_raises(kind: str, data: bytes) -> None:
    opened().decode(Entry(0, 1, f"REC_{kind}_003", data))


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        (Entry(0, 1, "REC_TICK_003", b"abc"), "REC_TICK_003: error unpack requires"),
        (Entry(0, 1, "REC_NEW_003", b""), "REC_NEW_003: KeyError 'NEW'"),
        (Entry(0, 1, "REC_OWN_003", b"\0\0"), "REC_OWN_003: IndexError"),
        (Entry(0, 1, "REC_TEXT_003", b"[]"), "REC_TEXT_003: "),
        (Entry(0, 1, "REC_TEXT_003", b'{"kind": "opening"}'), "REC_TEXT_003: KeyError 'format'"),
        (Entry(0, 1, "REC_TEXT_003", b'{"kind": "port"}'), "REC_TEXT_003: KeyError 'condition'"),
    ],
)
def test_what_cannot_be_understood_is_named(entry: Entry, reason: str) -> None:
    found = opened().decode(entry)
    assert isinstance(found, Unreadable)
    assert found.reason.startswith(reason)


def test_a_log_of_another_program_or_format_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    found = Decoder().decode(Entry(0, 1, "REC_TICK_003", bytes(4)))
    assert found == Unreadable(1, "the log does not begin with an opening")
    data = Encoder(3, True).opening(OPENING)
    monkeypatch.setattr(decoder, "FORMAT", 2)
    (other,) = read(data)
    assert isinstance(other, Unreadable)
    assert other.reason.endswith("format 1, this program reads 2")
