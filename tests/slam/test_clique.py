"""The largest consistent set, against networkx on small graphs."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.slam.clique import IncrementalClique, bits, greedy, is_clique


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
            assert is_clique(clique.adjacency, clique.clique)
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


@given(st.integers(0, 10_000), st.integers(1, 20), st.sampled_from([0.3, 0.6, 0.9]))
@settings(max_examples=60)
def test_a_greedy_clique_holds_its_start_and_stays_inside(
    seed: int, n: int, density: float
) -> None:
    graph = random_graph(seed, n, density)
    adjacency = incremental(graph).adjacency
    allowed = np.random.default_rng(seed).integers(0, 1 << n)
    for start in range(n):
        kept = bits(greedy(adjacency, start, int(allowed)))
        assert start in kept
        assert all_joined(graph, kept)
        assert all(k == start or int(allowed) >> k & 1 for k in kept)


def test_the_same_graph_gives_the_same_clique() -> None:
    graph = random_graph(5, 40, 0.5)
    assert incremental(graph).clique == incremental(graph).clique
    # of equals the lowest numbers: two triangles that share nothing
    pair = nx.Graph([(0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (4, 5)])
    assert bits(incremental(pair).clique) == [0, 1, 2]


def test_a_set_with_a_missing_edge_is_no_clique() -> None:
    square = incremental(nx.cycle_graph(4))
    assert is_clique(square.adjacency, 0b0011)
    assert not is_clique(square.adjacency, 0b0111)
    assert is_clique(square.adjacency, 0)


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
    assert is_clique(clique.adjacency, clique.clique)
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
