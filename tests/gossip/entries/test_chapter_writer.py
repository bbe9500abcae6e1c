"""When a robot makes a chapter of its log, and in which messages."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest
from message_builders import HEADER, an_entry

from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.bounds import LAST_SEQ
from drslamd.gossip.entries import chapter_writer
from drslamd.gossip.entries.chapter_writer import Audience, ChapterWriter
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.message_types import LogState
from drslamd.slam.graph.chapters.books import Book, Detail
from drslamd.slam.graph.measurements import GraphEntry, Keyframe, RangeMeasurement

OWN = Chain(3, 7)


def busy(seq: int, peers: int) -> GraphEntry:
    """An entry with a range to each of many peers, no two alike."""
    chance = random.Random(seq)
    ranges = tuple(
        RangeMeasurement(
            10 * seq, Chain(1 + k, 9), 10 * seq + k, (round(chance.random(), 3), 0.0), (0.0, 0.125),
            round(chance.uniform(1, 90), 4), 0.125,
        )
        for k in range(peers)
    )  # fmt: skip
    return GraphEntry(seq, None, (Keyframe(10 * seq, 0, 37 * seq * seq, seq, 0),), ranges)


MANY, FEW = Audience(300, 100), Audience(300, 2)


def written(entries: list[GraphEntry], audience: Audience = MANY) -> list[GraphEntry]:
    writer = ChapterWriter()
    for entry in entries:
        writer.take(entry, 0)
    return writer.due(len(entries), 0, audience)


@pytest.mark.parametrize(("count", "is_due"), [(255, False), (256, True)])
def test_a_chapter_is_made_of_256_entries(count: int, is_due: bool) -> None:
    assert bool(written([an_entry(k, 10 * k) for k in range(count)])) is is_due


@pytest.mark.parametrize(("recent_s", "entries"), [(150, 128), (75, 64), (37, 64), (600, 256)])
def test_a_large_team_which_thins_times_sooner_makes_chapters_of_fewer_entries(
    recent_s: int, entries: int
) -> None:
    for count, is_due in ((entries - 1, False), (entries, True)):
        made = written([an_entry(k, 10 * k) for k in range(count)], Audience(recent_s, 50))
        assert bool(made) is is_due


@pytest.mark.parametrize(
    ("count", "complete", "is_due"),
    [(15, 0, False), (16, 0, True), (16, 1, False), (40, 24, True), (40, 25, False)],
)
def test_a_chapter_is_made_early_when_somebody_lacks_sixteen_entries(
    count: int, complete: int, is_due: bool
) -> None:
    writer = asked(count, LogState(*OWN, 0, complete, count))
    assert bool(writer.due(count, 0, MANY)) is is_due


def asked(count: int, *rows: LogState) -> ChapterWriter:
    """After so many entries and one status."""
    writer = ChapterWriter()
    for k in range(count):
        writer.take(an_entry(k, 10 * k), 0)
    writer.on_states(OWN, rows)
    return writer


@pytest.mark.parametrize(("first", "is_due"), [(15, False), (16, True)])
def test_what_a_newcomer_heard_as_it_was_said_is_no_reason_for_a_chapter(
    first: int, is_due: bool
) -> None:
    rows = LogState(*OWN, 0, 0, 40), LogState(*OWN, first, 40, 40)
    assert bool(asked(40, *rows).due(40, 0, MANY)) is is_due


def test_the_log_of_somebody_else_or_of_another_start_is_no_reason_for_a_chapter() -> None:
    for chain in (Chain(OWN.robot + 1, OWN.epoch), Chain(OWN.robot, OWN.epoch - 1)):
        assert not asked(40, LogState(*chain, 0, 0, 40)).due(40, 0, MANY)


def test_rows_of_any_length_are_read_in_no_time() -> None:
    rows = LogState(*OWN, 0, 0, 40), LogState(*OWN, 1, LAST_SEQ, LAST_SEQ)
    assert not asked(40, *rows).due(40, 0, MANY)


def test_a_chapter_says_all_and_its_last_part_says_for_what_it_stands() -> None:
    said = written([busy(k, 4) for k in range(256)])
    chapters = [entry.chapter for entry in said if entry.chapter]
    assert [entry.seq for entry in said] == list(range(256, 256 + len(said)))
    assert [chapter.parts for chapter in chapters] == [0] * (len(said) - 1) + [len(said)]
    assert [chapter.replaces for chapter in chapters] == [()] * (len(said) - 1) + [((0, 256),)]
    frames = sorted(k.n for chapter in chapters for k in chapter.keyframes)
    assert frames == [10 * k for k in range(256)]
    places = [place for chapter in chapters for place, _ in chapter.ranges]
    assert sorted(places) == [4096 * k + at for k in range(256) for at in range(4)]


@pytest.mark.parametrize("robots", [2, 5, 20])
def test_each_part_fits_a_message_for_which_a_team_of_this_size_has_room(robots: int) -> None:
    said = written([busy(k, 19) for k in range(96)], Audience(300, robots))
    sizes = [len(messages.encode(HEADER, entry)) for entry in said]
    assert len(said) >= 4
    assert max(sizes) <= min(MAX_PAYLOAD, 500 * robots**0.5 + 1)
    assert min(sizes) > 0.5 * min(MAX_PAYLOAD, 500 * robots**0.5)


@pytest.mark.parametrize(("count", "is_due"), [(63, False), (64, True)])
def test_a_chapter_is_made_of_fewer_entries_when_they_say_much(count: int, is_due: bool) -> None:
    """1,280 measurements, a keyframe and 19 ranges in each entry."""
    assert bool(written([busy(k, 19) for k in range(count)])) is is_due


def test_robots_that_range_to_nobody_write_one_part() -> None:
    (entry,) = written([an_entry(k, 10 * k) for k in range(256)])
    assert entry.chapter is not None
    assert entry.chapter.parts == 1


Log = dict[int, GraphEntry]
SECOND = 1_000_000
PEER = Chain(1, 9)


def a_log(count: int, each_s: int = 1, audience: Audience = MANY) -> Log:
    """All that a robot says that drives straight on and ranges to one peer, what chapters stand for
    taken away; somebody asks for all that is in no chapter when it has waited for a minute or so.

    Args:
        each_s: entries in a second.
    """
    writer, log, seq = ChapterWriter(), Log(), 0
    for k in range(count):
        metres = round(30 + 20 * math.sin(0.01 * k), 4)
        ranged = RangeMeasurement(10 * k, PEER, 10 * k + 3, (0.0, 0.0), (0.0, 0.0), metres, 0.125)
        entry = GraphEntry(seq, None, (Keyframe(10 * k, 0, 5_000 * k, 0, 0),), (ranged,))
        log[seq] = entry
        writer.take(entry, SECOND * k // each_s)
        seq += 1
        if k % 1_000 < 80:
            writer.on_states(OWN, [LogState(*OWN, 0, 0, seq)])
        for said in writer.due(seq, SECOND * k // each_s, audience):
            assert said.chapter is not None
            log[seq] = said
            for first, end in said.chapter.replaces:
                for gone in range(first, end):
                    log.pop(gone, None)
            assert messages.decode("GRAPH", messages.encode(HEADER, said)) == said
            seq += 1
    return log


def test_as_a_log_ages_it_is_said_with_less_and_nothing_twice() -> None:
    """Two hours: the last eleven minutes whole, then a keyframe every four seconds, then every
    sixteen; of ranges four of a quarter of a minute, then of a minute."""
    log = a_log(7_200)
    said = [entry.chapter for entry in log.values() if entry.chapter]
    frames = [k.n // 10 for chapter in said for k in chapter.keyframes]
    places = [item.a_n // 10 for chapter in said for _, item in chapter.ranges]
    for found in (frames, places):
        assert len(found) == len(set(found))
    whole = {entry.keyframes[0].n // 10 for entry in log.values() if entry.keyframes}
    assert {*frames, *whole} >= set(range(7_200 - 680, 7_200))
    # (where books of few entries met, one or two more were measured at)
    assert 256 <= sum(k < 4_096 for k in frames) <= 1.1 * 256
    assert 128 <= sum(k < 4_096 for k in places) <= 1.1 * 256
    assert 144 / 4 <= sum(6_000 <= k < 6_144 for k in frames) <= 144 / 3
    assert len(said) < 30


def test_in_a_large_team_only_the_last_minutes_of_a_log_are_whole() -> None:
    """Where nothing is thinned for 37 s, times 154 s old have a quarter of a minute in a cell, and
    chapters of a minute each wait until they have 192 entries; of the first quarter of an hour four
    ranges of four minutes stay."""
    log = a_log(1_900, audience=Audience(37, 50))
    said = [entry.chapter for entry in log.values() if entry.chapter]
    seconds = {item.a_n // 10 for chapter in said for _, item in chapter.ranges}
    seconds |= {item.a_n // 10 for entry in log.values() for item in entry.ranges}
    assert seconds >= set(range(1_900 - 154, 1_900))
    assert not seconds >= set(range(1_900 - 154 - 192 - 64 - 16, 1_900 - 154))
    assert 4 * 896 / 256 <= sum(k < 896 for k in seconds) <= 1.3 * 4 * 896 / 256


def test_a_robot_that_says_much_makes_chapters_before_they_lie_too_far_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Twenty entries a second: half as many as a chapter may speak of take three minutes here, and
    not a quarter of an hour."""
    monkeypatch.setattr(chapter_writer, "MOST_LAG", 1 << 13)
    log = a_log(5_000, each_s=20)
    oldest = min(
        first for entry in log.values() if entry.chapter for first, _ in entry.chapter.replaces[:1]
    )
    assert oldest == 0
    frames = [k.n // 10 for e in log.values() if e.chapter for k in e.chapter.keyframes]
    assert sum(k < 512 for k in frames) < 150
    assert sum(2_048 <= k < 3_072 for k in frames) == 1_024


def test_the_keyframes_that_others_name_are_asked_for_and_stay() -> None:
    asked: list[tuple[int, int, int]] = []

    def named(book: Book, level: Detail) -> set[int]:
        asked.append((book.keyframes[0].n, book.keyframes[-1].n, level.cell_s))
        return {50, 70}

    writer = ChapterWriter()
    for k in range(257):
        writer.take(an_entry(k, 10 * k), 0)
    writer.due(257, 0, replace(MANY, named=named))
    for k in range(257, 513):
        writer.take(an_entry(k, 10 * k), 700 * SECOND)
    now, audience = 1_362 * SECOND, replace(MANY, named=named)
    (new,) = writer.due(513, now, audience)
    assert new.chapter is not None
    assert new.chapter.replaces == ((257, 513),)
    said = writer.due(514, now, audience)
    assert not writer.due(514 + len(said), now, audience)
    assert asked == [(0, 2_560, 16)]
    frames = {k.n for entry in said if entry.chapter for k in entry.chapter.keyframes}
    assert {50, 70} <= frames
    assert 60 not in frames
