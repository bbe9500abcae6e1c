"""The exact peers of module 2: they agree with each other and with what was planted."""

from __future__ import annotations

import importlib.util

import pytest
from lab.benchmark import module2

from drslamd.slam.consistency.incremental_clique import IncrementalClique

PLANTED = [(a, b) for a in range(2, 8) for b in range(a + 1, 8)]
"""Six that all agree, among ten."""
SOME = [(0, 1), (1, 2), (0, 2), (8, 9)]


@pytest.mark.parametrize("name", ["networkx", "igraph"])
def test_an_exact_peer_finds_the_planted_clique(name: str) -> None:
    if name == "igraph":
        pytest.importorskip("igraph", reason="igraph is not installed")
    finder = module2.exact_finders()[name]
    assert finder(10, PLANTED + SOME)() == 6
    assert finder(10, SOME)() == 3
    assert finder(10, [])() == 1


def grown(edges: list[tuple[int, int]], count: int) -> IncrementalClique:
    graph = IncrementalClique()
    for v in range(count):
        graph.add(sum(1 << a for a, b in edges if b == v))
    return graph


def test_our_share_is_of_the_exact_size_and_every_peer_has_its_time() -> None:
    finders = module2.exact_finders()
    share, taken = module2.beside_exact(grown(PLANTED + SOME, 10), finders)
    assert share == 1.0
    assert list(taken) == list(finders)
    assert all(ms >= 0 for ms in taken.values())


def test_peers_that_disagree_are_a_bug() -> None:
    wrong = {**module2.exact_finders(), "wrong": lambda count, edges: lambda: 7}
    with pytest.raises(AssertionError, match=r"cliques of \[6, 7\]"):
        module2.beside_exact(grown(PLANTED, 10), wrong)


def test_without_igraph_networkx_stands_alone_and_that_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert list(module2.exact_finders()) == ["networkx"]
    assert capsys.readouterr().err.count("\n") == 1
