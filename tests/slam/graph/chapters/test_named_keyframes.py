"""Keyframes of a chain in which what others measured ends."""

from __future__ import annotations

from drslamd.conventions import Chain
from drslamd.slam.graph.chapters.books import LEVELS, Sorter, bound
from drslamd.slam.graph.chapters.named_keyframes import named_keyframes
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.pose_graph import PoseGraph

OWN, OTHER, THIRD = Chain(1, 1), Chain(2, 1), Chain(3, 1)
BOOK = bound(
    [Sorter().book(GraphEntry(k, None, (Keyframe(10 * k, 0, k, 0, 0),)), 0) for k in range(64)]
)
SEEN = (1.0, 0.0, 0.0), (0.25, 0.0, 0.0, 0.25, 0.0, 0.25)


def ranged(a_n: int, peer: Chain, b_n: int) -> RangeMeasurement:
    return RangeMeasurement(a_n, peer, b_n, (0.0, 0.0), (0.0, 0.0), 5.0, 0.125)


def test_four_ranges_of_each_cell_and_all_later_words_name_keyframes() -> None:
    graph = PoseGraph()
    for k in range(64):
        words = (
            [ClosureMeasurement(0, k == 3, 10 * k, OWN, 10 * k + 1, *SEEN)] if k in (3, 9) else []
        )
        ranges = ranged(10 * k, OWN, 10 * k + 1), ranged(10 * k, THIRD, 10 * k + 2)
        graph.insert(OTHER, GraphEntry(k, None, (), ranges, tuple(words)))
    # (a closure that is withdrawn is named by its last word)
    wanted = {10 * k + 1 for k in (*range(0, 64, 4), 9)}
    assert named_keyframes(graph, OWN, BOOK, LEVELS[1]) >= wanted - {91}
    assert named_keyframes(graph, OWN, BOOK, LEVELS[2]) >= {1, 161, 321, 481}
    assert len(named_keyframes(graph, OWN, BOOK, LEVELS[2])) <= 6


def test_where_a_robot_stands_what_it_measured_later_names_its_last_keyframe() -> None:
    graph = PoseGraph()
    for k in range(64):
        graph.insert(OWN, GraphEntry(k, None, (Keyframe(10 * k, 0, k, 0, 0),)))
    for k in range(64, 96):
        graph.insert(OWN, GraphEntry(k, ranges=(ranged(630, OTHER, 10 * k),)))
    assert named_keyframes(graph, OWN, BOOK, LEVELS[1]) == {630}


def test_a_book_without_keyframes_has_none_that_is_named() -> None:
    assert named_keyframes(PoseGraph(), OWN, bound([]), LEVELS[1]) == set()
