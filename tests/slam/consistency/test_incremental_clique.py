"""The largest consistent set, against networkx on small graphs."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drslamd.slam.consistency import incremental_clique as clique_module
from drslamd.slam.consistency.incremental_clique import IncrementalClique, bits


def random_graph(seed: int, n: int, density: float) -> nx.Graph:
    return nx.gnp_random_graph(n, density, seed=seed)


def incremental(graph: nx.Graph) -> IncrementalClique:
    out = IncrementalClique()
    for vertex in sorted(graph):
        out.add(sum(1 << other for other in graph[vertex] if other < vertex))
    return out


def maximum(graph: nx.Graph) -> int:
    return max((len(c) for c in nx.find_cliques(graph)), default=0)


def all_joined(graph: nx.Graph, vertices: list[int]) -> bool:
    return all(graph.has_edge(a, b) for a in vertices for b in vertices if a < b)


@given(st.integers(0, 2**70))
def test_bits_are_the_positions_of_ones(mask: int) -> None:
    assert sum(1 << k for k in bits(mask)) == mask
    assert bits(mask) == sorted(set(bits(mask)))


@pytest.mark.parametrize("density", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("n", [5, 12, 30])
def test_the_clique_is_one_at_every_moment_and_nearly_the_largest(n: int, density: float) -> None:
    found = best = 0
    for seed in range(25):
        graph = random_graph(seed, n, density)
        clique = IncrementalClique()
        for vertex in range(n):
            clique.add(sum(1 << other for other in graph[vertex] if other < vertex))
            kept = bits(clique.clique)
            assert all_joined(graph, kept)
            assert clique.is_verified()
            assert len(kept) <= maximum(graph.subgraph(range(vertex + 1)))
        found, best = found + len(bits(clique.clique)), best + maximum(graph)
    assert found >= 0.94 * best


def test_planted_cliques_are_found() -> None:
    """What module 2 really sees: consistent closures among scattered wrong ones."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        graph = random_graph(seed, 60, 0.15)
        planted = sorted(rng.choice(60, 25, replace=False).tolist())
        graph.add_edges_from((a, b) for a in planted for b in planted if a < b)
        assert set(planted) <= set(bits(incremental(graph).clique))


@pytest.mark.parametrize("good", [0.3, 0.5, 0.8])
def test_among_closures_with_noise_it_is_nearly_as_large_as_the_largest(good: float) -> None:
    """Three in a hundred pairs of good closures disagree by chance."""
    found = best = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        graph = random_graph(seed, 100, 0.02)
        right = np.flatnonzero(rng.random(100) < good).tolist()
        graph.add_edges_from((a, b) for a in right for b in right if a < b and rng.random() < 0.97)
        found += len(bits(incremental(graph).clique))
        best += nx.max_weight_clique(graph, weight=None)[1]
    assert found >= 0.94 * best


def test_without_a_processor_that_counts_bits_the_answer_is_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    graph = random_graph(3, 80, 0.7)
    there = incremental(graph)
    monkeypatch.delattr(np, "bitwise_count", raising=False)
    assert incremental(graph).clique == there.clique
    assert there.runner_up() == incremental(graph).runner_up()


def test_more_vertices_than_one_word_holds_keep_their_edges() -> None:
    graph = random_graph(1, 200, 0.3)
    clique = incremental(graph)
    assert clique_module.WORD < 200
    for vertex, mask in enumerate(clique.adjacency):
        assert bits(mask) == sorted(graph[vertex])


def test_the_same_graph_gives_the_same_clique() -> None:
    graph = random_graph(5, 40, 0.5)
    assert incremental(graph).clique == incremental(graph).clique
    # of equals the lowest numbers: two triangles that share nothing
    pair = nx.Graph([(0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (4, 5)])
    assert bits(incremental(pair).clique) == [0, 1, 2]


@pytest.mark.parametrize("vertices", [range(2), range(64, 66), range(63, 65)])
def test_a_set_with_a_missing_edge_is_not_verified(vertices: range) -> None:
    graph = nx.empty_graph(70)
    graph.add_edges_from([tuple(vertices), (vertices[1], 69)])
    clique = incremental(graph)
    for good in (0, 1 << 3, sum(1 << v for v in vertices)):
        clique.clique = good
        assert clique.is_verified()
    clique.clique = sum(1 << v for v in (*vertices, 69))
    assert not clique.is_verified()


def test_the_runner_up_is_the_largest_set_outside() -> None:
    graph = nx.Graph()
    graph.add_nodes_from(range(12))
    for group in ([0, 2, 4, 6, 8], [1, 3, 5], [7, 9, 10, 11]):
        graph.add_edges_from((a, b) for a in group for b in group if a < b)
    graph.add_edge(0, 7)
    clique = incremental(graph)
    assert bits(clique.clique) == [0, 2, 4, 6, 8]
    assert bits(clique.runner_up()) == [7, 9, 10, 11]


def test_nothing_has_no_runner_up() -> None:
    assert IncrementalClique().runner_up() == 0
    alone = IncrementalClique()
    alone.add(0)
    assert (alone.clique, alone.runner_up()) == (1, 0)


@pytest.mark.parametrize("count", [0, 1, 7, 20])
def test_forgetting_leaves_the_graph_of_the_others(count: int) -> None:
    graph = random_graph(9, 20, 0.6)
    clique = incremental(graph)
    kept = [k - count for k in bits(clique.clique) if k >= count]
    clique.drop_oldest(count)
    rest = nx.relabel_nodes(graph.subgraph(range(count, 20)), lambda k: k - count)
    assert len(clique) == 20 - count
    assert clique.adjacency == incremental(rest).adjacency
    assert clique.is_verified()
    assert len(bits(clique.clique)) >= len(kept)


def test_when_the_largest_set_is_forgotten_the_next_one_takes_its_place() -> None:
    graph = nx.disjoint_union(nx.complete_graph(6), nx.complete_graph(4))
    clique = incremental(graph)
    clique.drop_oldest(2)
    assert bits(clique.clique) == [0, 1, 2, 3]
    clique.drop_oldest(1)
    assert bits(clique.clique) == [3, 4, 5, 6]


def test_new_vertices_find_their_neighbours_after_forgetting() -> None:
    clique = incremental(nx.complete_graph(6))
    clique.drop_oldest(4)
    clique.add(0b11)
    assert bits(clique.clique) == [0, 1, 2]


def test_the_runner_up_may_be_asked_for_among_some_only() -> None:
    """Cliques of four, three and two vertices."""
    graph = nx.disjoint_union_all(
        [nx.complete_graph(4), nx.complete_graph(3), nx.complete_graph(2)]
    )
    clique = incremental(graph)
    assert bits(clique.runner_up()) == [4, 5, 6]
    assert bits(clique.runner_up(allowed=0b111000011)) == [7, 8]
    assert bits(clique.runner_up(allowed=0b000001111)) == []
