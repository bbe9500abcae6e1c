"""Pairs that are thinned together: each becomes what it becomes alone."""

from __future__ import annotations

import numpy as np
from long_drives import Drive, logs
from slam_scenes import keyframes, range_item

from drslamd.conventions import Chain
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.thinning.team_chains import TeamChains
from drslamd.slam.graph.thinning.thinned_pairs import (
    NOTHING,
    PairPart,
    Unthinned,
    spans_of,
    thinned_pairs,
)


def said_and_graph() -> tuple[list[Unthinned], PoseGraph]:
    graph = PoseGraph()
    for origin, entry in logs(4, 1_500, [Drive(), Drive(clock=500_011), Drive(clock=777)], 3):
        graph.insert(origin, entry)
    out = []
    for pair in graph.usable():
        for half in (0, 1):
            ranges, closures = pair.ranges, pair.closures
            middle = np.median(ranges.a_n)
            ranges = ranges.chosen((ranges.a_n > middle) == half)
            closures = closures.chosen((closures.a_n > middle) == half)
            spans = (
                span(ranges.a_n, closures.a_n),
                span(ranges.b_n, closures.b_n),
            )
            out.append(Unthinned(pair.a.robot, pair.b.robot, ranges, closures, *spans, True))
    return out, graph


def span(*keyframes: np.ndarray) -> tuple[int, int]:
    named = np.concatenate(keyframes).astype(int)
    return int(named.min()), int(named.max())


def thinned(said: list[Unthinned], graph: PoseGraph) -> list[PairPart]:
    """By chains of nothing else."""
    return thinned_pairs(said, TeamChains(graph.view.chains, spans_of(said)))


def bits(part: PairPart) -> tuple[bytes, ...]:
    return part.ranges.rows.tobytes(), part.moves.tobytes(), part.closures.rows.tobytes()


def test_what_becomes_of_a_pair_does_not_depend_on_the_others() -> None:
    said, graph = said_and_graph()
    together = thinned(said, graph)
    assert len(together) == len(said) == 6
    for one, part in zip(said, together, strict=True):
        (alone,) = thinned([one], graph)
        assert bits(alone) == bits(part)
        assert 0 < len(part.ranges) <= len(one.ranges)
        assert 0 < len(part.closures) <= len(one.closures)
    assert any(len(part.ranges) < len(one.ranges) for one, part in zip(said, together, strict=True))
    for one, part in zip(reversed(said), thinned(said[::-1], graph), strict=True):
        (alone,) = thinned([one], graph)
        assert bits(alone) == bits(part)
    assert thinned([], graph) == []
    # nor on what else there is of the chains
    of_all = thinned_pairs(said[:1], TeamChains(graph.view.chains, spans_of(said)))
    assert bits(of_all[0]) == bits(together[0])


def test_what_names_keyframes_that_nobody_holds_waits() -> None:
    """As of a robot whose keyframes are all still to come, or begin later than its peer's."""
    said, graph = said_and_graph()
    one = said[0]
    late = one.ranges.copy()
    late.rows[:, :3] += [1e6, 0, 1e6]
    spans = span(late.a_n), span(late.b_n)
    unheld = Unthinned(one.a, one.b, late, NOTHING.closures, *spans, True)
    (none,) = thinned([unheld], graph)
    assert (len(none.ranges), len(none.moves), len(none.closures)) == (0, 0, 0)
    both = [unheld, one]
    assert len(thinned(both, graph)[1].ranges) > 0


def test_a_digest_sees_each_of_what_a_part_holds_and_nothing_of_an_empty_one() -> None:
    said, graph = said_and_graph()
    part = thinned(said[:1], graph)[0]
    moved = part.moves.copy()
    moved[np.flatnonzero(moved.reshape(len(moved), -1).any(axis=1))[0]] += 1e-3
    others = [
        PairPart(part.ranges, moved, part.closures),
        PairPart(part.ranges, part.moves, NOTHING.closures),
        PairPart(NOTHING.ranges, NOTHING.moves, part.closures),
    ]
    assert len({part.digest, *(other.digest for other in others)}) == 4
    assert PairPart(part.ranges, part.moves.copy(), part.closures).digest == part.digest
    assert NOTHING.digest == b""


def test_ranges_of_old_times_wait_for_their_keyframes() -> None:
    """A newcomer hears entries in any order: of an old stretch no keyframe at all may be held."""
    graph, a, b = PoseGraph(), Chain(0, 1), Chain(1, 1)
    graph.insert(b, GraphEntry(1, keyframes=keyframes([9_000], [(0, 0, 0)])))
    said = tuple(range_item(n, b, n, 3.0) for n in (10, 500, 99_000, 100_000))
    graph.insert(a, GraphEntry(1, keyframes=keyframes([9_000], [(0, 0, 0)]), ranges=said))
    assert [len(pair.ranges) for pair in graph.view.pairs] == [0]
