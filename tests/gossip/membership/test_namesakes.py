"""One id used by two robots is noticed by all; nothing else looks like it."""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable

import pytest
from message_builders import SECOND, a_seal, a_status, an_entry, sealed

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage
from drslamd.gossip.membership.namesakes import (
    GONE_US,
    SURE_US,
    TOLD_US,
    VOICES,
    Namesakes,
    unanswered,
)
from drslamd.gossip.message_types import UNANSWERED, Heard
from drslamd.gossip.seal import Header
from drslamd.gossip.team import Team

T0 = 100 * SECOND
STEP = SECOND // 10
OWN = Chain(1, 10)
Late = Callable[[], int]


class Cell:
    """Robots that say a status each second, each at its own moment; ids may be used twice.

    Attributes:
        late: how late the next message comes, us.
        deaf: pairs of robots, by their places, that do not hear each other.
        told: everything that was said, by the place of its robot.
    """

    def __init__(self, late: Late = lambda: 2_000) -> None:
        self.utime = T0
        self.teams: dict[int, Team] = {}
        self.late = late
        self.deaf: set[frozenset[int]] = set()
        self.told: dict[int, list[ChannelMessage]] = {}
        self._mail: list[tuple[int, int, int, ChannelMessage]] = []
        self._order = itertools.count()

    def begin(self, robot: int, epoch: int = 1) -> int:
        """A robot begins; its place."""
        place = len(self.told)
        self.told[place] = []
        self.teams[place] = Team(a_seal(robot, epoch))
        return place

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * SECOND / STEP)):
            self.utime += STEP
            for place, team in self.teams.items():
                if self.utime // STEP % 10 == 3 * place % 10:
                    self.say(place, team)
            while self._mail and self._mail[0][0] <= self.utime:
                at, _, to, event = heapq.heappop(self._mail)
                if to in self.teams:
                    message = ChannelMessage(at, event.channel, event.payload, event.sender)
                    self.teams[to].receive(message)

    def say(self, place: int, team: Team) -> None:
        status = a_status(team.next_heard(self.utime), team.logs.next_states())
        send = team.send(status, self.utime)
        event = ChannelMessage(self.utime, send.channel, send.payload, f"10.0.0.{place}")
        self.told[place].append(event)
        for to in self.teams:
            if to != place and frozenset((place, to)) not in self.deaf:
                at = self.utime + self.late()
                heapq.heappush(self._mail, (at, next(self._order), to, event))

    def twice(self, place: int) -> set[int]:
        return self.teams[place].namesakes.twice(self.utime)

    def sentence(self, place: int, key: str) -> str | None:
        return dict(self.teams[place].conditions(self.utime))[key]


@pytest.mark.row("S8")
@pytest.mark.parametrize("apart_s", [0.0, 0.4, 3.0, 60.0])
@pytest.mark.parametrize("second_epoch", [5, 20])
def test_within_five_seconds_both_say_it_and_the_others_use_neither(
    apart_s: float, second_epoch: int
) -> None:
    cell = Cell()
    others = [cell.begin(1), cell.begin(2)]
    cell.run(5)
    twins = [cell.begin(3, 10)]
    cell.run(apart_s)
    twins.append(cell.begin(3, second_epoch))
    cell.run(5)
    assert all(cell.twice(place) == {3} for place in cell.teams)
    for place, other in zip(twins, reversed(twins), strict=True):
        said = cell.sentence(place, "team.own_id_used")
        assert said is not None
        assert said.startswith(f"another robot uses id 3, at 10.0.0.{other}: ")
        assert not cell.teams[place].living(cell.utime)
    for place in others:
        said = cell.sentence(place, "team.id_used_twice")
        assert said is not None
        assert said.startswith("two robots use id 3, at 10.0.0.2 and 10.0.0.3: neither")
        assert set(cell.teams[place].living(cell.utime)) == {1, 2} - {place + 1}
        assert 3 not in cell.teams[place].present(cell.utime)


@pytest.mark.row("S8")
def test_thirty_seconds_after_one_has_gone_the_id_is_used_again() -> None:
    cell = Cell()
    other, first = cell.begin(1), cell.begin(3, 10)
    cell.run(5)
    second = cell.begin(3, 20)
    cell.run(6)
    del cell.teams[second]
    cell.run(28)
    assert cell.twice(other) == cell.twice(first) == {3}
    cell.run(5)
    assert cell.twice(other) == cell.twice(first) == set()
    assert set(cell.teams[other].living(cell.utime)) == {3}
    assert cell.teams[other].peers[3].chain == Chain(3, 10)


def test_what_both_say_is_refused_and_counted_also_what_others_repeat_of_it() -> None:
    cell = Cell()
    other = cell.begin(1)
    cell.begin(3, 10)
    cell.run(3)
    cell.begin(3, 20)
    cell.run(5)
    team = cell.teams[other]
    for epoch in (10, 20):
        message = sealed(a_seal(3, epoch), an_entry(0, 1), cell.utime)
        assert team.receive(ChannelMessage(cell.utime, *message)) is None
    before = team.refused["of an id that two robots use"]
    cell.run(10)
    assert team.refused["of an id that two robots use"] == before + 20
    assert team.refused["of another start than the one that speaks"] <= 3


def test_two_that_do_not_hear_each_other_are_told_by_a_third() -> None:
    cell = Cell()
    cell.begin(1)
    twins = [cell.begin(3, 10), cell.begin(3, 20)]
    cell.deaf = {frozenset(twins)}
    cell.run(8)
    for place in twins:
        said = cell.sentence(place, "team.own_id_used")
        assert said is not None
        assert said.startswith("another robot uses id 3, as robot 1 hears: ")


@pytest.mark.row("S6")
@pytest.mark.parametrize("seed", range(4))
def test_a_robot_that_begins_again_twice_in_a_row_is_no_other_robot(seed: int) -> None:
    """Though what it said before comes up to five seconds late."""
    rng = random.Random(seed)
    cell = Cell(late=lambda: rng.randrange(5 * SECOND))
    others = [cell.begin(1), cell.begin(2)]
    cell.run(12)
    now = cell.begin(3, 10)
    for epoch in (11, 12):
        cell.run(rng.choice((4, 8, 15)))
        del cell.teams[now]
        cell.run(rng.choice((0, 1, 2)))
        now = cell.begin(3, epoch)
        for _ in range(60):
            cell.run(0.5)
            assert not any(cell.twice(place) for place in (*others, now))


def test_a_recording_of_an_earlier_start_is_no_other_robot() -> None:
    cell = Cell()
    other, first = cell.begin(1), cell.begin(3, 10)
    cell.run(20)
    del cell.teams[first]
    cell.run(4)
    second = cell.begin(3, 20)
    cell.run(5)
    for event in cell.told[first]:
        for place in (other, second):
            played = ChannelMessage(cell.utime, event.channel, event.payload, "10.0.0.66")
            cell.teams[place].receive(played)
        cell.run(1)
        assert cell.twice(other) == cell.twice(second) == set()
    said = cell.sentence(second, "team.own_id_used")
    assert said is not None
    assert said.startswith("hears messages under its own id 3 that it did not make, from 10.0.0.66")
    assert "recording" in said
    assert set(cell.teams[other].living(cell.utime)) == {3}
    assert cell.teams[second].living(cell.utime).keys() == {1}


# to the microsecond


def spoken(epoch: int, utime: int, robot: int = 3) -> Header:
    return Header(3, robot, epoch, 1, utime)


def namesakes(*words: tuple[int, int]) -> Namesakes:
    """Starts of robot 3 that answer, each at a time after T0."""
    out = Namesakes(OWN)
    for epoch, after in words:
        out.hear(spoken(epoch, T0 + after), True, T0 + after, "")
    return out


@pytest.mark.parametrize(("spoke_us", "sure"), [(SURE_US, True), (SURE_US - 1, False)])
def test_both_must_speak_for_a_while(spoke_us: int, sure: bool) -> None:
    for later in (10, 20):
        earlier = 30 - later
        found = namesakes((earlier, 0), (later, SECOND), (earlier, 9 * SECOND))
        found.hear(spoken(later, T0 + SECOND + spoke_us), False, T0 + SECOND + spoke_us, "")
        assert (found.twice(T0 + 9 * SECOND) == {3}) == sure
    one_lie = namesakes((10, 0), (20, SECOND), (10, 9 * SECOND))
    assert one_lie.twice(T0 + 9 * SECOND) == set()


def test_what_was_made_before_the_later_start_counts_for_nothing_however_late_it_comes() -> None:
    for made, sure in ((SECOND + SURE_US, True), (SECOND + SURE_US - 1, False)):
        found = namesakes((10, 0), (20, SECOND), (20, 4 * SECOND))
        found.hear(spoken(10, T0 + made), False, T0 + 5 * SECOND, "")
        # a clock may have lost a millisecond a second since it was heard last
        assert (found.twice(T0 + 5 * SECOND) == {3}) == (sure or made + 5_000 > SECOND + SURE_US)
        assert namesakes((10, 0), (20, SECOND)).twice(T0 + 5 * SECOND) == set()
    late = namesakes((10, 0), (20, SECOND), (20, 4 * SECOND))
    late.hear(spoken(10, T0 + SECOND + SURE_US - 5_001), False, T0 + 5 * SECOND, "")
    assert late.twice(T0 + 5 * SECOND) == set()


@pytest.mark.parametrize(("newer_us", "is_news"), [(0, False), (1, True)])
def test_a_copy_of_the_latest_word_says_nothing_however_often_it_comes(
    newer_us: int, is_news: bool
) -> None:
    """A clock may have lost time since, so it would look like a new one."""
    found = namesakes((10, 0), (20, SECOND))
    before = found.latest
    for after in range(2, 20):
        found.hear(spoken(10, T0 + newer_us), False, T0 + after * SECOND, "a stranger")
    assert (found.latest != before) == is_news


def test_it_is_over_thirty_seconds_after_the_last_word() -> None:
    found = namesakes((10, 0), (20, 0), (10, SECOND), (20, 2 * SECOND))
    assert found.twice(T0 + SECOND + GONE_US - 1) == {3}
    assert found.twice(T0 + SECOND + GONE_US) == set()
    assert found.fault(3, T0 + SECOND + GONE_US - 1) is not None
    assert found.fault(3, T0 + SECOND + GONE_US) is None


def test_who_has_not_answered_this_start_is_nobody() -> None:
    found = namesakes((10, 0), (10, 5 * SECOND))
    for after in range(1, 5):
        found.hear(spoken(20, T0 + after * SECOND), False, T0 + after * SECOND, "")
    assert found.twice(T0 + 5 * SECOND) == set()
    assert found.named(T0 + 5 * SECOND) == set()


def test_of_many_starts_four_are_told_apart_and_the_others_are_not_heard_again() -> None:
    found = namesakes(*((epoch, epoch * SECOND) for epoch in range(1, 30)))
    assert len(found.latest[3]) == VOICES
    for after in (40, 41, 42):
        for epoch in (1, 29):
            utime = T0 + after * SECOND
            found.hear(spoken(epoch, utime), True, utime, "")
    assert found.twice(T0 + 42 * SECOND) == set()


def test_who_speaks_under_our_id_is_named_while_it_is_heard_and_at_most_four_of_them() -> None:
    found = Namesakes(OWN)
    for epoch in range(20, 30):
        found.hear(spoken(epoch, T0, robot=1), False, T0, "")
    named = {Chain(1, epoch) for epoch in range(26, 30)}
    assert found.named(T0 + 5 * SECOND - 1) == named
    assert found.named(T0 + 5 * SECOND) == set()
    assert found.twice(T0) == set()
    assert found.is_own_id_heard(T0 + 10 * SECOND - 1)
    assert not found.is_own_id_heard(T0 + 10 * SECOND)


def test_a_peer_that_hears_two_of_our_id_must_say_so_twice() -> None:
    found, both = Namesakes(OWN), a_status(tuple(map(unanswered, (OWN, Chain(1, 20)))))
    for after in (0, SURE_US):  # who is sure of one of them tells nothing of the kind
        found.on_status(4, a_status((Heard(*OWN, 7), Heard(1, 20, UNANSWERED))), T0 + after)
    assert not found.is_own_id_used(T0 + SURE_US)
    found.on_status(5, both, T0)
    assert not found.is_own_id_used(T0)
    found.on_status(5, a_status((Heard(1, 20, 7),)), T0 + SURE_US)  # only that it begins again
    assert not found.is_own_id_used(T0 + SURE_US)
    found.on_status(5, both, T0 + SURE_US - 1)
    assert not found.is_own_id_used(T0 + SURE_US)
    found.on_status(5, both, T0 + SURE_US)
    assert found.is_own_id_used(T0 + SURE_US + TOLD_US - 1)
    assert not found.is_own_id_used(T0 + SURE_US + TOLD_US)
