"""Actions that come round: when each is due, and what a stall does to them."""

from __future__ import annotations

import pytest

from drslamd.conventions import SECOND_US
from drslamd.events import Effect
from drslamd.timers import Timers

T0 = 100 * SECOND_US


def often(utime: int) -> list[Effect]:
    return []


def seldom(utime: int) -> list[Effect]:
    return []


def started(**periods: int) -> Timers:
    """Two actions, both taken at T0; periods in us."""
    timers = Timers({often: periods.get("often", 100), seldom: periods.get("seldom", 250)})
    assert timers.take_due(T0) == [often, seldom]
    return timers


def test_a_robot_that_was_never_woken_wants_to_be_woken_at_once() -> None:
    assert Timers({often: 100}).next == 0


@pytest.mark.parametrize(("after", "taken"), [(99, []), (100, [often]), (101, [often])])
def test_an_action_is_due_again_after_its_period(after: int, taken: list[object]) -> None:
    assert started().take_due(T0 + after) == taken


def test_actions_of_one_moment_are_taken_in_their_order() -> None:
    assert started(often=50, seldom=50).take_due(T0 + 50) == [often, seldom]
    swapped = Timers({seldom: 50, often: 50})
    assert swapped.take_due(T0) == [seldom, often]


def test_the_next_one_is_the_earliest_of_all() -> None:
    timers = started()
    wanted = []
    for _ in range(6):
        wanted.append(timers.next - T0)
        timers.take_due(timers.next)
    assert wanted == [100, 200, 250, 300, 400, 500]


def test_an_action_that_comes_a_little_late_keeps_its_rhythm() -> None:
    timers = started()
    assert timers.take_due(T0 + 130) == [often]
    assert timers.take_due(T0 + 199) == []
    assert timers.take_due(T0 + 200) == [often]


@pytest.mark.parametrize(
    ("late", "next_due"), [(100, 200), (101, 301), (10 * SECOND_US, 10 * SECOND_US + 200)]
)
@pytest.mark.row("T3")
def test_after_more_than_a_period_an_action_starts_afresh_instead_of_catching_up(
    late: int, next_due: int
) -> None:
    """Due at 100, taken so much later."""
    timers = Timers({often: 100})
    timers.take_due(T0)
    assert timers.take_due(T0 + 100 + late) == [often]
    assert timers.next - T0 == next_due


def test_a_clock_that_stands_still_takes_nothing_twice() -> None:
    timers = started()
    assert timers.take_due(T0 + 100) == [often]
    assert timers.take_due(T0 + 100) == []


def test_an_action_that_is_hurried_goes_on_at_once_and_its_rounds_are_what_they_were() -> None:
    timers = started(often=100, seldom=250)
    timers.hurry(seldom, T0 + 30)
    assert timers.next == T0 + 30
    assert timers.take_due(T0 + 31) == [seldom]
    assert timers.next == T0 + 100
    assert timers.take_due(T0 + 250) == [often, seldom]


def test_an_action_that_is_due_and_hurried_is_taken_once_and_what_is_overdue_stays_so() -> None:
    timers = started(often=100, seldom=250)
    timers.hurry(often, T0 + 120)
    assert timers.next == T0 + 100
    assert timers.take_due(T0 + 130) == [often]
    assert timers.next == T0 + 200


def test_after_a_pause_the_others_of_that_moment_wait_until_the_robot_is_woken_again() -> None:
    timers = Timers({often: 100, seldom: 100}, {often})
    assert timers.take_due(T0) == [often]
    assert timers.next == T0
    assert timers.take_due(T0 + 3) == [seldom]
    assert timers.next == T0 + 100
    # their rhythm is their own, and the robot is never wanted before now
    assert timers.take_due(T0 + 105) == [often]
    assert timers.next == T0 + 105
    assert timers.take_due(T0 + 106) == [seldom]
    assert timers.next == T0 + 200


def test_a_pause_with_nothing_behind_it_is_none() -> None:
    timers = Timers({often: 50, seldom: 250}, {seldom})
    assert timers.take_due(T0) == [often, seldom]
    assert timers.next == T0 + 50


def test_what_is_hurried_goes_on_before_what_waits_for_the_end_of_a_pause() -> None:
    timers = Timers({often: 100, seldom: 100}, {often})
    timers.hurry(seldom, T0)
    assert timers.take_due(T0) == [often, seldom]
    assert timers.take_due(T0) == [seldom]


def test_a_pause_that_is_due_each_time_keeps_nobody_waiting_for_ever() -> None:
    """A robot that is woken as rarely as the first action comes round."""
    timers = Timers({often: 100, seldom: 100}, {often})
    taken = [timers.take_due(T0 + 100 * k) for k in range(10)]
    assert taken == [[often], [seldom]] * 5
