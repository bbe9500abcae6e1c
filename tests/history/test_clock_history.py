"""What is remembered of a peer's clock: enough for a day, and never more than so much."""

from __future__ import annotations

import itertools

from drslamd.history import clock_history
from drslamd.history.clock_history import ClockHistory, ClockReading

SECOND = 1_000_000


def test_of_ten_seconds_the_surest_reading_is_kept() -> None:
    history = ClockHistory()
    for second, unsure in ((0, 50), (3, 20), (6, 30), (9, 20), (10, 90)):
        history.add(ClockReading(second * SECOND, 1_000 + second, unsure))
    assert history.readings == [(9 * SECOND, 1_009, 20), (10 * SECOND, 1_010, 90)]


def test_a_day_is_covered_from_its_first_to_its_last_minute_by_bounded_readings() -> None:
    history = ClockHistory()
    day = 86_400
    for second in range(0, day, 5):
        history.add(ClockReading(second * SECOND, second, 1))
        assert len(history.readings) <= clock_history.MOST
    times = [reading.utime // SECOND for reading in history.readings]
    assert times == sorted(set(times))
    assert times[0] < 60
    assert times[-1] >= day - 400
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert max(gaps) <= 2 * 86_400 / (clock_history.MOST / 2)
