"""How much may be said again in a second."""

from __future__ import annotations

import pytest
from log_scenes import T0
from message_builders import MS, SECOND, a_status, an_entry

from drslamd.gossip.repeats.allowance import FRAMING, Allowance, Speech, said_of
from drslamd.slam.graph.measurements import Chapter, GraphEntry


def repeated_in(seconds: int, pace: Allowance, size: int = 500, said_ms: int = 0) -> int:
    """Bytes of repeats that go out in the last ten seconds, when somebody always has one.

    Args:
        said_ms: how often 100 new bytes are said, 0 never.
    """
    sent = 0
    for ms in range(0, 1000 * seconds, 10):
        if said_ms and ms % said_ms == 0:
            pace.on_air(100, T0 + ms * MS, Speech.NEW, 1)
        if pace.has_room(T0 + ms * MS, size):
            pace.on_air(size, T0 + ms * MS, Speech.AGAIN, 1)
            sent += size if ms >= 1000 * (seconds - 10) else 0
    return sent


def test_repeats_have_a_least_rate_where_nothing_else_is_said() -> None:
    assert repeated_in(10, Allowance(), size=500 - FRAMING) == 30 * (500 - FRAMING)


@pytest.mark.parametrize(("others", "in_a_second"), [(1, 3), (2, 5), (3, 7), (9, 17)])
def test_a_large_team_has_more_of_them(others: int, in_a_second: int) -> None:
    """700 bytes a second for each robot, here in messages of 400."""
    pace = Allowance()
    pace.reckon([0.0] * others)
    assert repeated_in(10, pace, size=400 - FRAMING) == 10 * in_a_second * (400 - FRAMING)


def test_repeats_have_about_as_many_bytes_as_everything_else() -> None:
    """20 messages a second of 125 bytes with their framing: 2,500, so 25,000 in ten seconds."""
    sent = repeated_in(30, Allowance(), size=200, said_ms=50)
    assert 0.9 * 25_000 <= sent * 225 / 200 <= 1.03 * 25_000


def test_in_no_second_is_more_than_twice_as_much_on_the_air_as_usual() -> None:
    """Also where some seconds of three are busier: what is about to come is foreseen."""
    pace, said_at = Allowance(), []
    for ms in range(0, 30_000, 10):
        # in the first half second of three, four times as much is said as in the others
        for _ in range(4 if ms % 3_000 < 500 else 1):
            pace.on_air(40 - FRAMING, T0 + ms * MS, Speech.NEW, 1)
            said_at.append((ms, 40))
        if ms >= 10_000 and pace.has_room(T0 + ms * MS, 500):
            pace.on_air(500, T0 + ms * MS, Speech.AGAIN, 1)
            said_at.append((ms, 500 + FRAMING))
    usual = sum(size for ms, size in said_at if size == 40) / 30
    for begin in range(10_000, 29_000, 100):
        said = sum(size for ms, size in said_at if begin <= ms < begin + 1000)
        assert said <= 2.25 * usual  # its estimate of `usual` goes up and down by an eighth
    assert sum(size for ms, size in said_at if ms >= 10_000) >= 20 * 1.6 * usual


@pytest.mark.parametrize(("apart_ms", "do_all_count"), [(2_499, False), (2_500, True)])
def test_statuses_that_ask_are_no_reason_to_say_more(apart_ms: int, do_all_count: bool) -> None:
    """Of a robot whose statuses follow each other sooner than in 2.5 s, every other one counts."""
    pace, same = Allowance(), Allowance()
    for k in range(20):
        pace.on_air(5_000, T0 + k * apart_ms * MS, Speech.STATUS, 1)
        if k % 2 == 0 or do_all_count:
            same.on_air(5_000, T0 + k * apart_ms * MS, Speech.NEW, 1)
        same.has_room(T0 + k * apart_ms * MS)
    now = T0 + 19 * apart_ms * MS
    assert pace._first.rate(now) == pytest.approx(same._first.rate(now), rel=1e-6)


@pytest.mark.parametrize(
    ("counter", "latest", "said_as"),
    [(7, 7, Speech.NEW), (6, 7, Speech.AGAIN), (7, None, Speech.AGAIN)],
)
def test_an_entry_from_before_the_last_status_of_its_robot_is_said_again(
    counter: int, latest: int | None, said_as: Speech
) -> None:
    assert said_of(an_entry(3, 30), counter, latest) is said_as
    assert said_of(GraphEntry(3, chapter=Chapter(1, ((0, 1),))), counter, latest) is Speech.AGAIN
    assert said_of(a_status(), counter, latest) is Speech.STATUS


def test_one_of_many_leaves_a_fiftieth_of_the_room() -> None:
    few, many = Allowance(), Allowance()
    assert few.has_room(T0, 1_500 - FRAMING)
    assert not few.has_room(T0, 1_501 - FRAMING)
    assert many.has_room(T0, 1_470 - FRAMING, is_one_of_many=True)
    assert not many.has_room(T0, 1_471 - FRAMING, is_one_of_many=True)


def test_they_may_be_more_where_messages_are_lost() -> None:
    """At a loss of a half each needs 0.55 * 0.5 / 0.25 beyond itself: of 2,800 bytes 5,880. One of
    many leaves a third of that, 1.2 / 4 and a fiftieth, since half of what is said again is not
    heard of."""
    lossy = Allowance()
    lossy.reckon([0.5, 0.5, 0.0])
    assert lossy.has_room(T0, 5_879 - FRAMING)
    assert not lossy.has_room(T0, 5_881 - FRAMING)
    assert lossy.has_room(T0, 3_998 - FRAMING, is_one_of_many=True)
    assert not lossy.has_room(T0, 3_999 - FRAMING, is_one_of_many=True)
    hopeless = Allowance()
    hopeless.reckon([1.0])
    assert hopeless.loss == 0.8


def test_however_much_else_is_said_a_fifth_is_left_for_repeats() -> None:
    pace = Allowance()
    for k in range(10):
        # a robot that asks for more and more
        pace.on_air(250 - FRAMING, T0 + k * 100 * MS, Speech.STATUS, 1)
    assert pace.has_room(T0 + 900 * MS, 300 - FRAMING)
    assert not pace.has_room(T0 + 900 * MS, 301 - FRAMING)


def test_no_more_than_a_second_of_repeats_is_remembered() -> None:
    pace = Allowance()
    for ms in range(0, 5_000, 10):
        pace.on_air(100, T0 + ms * MS, Speech.AGAIN, 1, heard=True)
    assert len(pace._again._said) == 100
    assert pace._again.bytes(T0 + 4_990 * MS) == 100 * (100 + FRAMING)


def test_whoever_floods_the_channel_with_repeats_leaves_each_robot_one_a_second() -> None:
    pace, sent = Allowance(), 0
    for ms in range(0, 10_000, 10):
        pace.on_air(1_000, T0 + ms * MS, Speech.AGAIN, 1, heard=True)
        if pace.has_room(T0 + ms * MS, 500):
            pace.on_air(500, T0 + ms * MS, Speech.AGAIN, 1)
            sent += 1
    assert 9 <= sent <= 13
    assert pace.has_room(T0 + 12 * SECOND, 500)
