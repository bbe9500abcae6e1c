"""The team's graph: whatever comes in whatever order, the same items make the same graph."""

from __future__ import annotations

import itertools
import random
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, closure, keyframes, model_of, range_item, small_team, wander

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph import pose_graph
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.graph.pose_graph import PoseGraph

A, B, C = Chain(0, 5), Chain(1, 6), Chain(2, 7)
EVERYBODY = {0, 1, 2}


def graph_of(*entries: tuple[Chain, GraphEntry]) -> PoseGraph:
    graph = PoseGraph()
    for origin, entry in entries:
        graph.insert(origin, entry)
    return graph


def some_entries() -> list[tuple[Chain, GraphEntry]]:
    """A few entries of each of three robots, with everything in them."""
    rng = np.random.default_rng(0)
    out = []
    for chain, peer in ((A, B), (B, C), (C, A)):
        path = wander(rng, 20, 0.4)
        for seq in range(5):
            n = range(40 * seq, 40 * seq + 40, 10)
            part = keyframes(n, path[4 * seq : 4 * seq + 4], segment=seq // 3)
            ranges = tuple(range_item(k, peer, k, float(rng.uniform(1, 9))) for k in n)
            # two ranges between the same two keyframes, and a closure that is withdrawn later
            ranges += (range_item(n[0], peer, n[0], 4.0), range_item(n[0], peer, n[0], 3.0))
            closures = [closure(seq, n[1], peer, n[1], (1.0, seq, 0.1))]
            if seq == 3:
                closures.append(closure(1, 50, peer, 50, (1.0, 1, 0.1), kept=False))
            traits = model_of(replace(NOISE, scale=0.01 * (seq + 1)), (0.1 * seq, 0.0))
            out.append((chain, GraphEntry(seq, traits, part, ranges, tuple(closures))))
    return out


# idempotent and free of order


def test_a_repeated_entry_changes_nothing() -> None:
    entries = some_entries()
    once, twice = graph_of(*entries), graph_of(*entries, *entries[::2], *entries)
    assert once.digest(EVERYBODY) == twice.digest(EVERYBODY)
    for key, pair in once.pairs.items():
        assert np.array_equal(pair.ranges.rows, twice.pairs[key].ranges.rows)
        assert pair.kept_closures() == twice.pairs[key].kept_closures()


def test_every_order_of_arrival_gives_the_same_graph() -> None:
    entries = some_entries()
    reference = graph_of(*entries)
    shuffle = random.Random(1)
    for _ in range(30):
        shuffle.shuffle(entries)
        graph = PoseGraph()
        for origin, entry in entries:
            graph.insert(origin, entry)
            if shuffle.random() < 0.3:
                graph.digest(EVERYBODY)  # somebody looks in between
        assert graph.digest(EVERYBODY) == reference.digest(EVERYBODY)
        for robot, items in reference.chains.items():
            other = graph.chains[robot]
            assert np.array_equal(items.keyframes.rows, other.keyframes.rows)
            assert items.model == other.model
        for key, pair in reference.pairs.items():
            assert np.array_equal(pair.ranges.rows, graph.pairs[key].ranges.rows)
            assert pair.kept_closures() == graph.pairs[key].kept_closures()


def test_the_latest_word_counts_on_traits_and_on_closures() -> None:
    for order in itertools.permutations(e for e in some_entries() if e[0] == A):
        graph = graph_of(*order, (B, GraphEntry(0)))
        assert graph.chains[0].model.noise.scale == pytest.approx(0.05)
        assert graph.chains[0].model.antenna.tolist() == [0.4, 0.0]
        assert [c.number for c in graph.pairs[0, 1].kept_closures()] == [0, 2, 3, 4]


def test_the_digest_tells_every_item_apart() -> None:
    reference = graph_of(*some_entries()).digest(EVERYBODY)
    peer = (B, GraphEntry(9, keyframes=(Keyframe(1000, 1, 0, 0, 0),)))
    ranged = (A, GraphEntry(9, ranges=(range_item(0, B, 0, 5.0),)))
    closed = (A, GraphEntry(9, closures=(closure(9, 0, B, 0, (0, 0, 0)),)))
    digests = {graph_of(*some_entries(), more).digest(EVERYBODY) for more in (peer, ranged, closed)}
    assert len(digests | {reference}) == 4


def test_the_digest_is_of_the_robots_that_are_asked_for() -> None:
    entries = some_entries()
    graph = graph_of(*entries, (C, GraphEntry(9, keyframes=(Keyframe(1000, 1, 0, 0, 0),))))
    assert graph.digest({0, 1}) == graph_of(*entries).digest({0, 1})
    assert graph.digest({0, 2}) != graph_of(*entries).digest({0, 2})


def test_keyframes_that_contradict_each_other_are_settled_the_same_way_everywhere() -> None:
    one, other = Keyframe(10, 0, 5, 5, 5), Keyframe(10, 0, 5, 4, 9)
    rest = Keyframe(20, 0, 7, 7, 7)
    graphs = [
        graph_of(*((A, GraphEntry(seq, keyframes=(k,))) for seq, k in order))
        for order in itertools.permutations(enumerate([one, other, rest]))
    ]
    assert {g.digest({0}) for g in graphs} == {graphs[0].digest({0})}
    assert np.allclose(
        graphs[0].chains[0].keyframes.rows, [[10, 0, 5e-4, 4e-4, 9e-4], [20, 0, *[7e-4] * 3]]
    )


# epochs


def test_a_new_epoch_forgets_the_old_chain_and_what_it_measured() -> None:
    graph = graph_of(*some_entries())
    again = Chain(0, 50)
    graph.insert(again, GraphEntry(0, keyframes=(Keyframe(3, 0, 1, 2, 3),)))
    assert graph.chains[0].chain == again
    assert graph.chains[0].keyframes.n.tolist() == [3]
    assert [key for key in graph.pairs if key[0] == 0] == []
    # what others measured to the old chain is of no use until they name the new one
    assert [(p.a.robot, p.b.robot) for p in graph.usable()] == [(1, 2)]
    assert [(p.a.robot, p.b.robot) for p in graph.view.pairs] == [(1, 2)]


def test_graphs_that_held_unlike_parts_of_an_old_start_are_alike_once_a_new_one_is_heard_of() -> (
    None
):
    """Nobody repeats what an old start said: its log is gone with the first word of the new one."""
    entries = some_entries()
    whole, lacking = (
        graph_of(*entries),
        graph_of(*[e for e in entries if e[0] != A or e[1].seq < 4]),
    )
    assert whole.digest(EVERYBODY) != lacking.digest(EVERYBODY)
    for graph in (whole, lacking):
        assert not graph.begin(A)
        assert not graph.begin(Chain(A.robot, A.epoch - 1))
        assert graph.begin(Chain(A.robot, A.epoch + 1))
        assert not graph.begin(Chain(A.robot, A.epoch + 1))
        assert A.robot not in graph.chains
    assert whole.digest(EVERYBODY) == lacking.digest(EVERYBODY)


def test_a_start_that_is_heard_of_while_the_graph_is_looked_at_counts_after_that() -> None:
    graph, same = graph_of(*some_entries()), graph_of(*some_entries())
    again = Chain(A.robot, A.epoch + 1)
    assert graph.look(0.5) is None
    assert graph.begin(again)
    assert A.robot in graph.chains
    assert same.begin(again)
    assert graph.digest(EVERYBODY) == same.digest(EVERYBODY)
    assert A.robot not in graph.chains


@pytest.mark.parametrize(("count", "is_looking"), [(3, True), (4, False)])
def test_one_more_than_may_wait_ends_the_look_and_nothing_is_lost(
    count: int, is_looking: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pose_graph, "MAX_WAITING", 3)
    news = [(C, GraphEntry(k, keyframes=(Keyframe(1_000 + k, 1, 0, 0, 0),))) for k in range(count)]
    graph = graph_of(*some_entries())
    assert graph.look(0.5) is None
    for origin, entry in news:
        graph.insert(origin, entry)
    assert (1_000 not in graph.chains[C.robot].keyframes.n) is is_looking
    assert graph.digest(EVERYBODY) == graph_of(*some_entries(), *news).digest(EVERYBODY)


def test_an_old_epoch_is_not_listened_to() -> None:
    graph = graph_of((A, GraphEntry(0, keyframes=(Keyframe(3, 0, 1, 2, 3),))))
    graph.insert(Chain(0, 4), GraphEntry(1, keyframes=(Keyframe(4, 0, 1, 2, 3),)))
    assert graph.chains[0].keyframes.n.tolist() == [3]


def test_ranges_to_an_old_start_of_a_peer_are_dropped_whichever_comes_first() -> None:
    old, new = Chain(1, 6), Chain(1, 60)
    to_old = (A, GraphEntry(0, ranges=(range_item(0, old, 0, 1.0),)))
    to_new = (A, GraphEntry(1, ranges=(range_item(0, new, 0, 2.0),)))
    for order in ((to_old, to_new), (to_new, to_old)):
        pair = graph_of(*order).pairs[0, 1]
        assert pair.b == new
        assert pair.ranges.range_m.tolist() == [2.0]


# what waits, what is bounded


def test_an_item_may_name_a_keyframe_that_has_not_come_yet() -> None:
    graph = graph_of((A, GraphEntry(0, closures=(closure(0, 10, B, 20, (1, 0, 0)),))))
    assert graph.usable() == []
    graph.insert(B, GraphEntry(0))
    assert len(graph.usable()) == 1
    items = graph.chains[0]
    assert items.keyframes.find(np.array([10.0]))[1].tolist() == [False]
    graph.insert(A, GraphEntry(1, keyframes=(Keyframe(10, 0, 0, 0, 0),)))
    assert items.keyframes.find(np.array([10.0, 9.0, 11.0]))[1].tolist() == [True, False, False]


# segments


def test_rows_of_a_segment_are_found_and_of_one_that_is_not_there_are_none() -> None:
    graph = graph_of(*some_entries())
    assert graph.chains[0].keyframes.of_segment(0) == slice(0, 12)
    assert graph.chains[0].keyframes.of_segment(1) == slice(12, 20)
    assert graph.view.segment(Segment(*A, 1)).n.tolist() == list(range(120, 200, 10))
    assert len(graph.view.segment(Segment(*A, 7))) == 0


# nonsense is not taken in


def test_nobody_is_a_pair_with_himself() -> None:
    both = GraphEntry(0, None, (), (range_item(0, A, 1, 1.0),), (closure(0, 0, A, 1, (1, 0, 0)),))
    graph = graph_of((A, both))
    assert graph.pairs == {}


def test_the_small_team_of_the_other_tests_is_whole() -> None:
    team = small_team(0)
    assert len(team.graph.usable()) == 3 - 1 + 1
    assert all(len(items.keyframes.rows) == 40 for items in team.graph.chains.values())


def test_a_frozen_graph_stays_as_it_was_whatever_comes() -> None:
    entries = some_entries()
    graph = graph_of(*entries[:-1])
    still = graph.frozen()
    before = still.digest(EVERYBODY)
    assert before == graph.digest(EVERYBODY)
    graph.insert(*entries[-1])
    assert still.digest(EVERYBODY) == before != graph.digest(EVERYBODY)
