"""Orders of counters that windows of this kind got wrong elsewhere: WireGuard's 34 cases, 6 sweeps.

Their numbers carry over to a window of ours, with three things that are ours: the first counter is
`FIRST_COUNTER` and not 0; a header holds 32 bits, and what is beyond comes as a negative number; a
single message that leaps ahead moves nothing, so whoever is to be far ahead says some more there.
"""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from message_builders import OTHER_SECRET, a_seal, a_status, forged, sealed

from drslamd.gossip import messages
from drslamd.gossip.replay_window import FIRST_COUNTER, FOLLOWS, WINDOW, ReplayWindow
from drslamd.gossip.seal import LAST_COUNTER, Header, SealFault

STATUS = frozenset([messages.FINGERPRINTS["STATUS"]])

SPAN = WINDOW + 1
FAR = 4 * SPAN
LAST = LAST_COUNTER - FIRST_COUNTER
"""The last number there is, counted from 0 as all below."""

CASES = [
    (0, True), (1, True), (1, False),
    (9, True), (8, True), (7, True), (7, False),
    (SPAN, True), (SPAN - 1, True), (SPAN - 1, False), (SPAN - 2, True), (2, True), (2, False),
    (SPAN + 16, True), (3, False), (SPAN + 16, False),
    (FAR, True), (FAR - SPAN + 1, True), (10, False), (FAR - SPAN, False), (FAR - SPAN - 1, False),
    (FAR - SPAN + 2, True), (FAR + 1 - SPAN, False), (0, False),
    (LAST + 1, False), (LAST, True), (LAST + 1, False), (LAST, False), (LAST - 1, True),
    (LAST + 2, False), (LAST + 3, False), (LAST - 1, False), (LAST - 2, True),
    (0, False),
]  # fmt: skip
"""A number, and is it new, from 0 on as they were written."""
ARRIVALS = {FAR: (FAR - 600, FAR - 500), LAST: (LAST - 600, LAST - 500)}
"""What comes shortly before a number that leaps, so that the window follows."""

UP = range(1, SPAN)
DOWN = range(WINDOW, 0, -1)
SWEEPS = [
    ([*UP, 0], [0]),
    ([*range(2, SPAN + 1), 1], [0]),
    (range(WINDOW, -1, -1), []),
    (range(SPAN, 0, -1), [0]),
    ([*DOWN, SPAN], [0]),
    ([*DOWN, 0, SPAN], []),
]
"""Numbers that are all new, one after the other, and such that then are not."""


def as_on_the_wire(number: int) -> int:
    """A counter as a header of 32 bits with a sign gives it."""
    return (number + FIRST_COUNTER + 2**31) % 2**32 - 2**31


def is_taken(window: ReplayWindow, number: int) -> bool:
    counter = as_on_the_wire(number)
    is_new = window.is_new(counter)
    if is_new:
        window.commit(counter)
    return is_new


@pytest.mark.row("S3")
def test_the_34_cases() -> None:
    window = ReplayWindow()
    assert len(CASES) == 34
    for case, (number, is_new) in enumerate(CASES, 1):
        if is_new:
            assert all(is_taken(window, before) for before in ARRIVALS.get(number, ()))
        assert is_taken(window, number) is is_new, f"case {case}"


@pytest.mark.row("S3")
@pytest.mark.parametrize(("new", "old"), SWEEPS)
def test_the_six_sweeps(new: Iterable[int], old: Iterable[int]) -> None:
    window = ReplayWindow()
    assert all(is_taken(window, number) for number in new)
    assert not any(is_taken(window, number) for number in old)


@pytest.mark.row("S3")
@pytest.mark.parametrize("times", [1, 1_000])
def test_a_message_that_comes_again_and_again_is_heard_once(times: int) -> None:
    listener, robot = a_seal(1), a_seal(3)
    said = [sealed(robot, a_status()) for _ in range(3)]
    assert all(isinstance(listener.open(*message, STATUS), Header) for message in said)
    again = {listener.open(*message, STATUS) for _ in range(times) for message in said}
    assert again == {SealFault.SEEN}


@pytest.mark.row("S3")
@pytest.mark.parametrize("counter", [-(2**31) + 9, 9, 5_000, LAST_COUNTER])
def test_forged_counters_move_nothing(counter: int) -> None:
    listener, robot = a_seal(1), a_seal(3)
    assert isinstance(listener.open(*sealed(robot, a_status()), STATUS), Header)
    for k in range(2 * FOLLOWS):
        false = forged(a_status(), counter=counter - k, secret=OTHER_SECRET)
        assert isinstance(listener.open(*false, STATUS), SealFault)
    assert isinstance(listener.open(*sealed(robot, a_status()), STATUS), Header)
