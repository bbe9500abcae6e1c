"""Who made a message and is it new: what is refused, in which order, and what is remembered."""

from __future__ import annotations

import pytest
from message_builders import OTHER_SECRET, SECRET, a_seal, a_status, forged, kinds, resealed, sealed

from drslamd.gossip import messages
from drslamd.gossip.seal import Header, Seal, SealFault, header_of, team_key

STATUS = frozenset([messages.FINGERPRINTS["STATUS"]])
HUGE, LAST_COUNTER = 2**63 - 1, 2**31 - 1


def opened(seal: Seal, message: tuple[str, bytes], once: bool = True) -> Header | SealFault:
    return seal.open(*message, STATUS, once)


def counters(*values: int, once: bool = True) -> list[bool]:
    """Which of the messages with these counters a fresh receiver accepts."""
    receiver = a_seal(1)
    return [
        isinstance(opened(receiver, forged(a_status(), counter=value), once), Header)
        for value in values
    ]


# the tag


def test_a_message_of_the_team_is_opened_with_its_header() -> None:
    message = sealed(a_seal(3, epoch=5), a_status(), utime=77)
    assert opened(a_seal(1), message) == Header(3, 3, 5, 1, 77)


def test_who_has_no_key_reads_what_a_message_says_of_itself_and_nothing_is_proven() -> None:
    _, payload = forged(a_status(), robot=3, epoch=5, counter=9, utime=77, secret=OTHER_SECRET)
    assert header_of(payload, STATUS) == Header(3, 3, 5, 9, 77)
    assert header_of(payload, frozenset()) is SealFault.UNKNOWN_TYPE
    assert header_of(payload[:38], STATUS) is SealFault.TOO_SHORT


def test_the_tag_is_the_keyed_blake2b_that_the_module_describes() -> None:
    channel, payload = sealed(a_seal(3), a_status())
    assert resealed(channel, payload) == payload


def test_without_a_team_key_the_tag_still_finds_damage() -> None:
    channel, payload = sealed(a_seal(3, secret=None), a_status())
    assert isinstance(opened(a_seal(1, secret=None), (channel, payload)), Header)
    damaged = payload[:-1] + bytes([payload[-1] ^ 1])
    assert opened(a_seal(1, secret=None), (channel, damaged)) is SealFault.WRONG_TAG


@pytest.mark.row("S2")
def test_another_team_key_and_no_team_key_do_not_fit() -> None:
    message = sealed(a_seal(3), a_status())
    assert opened(a_seal(1, secret=OTHER_SECRET), message) is SealFault.WRONG_TAG
    assert opened(a_seal(1, secret=None), message) is SealFault.WRONG_TAG


def test_the_key_of_another_origin_does_not_fit() -> None:
    channel, payload = sealed(a_seal(3), a_status())
    assert opened(a_seal(1), (channel, resealed(channel, payload, origin_of_key=4))) is (
        SealFault.WRONG_TAG
    )


@pytest.mark.parametrize("length", [0, 31, 33])
def test_a_team_key_of_another_length_than_32_bytes_is_refused(length: int) -> None:
    with pytest.raises(ValueError, match=f"32 bytes, not {length}"):
        team_key(bytes(length))


def test_a_team_key_of_32_bytes_is_used_as_it_is() -> None:
    assert team_key(SECRET) == SECRET
    assert len(team_key(None)) == 32


def test_no_single_bit_of_a_message_can_be_changed_on_the_way() -> None:
    receiver = a_seal(1)
    channel, payload = sealed(a_seal(3), kinds()["STATUS"])
    for bit in range(8 * len(payload)):
        altered = bytearray(payload)
        altered[bit // 8] ^= 1 << bit % 8
        for once in (True, False):
            assert isinstance(opened(receiver, (channel, bytes(altered)), once), SealFault), bit
    assert isinstance(opened(receiver, (channel, payload)), Header)


def test_the_tag_covers_the_channel() -> None:
    receiver = a_seal(1)
    channel, payload = sealed(a_seal(3), a_status())
    for other in (messages.channel("STATUS", 4), channel + "0", channel[:-1]):
        assert opened(receiver, (other, payload)) is SealFault.WRONG_TAG


# the order of judgement


def test_a_message_shorter_than_its_header_is_refused() -> None:
    channel, payload = sealed(a_seal(3), a_status())
    assert opened(a_seal(1), (channel, payload[:38])) is SealFault.TOO_SHORT
    assert opened(a_seal(1), (channel, payload[:39])) is SealFault.WRONG_TAG


def test_a_message_longer_than_a_datagram_is_refused() -> None:
    channel, payload = sealed(a_seal(3), a_status())
    full = resealed(channel, payload + bytes(1400 - len(payload)))
    assert isinstance(opened(a_seal(1), (channel, full)), Header)
    assert opened(a_seal(1), (channel, resealed(channel, full + b"\0"))) is SealFault.TOO_LONG


def test_a_type_that_does_not_belong_to_the_channel_is_refused() -> None:
    assert opened(a_seal(1), sealed(a_seal(3), kinds()["POSE"])) is SealFault.UNKNOWN_TYPE


@pytest.mark.row("N12")
@pytest.mark.parametrize("version", [1, 2, 4, 0, -2])
@pytest.mark.row("N12")
def test_another_version_is_refused(version: int) -> None:
    assert opened(a_seal(1), forged(a_status(), version=version)) is SealFault.WRONG_VERSION


@pytest.mark.parametrize("robot", [-1, 255, 32_767])
def test_an_origin_that_is_no_robot_id_is_refused(robot: int) -> None:
    assert opened(a_seal(1), forged(a_status(), robot=robot)) is SealFault.BAD_ORIGIN


@pytest.mark.parametrize("robot", [0, 254])
def test_the_first_and_the_last_robot_id_are_heard(robot: int) -> None:
    assert isinstance(opened(a_seal(1), forged(a_status(), robot=robot)), Header)


LAST_TIME = 100_000 * (2**31 - 2)
"""us; of the last sample of a 10 Hz grid whose numbers have 32 bits."""


@pytest.mark.row("T5")
@pytest.mark.parametrize(
    ("utime", "heard"), [(-1, False), (0, True), (LAST_TIME, True), (LAST_TIME + 1, False)]
)
def test_a_message_of_a_time_that_no_clock_shows_is_refused(utime: int, heard: bool) -> None:
    answer = opened(a_seal(1), forged(a_status(), utime=utime))
    assert isinstance(answer, Header) == heard
    assert heard or answer is SealFault.BAD_TIME


def test_to_judge_a_message_remembers_nothing_of_it() -> None:
    receiver, message = a_seal(1), forged(a_status(), epoch=7)
    for _ in range(3):
        assert isinstance(receiver.judge(*message, STATUS), Header)
    assert receiver.epochs == {}
    assert isinstance(opened(receiver, forged(a_status(), epoch=4)), Header)


def test_faults_are_named_in_the_order_of_their_cost() -> None:
    """Each message has all the faults from its own on; the first one must be named."""
    receiver = a_seal(1, epoch=10)
    receiver.header(0)
    opened(receiver, forged(a_status(), robot=3, epoch=5, counter=4))
    channel = messages.channel("STATUS", 3)

    def bad(
        version: int = 3,
        robot: int = 3,
        epoch: int = 5,
        counter: int = 4,
        kind: str = "STATUS",
        utime: int = 0,
    ) -> bytes:
        message = kinds()[kind]
        return messages.encode(Header(version, robot, epoch, counter, utime), message)

    order = [
        (bad(1, -5, 4, kind="POSE")[:20], SealFault.TOO_SHORT),
        (bad(1, -5, 4, kind="POSE") + bytes(1400), SealFault.TOO_LONG),
        (bad(1, -5, 4, kind="POSE"), SealFault.UNKNOWN_TYPE),
        (bad(1, -5, 4), SealFault.WRONG_VERSION),
        (bad(3, -5, 4), SealFault.BAD_ORIGIN),
        (bad(3, 1, 10, 1, utime=-1), SealFault.BAD_TIME),
        (bad(3, 1, 10, 1), SealFault.OWN),
        (bad(3, 3, 4), SealFault.OLD_EPOCH),
        (bad(3, 3, 5), SealFault.SEEN),
        (bad(3, 3, 5, 5), SealFault.WRONG_TAG),
    ]
    for payload, fault in order:
        assert opened(receiver, (channel, payload)) is fault


# replay


def test_a_message_is_accepted_once() -> None:
    receiver, message = a_seal(1), sealed(a_seal(3), a_status())
    assert isinstance(opened(receiver, message), Header)
    for _ in range(3):
        assert opened(receiver, message) is SealFault.SEEN


def test_a_message_with_its_own_numbering_may_come_again() -> None:
    assert counters(5, 5, 5, once=False) == [True, True, True]


def test_a_repeated_log_entry_does_not_use_up_a_counter() -> None:
    receiver, message = a_seal(1), forged(a_status(), counter=5)
    assert isinstance(opened(receiver, message, once=False), Header)
    assert isinstance(opened(receiver, message, once=True), Header)


def test_counters_in_any_order_are_accepted_once_each() -> None:
    assert (
        counters(9, 8, 7, 8, 10, 1, 9, 7, 10, 1) == [True] * 3 + [False, True, True] + [False] * 4
    )


@pytest.mark.row("S3")
def test_the_window_reaches_back_1024_counters_and_not_1025() -> None:
    assert counters(1000, 2000, 2000 - 1024, 2000 - 1025) == [True, True, True, False]
    moved = counters(1000, 2000, 2000 - 1023, 2001, 2001 - 1023, 2001 - 1024)
    assert moved == [True] * 5 + [False]


def test_a_leap_by_a_whole_window_forgets_everything_before_it() -> None:
    assert counters(5, 5 + 1023, 5) == [True, True, False]
    assert counters(5, 5 + 1024, 5, 6) == [True, True, False, True]


@pytest.mark.parametrize("counter", [0, -1, -(2**31)])
def test_counters_below_the_first_are_never_new(counter: int) -> None:
    assert counters(counter, 1, counter) == [False, True, False]


def test_the_largest_counter_is_the_last_one() -> None:
    last = [LAST_COUNTER - k for k in (2, 1, 0)]
    assert counters(*last, *last, LAST_COUNTER - 1024) == [True] * 3 + [False] * 3 + [True]
    assert counters(*last, LAST_COUNTER - 1025) == [True] * 3 + [False]


# nothing is remembered of what is not proven


@pytest.mark.row("S3")
def test_a_forged_huge_counter_does_not_move_the_window() -> None:
    receiver = a_seal(1)
    opened(receiver, forged(a_status(), counter=10))
    fake = forged(a_status(), counter=LAST_COUNTER, secret=OTHER_SECRET)
    assert opened(receiver, fake) is SealFault.WRONG_TAG
    assert isinstance(opened(receiver, forged(a_status(), counter=9)), Header)
    assert isinstance(opened(receiver, forged(a_status(), counter=11)), Header)


def test_a_forged_counter_is_still_new_when_the_true_message_comes() -> None:
    receiver = a_seal(1)
    fake = forged(a_status(), counter=10, secret=OTHER_SECRET)
    assert opened(receiver, fake) is SealFault.WRONG_TAG
    assert isinstance(opened(receiver, forged(a_status(), counter=10)), Header)


@pytest.mark.row("S1")
def test_a_forged_later_epoch_does_not_lock_the_robot_out() -> None:
    receiver = a_seal(1)
    fake = forged(a_status(), epoch=HUGE, secret=OTHER_SECRET)
    assert opened(receiver, fake) is SealFault.WRONG_TAG
    assert receiver.epochs == {}
    assert isinstance(opened(receiver, forged(a_status(), epoch=4)), Header)
    assert receiver.epochs == {3: 4}


# epochs


def test_a_new_epoch_begins_a_new_window_and_ends_the_old_one() -> None:
    receiver = a_seal(1)
    assert isinstance(opened(receiver, forged(a_status(), epoch=4, counter=900)), Header)
    assert isinstance(opened(receiver, forged(a_status(), epoch=5, counter=1)), Header)
    assert opened(receiver, forged(a_status(), epoch=4, counter=901)) is SealFault.OLD_EPOCH
    assert opened(receiver, forged(a_status(), epoch=4, counter=902), once=False) is (
        SealFault.OLD_EPOCH
    )
    assert opened(receiver, forged(a_status(), epoch=5, counter=1)) is SealFault.SEEN
    assert isinstance(opened(receiver, forged(a_status(), epoch=5, counter=2)), Header)


@pytest.mark.row("S5")
def test_epochs_are_remembered_over_a_restart() -> None:
    receiver = Seal(team_key(SECRET), 1, 1, {3: 5})
    assert opened(receiver, forged(a_status(), epoch=4)) is SealFault.OLD_EPOCH
    assert isinstance(opened(receiver, forged(a_status(), epoch=5)), Header)
    assert isinstance(opened(receiver, forged(a_status(), epoch=6)), Header)
    assert receiver.epochs == {3: 6}


def test_a_negative_epoch_is_from_before_every_start() -> None:
    assert opened(a_seal(1), forged(a_status(), epoch=-1)) is SealFault.OLD_EPOCH
    assert isinstance(opened(a_seal(1), forged(a_status(), epoch=0)), Header)


def test_the_windows_of_two_robots_are_apart() -> None:
    receiver = a_seal(1)
    assert isinstance(opened(receiver, forged(a_status(), robot=3, counter=7)), Header)
    assert isinstance(opened(receiver, forged(a_status(), robot=4, counter=7)), Header)


# our own id


@pytest.mark.row("N11")
def test_our_own_messages_come_back_as_own() -> None:
    seal = a_seal(3)
    message = sealed(seal, a_status())
    assert [opened(seal, message) for _ in range(2)] == [SealFault.OWN] * 2


@pytest.mark.parametrize("epoch", [4, 6])
def test_another_start_under_our_id_is_another_robot(epoch: int) -> None:
    message = sealed(a_seal(3, epoch), a_status())
    assert opened(a_seal(3, epoch=5), message) is SealFault.OWN_ID_USED


def test_a_copy_with_our_epoch_is_found_by_the_first_counter_that_we_did_not_use() -> None:
    seal, copy = a_seal(3), a_seal(3)
    sealed(seal, a_status())
    assert opened(seal, sealed(copy, a_status())) is SealFault.OWN
    assert opened(seal, sealed(copy, a_status())) is SealFault.OWN_ID_USED


def test_a_stranger_cannot_make_believe_that_our_id_is_used() -> None:
    fake = forged(a_status(), robot=3, epoch=6, secret=OTHER_SECRET)
    assert opened(a_seal(3, epoch=5), fake) is SealFault.WRONG_TAG


@pytest.mark.parametrize("epoch", [4, 6])
def test_our_log_of_another_start_may_come_from_a_peer_and_proves_no_other_robot(
    epoch: int,
) -> None:
    message = sealed(a_seal(3, epoch), a_status())
    assert opened(a_seal(3, epoch=5), message, once=False) is SealFault.OTHER_START


def test_counters_of_our_messages_begin_at_one_and_never_repeat() -> None:
    seal = a_seal(3, epoch=9)
    headers = [seal.header(utime) for utime in (10, 20, 30)]
    assert headers == [Header(3, 3, 9, k, 10 * k) for k in (1, 2, 3)]
