"""How slow a machine is said to be."""

from __future__ import annotations

from collections.abc import Callable

import machine_speed
import pytest
from machine_speed import MOST_TIMES, ROUNDS, YARDSTICKS, allowed_s


@pytest.mark.parametrize("slow", YARDSTICKS)
@pytest.mark.parametrize(
    ("times", "allowed"),
    [(0.5, 1.0), (1.0, 1.0), (1.5, 1.5), (MOST_TIMES, MOST_TIMES), (2 * MOST_TIMES, MOST_TIMES)],
)
def test_the_slowest_yardstick_says_what_is_allowed_within_bounds(
    monkeypatch: pytest.MonkeyPatch, slow: Callable[[], None], times: float, allowed: float
) -> None:
    def once_s(work: Callable[[], None]) -> float:
        return YARDSTICKS[work] * (times if work is slow else 0.9)

    monkeypatch.setattr(machine_speed, "_once_s", once_s)
    assert allowed_s(7.0) == pytest.approx(7.0 * allowed)


def test_a_pause_in_some_rounds_makes_no_machine_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds = iter(range(len(YARDSTICKS) * ROUNDS))

    def once_s(work: Callable[[], None]) -> float:
        return YARDSTICKS[work] * (50.0 if next(rounds) % 3 == 0 else 1.0)

    monkeypatch.setattr(machine_speed, "_once_s", once_s)
    assert allowed_s(7.0) == pytest.approx(7.0)


def test_this_machine_has_a_speed() -> None:
    assert 1.0 <= machine_speed.times_slower() <= MOST_TIMES
