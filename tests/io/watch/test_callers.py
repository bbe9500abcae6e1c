"""Whoever speaks and then does not is missed for a minute."""

from __future__ import annotations

import pytest

from drslamd.io.watch.callers import GONE_S, MOST, SILENT_S, Callers


def test_while_nobody_is_heard_somebody_is_missed() -> None:
    assert Callers().is_anybody_missed(0.0)


@pytest.mark.parametrize(
    ("silence_s", "missed"),
    [(SILENT_S - 0.01, False), (SILENT_S, True), (GONE_S - 0.01, True), (GONE_S, False)],
)
def test_one_who_falls_silent_is_missed_for_a_minute_though_others_speak(
    silence_s: float, missed: bool
) -> None:
    callers = Callers()
    callers.hear("10.0.0.7", 100.0)
    for address in ("10.0.0.8", "10.0.0.9"):
        callers.hear(address, 100.0 + silence_s)
    assert callers.is_anybody_missed(100.0 + silence_s) == missed


def test_so_many_addresses_are_remembered_and_no_more() -> None:
    callers = Callers()
    for number in range(2 * MOST):
        callers.hear(str(number), 0.0)
    assert len(callers) == MOST
    callers.hear("0", 9.0)
    assert callers.is_anybody_missed(9.0)
