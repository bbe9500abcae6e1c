"""When a robot makes a chapter of its log, and in which messages."""

from __future__ import annotations

import random

import pytest
from message_builders import HEADER, an_entry

from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.bounds import LAST_SEQ
from drslamd.gossip.entries.chapter_writer import ChapterWriter
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.message_types import LogState
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


def written(entries: list[GraphEntry]) -> list[GraphEntry]:
    writer = ChapterWriter()
    for entry in entries:
        writer.take(entry)
    return writer.due(len(entries))


@pytest.mark.parametrize(("count", "is_due"), [(255, False), (256, True)])
def test_a_chapter_is_made_of_256_entries(count: int, is_due: bool) -> None:
    assert bool(written([an_entry(k, 10 * k) for k in range(count)])) is is_due


@pytest.mark.parametrize(
    ("count", "complete", "is_due"),
    [(15, 0, False), (16, 0, True), (16, 1, False), (40, 24, True), (40, 25, False)],
)
def test_a_chapter_is_made_early_when_somebody_lacks_sixteen_entries(
    count: int, complete: int, is_due: bool
) -> None:
    writer = asked(count, LogState(*OWN, 0, complete, count))
    assert bool(writer.due(count)) is is_due


def asked(count: int, *rows: LogState) -> ChapterWriter:
    """After so many entries and one status."""
    writer = ChapterWriter()
    for k in range(count):
        writer.take(an_entry(k, 10 * k))
    writer.on_states(OWN, rows)
    return writer


@pytest.mark.parametrize(("first", "is_due"), [(15, False), (16, True)])
def test_what_a_newcomer_heard_as_it_was_said_is_no_reason_for_a_chapter(
    first: int, is_due: bool
) -> None:
    rows = LogState(*OWN, 0, 0, 40), LogState(*OWN, first, 40, 40)
    assert bool(asked(40, *rows).due(40)) is is_due


def test_the_log_of_somebody_else_or_of_another_start_is_no_reason_for_a_chapter() -> None:
    for chain in (Chain(OWN.robot + 1, OWN.epoch), Chain(OWN.robot, OWN.epoch - 1)):
        assert not asked(40, LogState(*chain, 0, 0, 40)).due(40)


def test_rows_of_any_length_are_read_in_no_time() -> None:
    rows = LogState(*OWN, 0, 0, 40), LogState(*OWN, 1, LAST_SEQ, LAST_SEQ)
    assert not asked(40, *rows).due(40)


def test_a_chapter_says_all_keyframes_and_its_last_part_says_of_how_many_it_is_made() -> None:
    said = written([busy(k, 4) for k in range(256)])
    chapters = [entry.chapter for entry in said if entry.chapter]
    assert [entry.seq for entry in said] == list(range(256, 256 + len(said)))
    layers = [chapter.layer for chapter in chapters]
    assert layers == sorted(layers, reverse=True)
    assert [any(chapter.parts) for chapter in chapters] == [False] * (len(said) - 1) + [True]
    assert chapters[-1].parts == tuple(layers.count(layer) for layer in (2, 1, 0))
    assert all(chapter.first == 0 for chapter in chapters)
    frames = sorted(k.n for chapter in chapters for k in chapter.keyframes)
    assert frames == [10 * k for k in range(256)]
    places = [place for chapter in chapters for place, _ in chapter.ranges]
    assert sorted(places) == [4096 * k + at for k in range(256) for at in range(4)]


def test_each_part_fits_a_message() -> None:
    said = written([busy(k, 19) for k in range(64)])
    assert len(said) > 5
    assert all(len(messages.encode(HEADER, entry)) <= MAX_PAYLOAD for entry in said)


@pytest.mark.parametrize(("count", "is_due"), [(63, False), (64, True)])
def test_a_chapter_is_made_of_fewer_entries_when_they_say_much(count: int, is_due: bool) -> None:
    """1,280 measurements, a keyframe and 19 ranges in each entry."""
    assert bool(written([busy(k, 19) for k in range(count)])) is is_due


def test_robots_that_range_to_nobody_write_one_part() -> None:
    (entry,) = written([an_entry(k, 10 * k) for k in range(256)])
    assert entry.chapter is not None
    assert entry.chapter.parts == (0, 0, 1)


def test_chapters_are_not_made_of_chapters() -> None:
    writer = ChapterWriter()
    for entry in [busy(k, 3) for k in range(256)]:
        writer.take(entry)
    said = writer.due(256)
    for entry in [*said, *(busy(k, 3) for k in range(256 + len(said), 511 + len(said)))]:
        writer.take(entry)
    assert writer.due(600) == []
