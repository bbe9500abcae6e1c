"""Opening says what a datagram is, or why it is not to be heard, and remembers nothing."""

from __future__ import annotations

import pickle

import pytest
from message_builders import OTHER_SECRET, SECOND, a_seal, a_status, an_entry, forged, kinds, sealed

from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02
from drslamd.gossip.envelopes.opening import Opened, entry_of, is_news_of_a_member, opened
from drslamd.gossip.seal import Seal, SealFault, team_key

T0 = 100 * SECOND


def own_seal() -> Seal:
    """Of robot 1, which knows start 5 of robot 3."""
    return Seal(team_key(bytes(range(32))), 1, 10, {3: 5})


@pytest.mark.parametrize("kind", list(kinds()))
def test_what_was_sealed_is_opened_in_and_out_of_its_frame(kind: str) -> None:
    seal, message = own_seal(), kinds()[kind]
    before = pickle.dumps(seal)
    channel, payload = sealed(a_seal(3, 5), message, T0)
    for event in (
        ChannelMessage(T0, channel, payload),
        Datagram(T0, lc02.encode(7, channel, payload)),
    ):
        found = opened(seal, event)
        assert isinstance(found, Opened)
        assert (found.header.origin, found.header.epoch, found.fault) == (3, 5, None)
        assert found.payload == payload
    assert pickle.dumps(seal) == before


@pytest.mark.parametrize(
    ("robot", "epoch", "fault"), [(3, 4, SealFault.OLD_EPOCH), (1, 11, SealFault.OWN_ID_USED)]
)
def test_what_another_start_says_is_read_all_the_same_if_it_is_proven(
    robot: int, epoch: int, fault: SealFault
) -> None:
    true = forged(a_status(), robot=robot, epoch=epoch)
    found = opened(own_seal(), ChannelMessage(T0, *true))
    assert isinstance(found, Opened)
    assert (found.fault, found.message) == (fault, a_status())
    false = forged(a_status(), robot=robot, epoch=epoch, secret=OTHER_SECRET)
    assert isinstance(opened(own_seal(), ChannelMessage(T0, *false)), SealFault)


def test_entries_of_another_start_come_from_relays_and_are_not_read() -> None:
    for robot, epoch in ((3, 4), (1, 11)):
        event = ChannelMessage(T0, *forged(an_entry(0, 1), robot=robot, epoch=epoch))
        assert isinstance(opened(own_seal(), event), SealFault)


def test_each_reason_has_its_words() -> None:
    channel, payload = forged(a_status())
    seal = own_seal()
    assert opened(seal, Datagram(T0, b"")) == lc02.FramingFault.TOO_SHORT.value
    assert opened(seal, ChannelMessage(T0, "CHAT", payload)) == "channel of another program"
    assert opened(seal, ChannelMessage(T0, "DRSLAM_NEAR_003", payload)) is None
    assert opened(seal, ChannelMessage(T0, channel, payload[:20])) is SealFault.TOO_SHORT


def test_what_is_proven_and_new_is_news_of_a_member() -> None:
    seal = own_seal()

    def framed(channel: str, payload: bytes) -> bytes:
        return lc02.encode(7, channel, payload)

    new = framed(*forged(a_status(), epoch=5))
    assert is_news_of_a_member(seal, new)
    found = opened(seal, Datagram(T0, new))
    assert isinstance(found, Opened)
    seal.accept(found.header)
    assert not is_news_of_a_member(seal, new)
    others = (
        framed(*forged(a_status(), epoch=5, counter=2, secret=OTHER_SECRET)),
        framed(*forged(an_entry(0, 1), epoch=5, counter=3)),
        framed(*forged(a_status(), robot=1, epoch=10, counter=4)),
        framed("CHAT", b"hello"),
        b"",
    )
    assert not any(is_news_of_a_member(seal, data) for data in others)


def test_an_entry_is_read_without_proof_and_nothing_else_is() -> None:
    channel, payload = sealed(a_seal(3, 5), an_entry(4, 40), T0)
    for event in (
        ChannelMessage(T0, channel, payload),
        Datagram(T0, lc02.encode(7, channel, payload)),
    ):
        found = entry_of(event)
        assert found is not None
        assert (found[0].seq, found[1]) == (4, payload)
    assert entry_of(Datagram(T0, b"no frame")) is None
    assert entry_of(ChannelMessage(T0, channel, payload[:-1])) is None
    assert entry_of(ChannelMessage(T0, *sealed(a_seal(3, 5), a_status(), T0))) is None
