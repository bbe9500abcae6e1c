"""Everything that was received is accepted, ignored, or refused for one reason."""

from __future__ import annotations

from enum import Enum

from drslamd.sensors.tally import Tally


class Why(Enum):
    LATE = "late"
    TORN = "torn"


def counted() -> Tally[Why]:
    tally: Tally[Why] = Tally(accepted=5, ignored=2)
    tally.refuse(Why.LATE)
    tally.refuse(Why.LATE, 2)
    return tally


def test_what_was_received_is_the_sum_of_what_became_of_it() -> None:
    assert Tally().received == 0
    assert counted().received == 5 + 2 + 3


def test_a_number_that_is_counted_elsewhere_replaces_the_one_before() -> None:
    tally = counted()
    tally.set_refused(Why.TORN, 4)
    tally.set_refused(Why.TORN, 6)
    assert tally.received == 5 + 2 + 3 + 6


def test_a_reason_that_never_came_up_has_no_key() -> None:
    tally = counted()
    tally.set_refused(Why.TORN, 0)
    assert Why.TORN not in tally.refused


def test_counters_have_flat_names() -> None:
    assert counted().counters("lines") == {
        "lines.accepted": 5,
        "lines.ignored": 2,
        "lines.refused.LATE": 3,
    }


def test_two_tallies_share_no_counter() -> None:
    counted()
    assert Tally().refused == {}
