"""The clock of a peer against ours: how wrong it may be is said, and is true."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from message_builders import MS, SECOND

from drslamd.gossip.peer_clock import Offset, PeerClock

DAY = 86_400 * SECOND
PERIOD = 2**32 * MS
"""LinkTrack's system_time is a u32 of milliseconds."""
T0 = 1000 * SECOND

Delay = Callable[[random.Random], int]


def constant(delay: int) -> Delay:
    return lambda draw: delay


SHORT = constant(2 * MS)


def jittering(least: int, mean: int) -> Delay:
    return lambda draw: least + round(draw.expovariate(1 / mean))


class Conversation:
    """Two robots that send five messages a second; `ours` listens to the peer, `theirs` to us.

    The peer's clock shows `offset` more than ours at T0 and runs faster by `ppm`.
    """

    def __init__(
        self, offset: int, ppm: float = 0.0, out: Delay = SHORT, back: Delay = SHORT
    ) -> None:
        self.ours, self.theirs = PeerClock(), PeerClock()
        self.now = T0
        self._offset, self._ppm, self._out, self._back = offset, ppm, out, back
        self._random = random.Random(4)

    def offset(self) -> int:
        """The truth."""
        return self._offset + round((self.now - T0) * self._ppm * 1e-6)

    def talk(self, seconds: int) -> None:
        for k in range(5 * seconds):
            self.now += 200 * MS
            there = self.now + self.offset()
            self.theirs.on_message(self.now, there + self._out(self._random))
            self.ours.on_message(there, self.now + self._back(self._random))
            if k % 5 == 0:
                self.theirs.echoed((self.ours.delay_us or 0, there))
                self.ours.echoed((self.theirs.delay_us or 0, self.now))

    def found(self) -> Offset:
        found = self.ours.offset(self.now)
        assert found is not None
        return found

    def error(self) -> int:
        return abs(self.found().us - self.offset())


def is_within_the_claim(talk: Conversation) -> bool:
    return talk.error() <= talk.found().uncertainty_us


# from messages


def test_before_the_first_message_nothing_is_known() -> None:
    clock = PeerClock()
    assert clock.offset(T0) is None
    assert clock.delay_us is None


def test_equal_delays_both_ways_cancel() -> None:
    """The peer last said how it hears us 0.8 s ago."""
    talk = Conversation(offset=123_456_789, out=constant(7 * MS), back=constant(7 * MS))
    talk.talk(5)
    assert talk.found() == Offset(123_456_789, 7 * MS + 3_200 + 80, "messages")


@pytest.mark.parametrize("offset", [0, 5 * SECOND, -5 * SECOND, 100 * DAY, -100 * DAY])
@pytest.mark.row("T4")
def test_any_offset_is_found_to_ten_milliseconds_through_jitter(offset: int) -> None:
    talk = Conversation(offset, out=jittering(1 * MS, 20 * MS), back=jittering(1 * MS, 20 * MS))
    talk.talk(20)
    assert talk.error() <= 10 * MS
    assert is_within_the_claim(talk)


@pytest.mark.parametrize(("out", "back"), [(0, 60), (60, 0), (5, 200), (200, 5)])
@pytest.mark.parametrize("ppm", [-200, -100, 0, 100, 200])
@pytest.mark.row("T4")
def test_unequal_delays_and_drift_stay_within_the_claim(out: int, back: int, ppm: int) -> None:
    talk = Conversation(10 * SECOND, ppm, constant(out * MS), constant(back * MS))
    for _ in range(40):
        talk.talk(1)
        assert is_within_the_claim(talk)
    assert talk.error() >= abs(out - back) // 2 * MS - 3_200


@pytest.mark.parametrize("ppm", [-100, 100])
def test_a_drift_of_100_ppm_is_followed_to_ten_milliseconds_for_an_hour(ppm: int) -> None:
    talk = Conversation(-SECOND, ppm, jittering(1 * MS, 5 * MS), jittering(1 * MS, 5 * MS))
    for _ in range(60):
        talk.talk(60)
        assert talk.error() <= 10 * MS
        assert is_within_the_claim(talk)


def test_the_smallest_delay_counts_and_not_the_last() -> None:
    clock = PeerClock()
    for delay in (30 * MS, 4 * MS, 50 * MS):
        clock.on_message(T0, T0 + delay)
    assert clock.delay_us == 4 * MS


def test_a_small_delay_is_forgotten_after_sixteen_seconds() -> None:
    for later, smallest in ((15, 4 * MS), (16, 30 * MS)):
        clock = PeerClock()
        clock.on_message(T0, T0 + 4 * MS)
        clock.on_message(T0 + later * SECOND, T0 + later * SECOND + 30 * MS)
        assert clock.delay_us == smallest


def test_what_was_heard_before_a_long_silence_is_forgotten_with_the_first_message() -> None:
    """In five minutes at 200 ppm the clocks moved 60 ms."""
    talk = Conversation(0, ppm=200)
    talk.talk(20)
    talk.now += 300 * SECOND
    talk.talk(1)
    assert talk.error() <= 10 * MS
    assert is_within_the_claim(talk)


def test_a_peer_that_does_not_say_how_it_hears_us_is_known_to_a_tenth_of_a_second() -> None:
    clock = PeerClock()
    clock.on_message(T0 + 5 * SECOND, T0 + 40 * MS)
    assert clock.offset(T0) == Offset(5 * SECOND - 40 * MS, 100 * MS, "one way")


@pytest.mark.parametrize("ppm", [-200, 200])
@pytest.mark.parametrize("silence_s", [3, 12, 40])
def test_what_the_peer_said_some_time_ago_stays_within_the_claim(silence_s: int, ppm: int) -> None:
    talk = Conversation(10 * SECOND, ppm)
    talk.talk(20)
    for _ in range(5 * silence_s):
        talk.now += 200 * MS
        talk.ours.on_message(talk.now + talk.offset(), talk.now + 2 * MS)
    assert is_within_the_claim(talk)


def test_a_peer_that_no_longer_hears_us_is_known_one_way_again() -> None:
    talk = Conversation(offset=SECOND)
    talk.talk(5)
    assert talk.found().source == "messages"
    talk.ours.echoed(None)
    assert talk.found().source == "one way"


# from LinkTrack's system_time

OWN_MINUS_SYSTEM = 77_000_123


def with_radio(talk: Conversation, error: int = 0, periods: int = 0) -> Conversation:
    """Both robots know their clock against system_time, the peer's after some of its periods."""
    theirs = OWN_MINUS_SYSTEM + talk.offset() + error + periods * PERIOD
    talk.ours.radio(OWN_MINUS_SYSTEM, theirs, talk.now)
    return talk


def a_conversation(offset: int = 9 * SECOND) -> Conversation:
    """Messages alone are 15 ms wrong, and between 10 ms and 40 ms one way or the other."""
    talk = Conversation(offset, out=constant(40 * MS), back=constant(10 * MS))
    talk.talk(5)
    return talk


def test_the_radio_is_better_than_the_messages() -> None:
    talk = a_conversation()
    assert talk.error() == 15 * MS
    assert with_radio(talk, error=1 * MS).error() == 1 * MS
    assert talk.found().source == "LinkTrack system_time"
    assert talk.found().uncertainty_us == 3 * MS


@pytest.mark.parametrize("periods", [-2, -1, 0, 1, 2])
@pytest.mark.parametrize("offset", [0, 9 * SECOND, 30 * DAY, -60 * DAY, 200 * DAY])
def test_the_period_of_system_time_makes_no_difference(offset: int, periods: int) -> None:
    """Robots may have been switched on months apart, and system_time wraps after 49.7 days."""
    assert with_radio(a_conversation(offset), periods=periods).found() == Offset(
        offset, 3 * MS, "LinkTrack system_time"
    )


def test_system_time_that_wraps_between_the_readings_of_two_robots_makes_no_difference() -> None:
    """Ours wrapped already: our clock minus system_time has grown by a period."""
    talk = a_conversation()
    talk.ours.radio(OWN_MINUS_SYSTEM + PERIOD, OWN_MINUS_SYSTEM + 9 * SECOND, talk.now)
    assert talk.found() == Offset(9 * SECOND, 3 * MS, "LinkTrack system_time")


@pytest.mark.parametrize(
    ("age", "source"),
    [
        (5 * SECOND - 1, "LinkTrack system_time"),
        (5 * SECOND, "messages"),
    ],
)
def test_the_radio_counts_for_five_seconds(age: int, source: str) -> None:
    talk = with_radio(a_conversation())
    found = talk.ours.offset(talk.now + age)
    assert found is not None
    assert found.source == source


@pytest.mark.parametrize(
    ("error", "source"),
    [
        (-10 * MS - 6_200, "LinkTrack system_time"),
        (-10 * MS - 6_201, "messages"),
        (40 * MS + 6_200, "LinkTrack system_time"),
        (40 * MS + 6_201, "messages"),
        (DAY, "messages"),
        (PERIOD // 2, "messages"),
    ],
)
def test_the_radio_is_not_believed_where_the_messages_rule_it_out(error: int, source: str) -> None:
    """Modules of two radio networks have nothing to do with each other."""
    assert with_radio(a_conversation(), error).found().source == source


def test_the_radio_alone_is_not_believed() -> None:
    clock = PeerClock()
    clock.radio(OWN_MINUS_SYSTEM, OWN_MINUS_SYSTEM, T0)
    assert clock.offset(T0) is None
    clock.on_message(T0, T0 + 40 * MS)
    found = clock.offset(T0)
    assert found is not None
    assert found.source == "one way"


def test_what_a_peer_says_of_our_messages_makes_its_clock_as_uncertain_as_it_is_wrong() -> None:
    talk = Conversation(50 * SECOND)
    talk.talk(5)
    talk.ours.echoed((3600 * SECOND, talk.now))
    assert is_within_the_claim(talk)
    assert talk.found().uncertainty_us > 1000 * SECOND


@pytest.mark.parametrize(("beyond", "source"), [(0, "messages"), (1, "one way")])
def test_what_a_peer_says_is_not_used_where_both_ways_would_take_less_than_no_time(
    beyond: int, source: str
) -> None:
    """Drift and age explain a few milliseconds less than nothing."""
    talk = Conversation(50 * SECOND)
    talk.talk(5)
    incoming = talk.ours.delay_us
    assert incoming is not None
    talk.ours.echoed((-incoming - 50 * MS - beyond, talk.now))
    assert talk.found().source == source
    assert is_within_the_claim(talk)


# clocks that jump


def jumped(talk: Conversation, by: int) -> None:
    """One of both clocks now shows so much more against the other."""
    talk._offset += by


@pytest.mark.row("T4")
@pytest.mark.parametrize("jump", [-60, -10, -1, 1, 10, 60])
@pytest.mark.parametrize("ppm", [-200, 200])
def test_a_clock_that_jumps_is_followed_and_never_claimed_better_than_it_is_known(
    jump: int, ppm: int
) -> None:
    """As the clock of a computer does that slept: it stood, and others went on."""
    talk = Conversation(1000 * SECOND, ppm)
    talk.talk(20)
    jumped(talk, jump * SECOND)
    for _ in range(25):
        talk.talk(1)
        assert is_within_the_claim(talk)
    assert talk.error() <= 10 * MS
    assert talk.found().uncertainty_us <= 20 * MS
    assert T0 + 20 * SECOND < talk.ours.since <= T0 + 22 * SECOND


def test_a_clock_that_never_jumped_holds_since_ever() -> None:
    talk = Conversation(0, 200, jittering(1 * MS, 300 * MS), jittering(1 * MS, 300 * MS))
    for _ in range(60):
        talk.talk(10)
        assert is_within_the_claim(talk)
    assert talk.ours.since == 0


@pytest.mark.parametrize(
    ("late", "messages", "claimed"),
    [
        (250 * MS, 1, 0),
        (250 * MS, 2, 250 * MS),
        (249 * MS, 2, 0),
        (1000 * MS, 1, 1000 * MS),
        (999 * MS, 1, 0),
    ],
)
def test_messages_that_are_late_in_a_row_may_mean_another_clock(
    late: int, messages: int, claimed: int
) -> None:
    talk = Conversation(SECOND)
    talk.talk(5)
    before = talk.found().uncertainty_us
    for _ in range(messages):
        talk.ours.on_message(talk.now + talk.offset(), talk.now + 2 * MS + late)
    assert talk.found().uncertainty_us == before + claimed
    talk.ours.on_message(talk.now + talk.offset(), talk.now + 2 * MS)
    assert talk.found().uncertainty_us == before


def test_after_our_own_sleep_nothing_is_known_until_the_next_message() -> None:
    talk = with_radio(Conversation(SECOND))
    talk.talk(5)
    talk.ours.begin_again(talk.now)
    assert talk.ours.offset(talk.now) is None
    assert talk.ours.since == talk.now
    jumped(talk, 3 * SECOND)
    talk.talk(2)
    assert talk.error() <= 10 * MS
