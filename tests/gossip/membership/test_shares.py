"""Each has its share: what is beyond it is turned away, counted, named, and costs nobody else."""

from __future__ import annotations

import pytest

from drslamd.conventions import SECOND_US
from drslamd.gossip.membership.shares import OF_LATE_US, Shares

T0 = 100 * SECOND_US


def test_after_a_pause_so_much_comes_at_once_then_it_comes_steadily() -> None:
    shares: Shares[str] = Shares(per_s=10, at_once=25, most=4)
    assert sum(shares.takes("a", 1, T0) for _ in range(40)) == 25
    later = [sum(shares.takes("a", 1, T0 + s * SECOND_US) for _ in range(40)) for s in (1, 2, 9)]
    assert later == [10, 10, 25]
    assert shares.turned_away == 15 + 30 + 30 + 15


def test_one_is_not_served_at_the_cost_of_another() -> None:
    shares: Shares[str] = Shares(per_s=10, at_once=20, most=4)
    for _ in range(1_000):
        shares.takes("loud", 1, T0)
    assert all(shares.takes("quiet", 1, T0 + k * SECOND_US // 10) for k in range(100))


@pytest.mark.parametrize(("cost", "takes"), [(25, True), (25.5, False)])
def test_a_larger_one_takes_more(cost: float, takes: bool) -> None:
    assert Shares[str](10, 25, 4).takes("a", cost, T0) == takes


def test_a_clock_that_goes_back_gives_nothing() -> None:
    shares: Shares[str] = Shares(per_s=10, at_once=10, most=4)
    assert shares.takes("a", 10, T0)
    assert not shares.takes("a", 1, T0 - 5 * SECOND_US)
    assert not shares.takes("a", 1, T0)
    assert shares.takes("a", 1, T0 + SECOND_US // 10)


def test_who_was_turned_away_is_named_for_ten_seconds_with_how_often() -> None:
    shares: Shares[str] = Shares(per_s=1, at_once=1, most=4)
    assert shares.takes("a", 1, T0)
    assert shares.over(T0) == {}
    for k in range(1, 401):
        shares.takes("a", 2, T0 + k * SECOND_US // 100)
    end = T0 + 4 * SECOND_US
    assert shares.over(end) == {"a": pytest.approx(100, rel=0.02)}
    assert shares.over(end + OF_LATE_US - 1) == shares.over(end)
    assert shares.over(end + OF_LATE_US) == {}
    shares.takes("a", 1e9, end + 2 * OF_LATE_US)
    assert shares.over(end + 2 * OF_LATE_US) == {"a": 1.0}


def test_of_addresses_without_end_those_that_are_told_apart_keep_their_share() -> None:
    shares: Shares[int] = Shares(per_s=10, at_once=20, most=8)
    assert all(shares.takes(robot, 1, T0) for robot in range(8))
    came = sum(shares.takes(number, 1, T0) for number in range(100, 1_100))
    assert came == 20
    assert len(shares) == 8
    assert all(shares.takes(robot, 1, T0) for robot in range(8))
    assert shares.over(T0).keys() == {None}


def test_who_took_nothing_for_long_makes_room() -> None:
    shares: Shares[str] = Shares(per_s=10, at_once=20, most=1)
    shares.takes("a", 1, T0)
    for _ in range(100):
        shares.takes("b", 1, T0 + OF_LATE_US - 1)
    assert None in shares.over(T0 + OF_LATE_US - 1)
    for _ in range(100):
        shares.takes("b", 1, T0 + OF_LATE_US)
    assert "b" in shares.over(T0 + OF_LATE_US)
