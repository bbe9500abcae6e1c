"""Whose odometry is the mirror image of its way: to whom such a robot belongs, and as what."""

from __future__ import annotations

from dataclasses import replace

import pytest
from slam_scenes import NOISE, closure, keyframes, model_of, product

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry
from drslamd.slam.graph.mirror_images import with_mirrored
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group, placed
from drslamd.slam.optimizer import factors

A, B, C, D = (Chain(robot, 1) for robot in range(4))
NUMBERS = range(0, 100, 10)
POSE = (3.0, 1.0, 0.5)


def first(*chains: Chain) -> set[Segment]:
    return {Segment(*chain, 0) for chain in chains}


def plain(peer: Chain, number: int = 0) -> ClosureMeasurement:
    return closure(number, 0, peer, 0, POSE)


def odd(peer: Chain, number: int = 0) -> ClosureMeasurement:
    """One of both turns the other way."""
    return replace(plain(peer, number), corrected=(0.0, 0.0, 0.0, -2.0))


def graph_of(*told: tuple[Chain, ClosureMeasurement]) -> PoseGraph:
    graph = PoseGraph()
    for chain in (A, B, C, D):
        way = [(n / 20, 0.0, 0.0) for n in NUMBERS]
        graph.insert(chain, GraphEntry(0, model_of(NOISE), keyframes(NUMBERS, way)))
    for k, (chain, item) in enumerate(told):
        graph.insert(chain, GraphEntry(k + 1, closures=(item,)))
    return graph


def seen_by(chain: Chain, graph: PoseGraph) -> tuple[set[Segment], set[Segment]]:
    """Members and mirrored ones."""
    (current,) = first(chain)
    known = team_frame.group_of(current, graph, looks_back=True)
    members, mirrored = with_mirrored(current, known, graph)
    return members, set(mirrored)


def test_it_is_in_the_group_of_those_who_agree_and_everybody_finds_the_same() -> None:
    graph = graph_of((A, plain(B)), (A, odd(C, 1)), (B, odd(C)))
    assert all(seen_by(robot, graph) == (first(A, B), first(C)) for robot in (A, B, C))
    assert team_frame.groups(graph) == [first(A, B)]


def test_the_lowest_robot_of_a_team_may_be_the_one() -> None:
    """Its own closures say that one of two is; those of the others, which."""
    graph = graph_of((A, odd(B)), (A, odd(C, 1)), (B, plain(C)))
    assert all(seen_by(robot, graph) == (first(B, C), first(A)) for robot in (A, B, C))


def test_of_two_nobody_knows_which() -> None:
    graph = graph_of((A, odd(B)))
    assert seen_by(A, graph) == seen_by(B, graph) == (set(), set())


def test_of_two_pairs_nobody_knows_which() -> None:
    graph = graph_of((A, plain(B)), (C, plain(D)), (A, odd(C, 1)), (B, odd(D)))
    assert seen_by(A, graph) == (first(A, B), set())
    assert seen_by(D, graph) == (first(C, D), set())


def test_who_agrees_with_one_of_a_group_is_of_it_whatever_another_says() -> None:
    graph = graph_of((A, plain(B)), (A, plain(C, 1)), (B, odd(C)))
    assert seen_by(C, graph) == (first(A, B, C), set())


def test_a_start_that_was_placed_once_is_not_mirrored_in_what_it_drove_later() -> None:
    graph = graph_of((A, plain(B)), (A, plain(C, 1)))
    graph.insert(C, GraphEntry(9, keyframes=keyframes([200], [(9.0, 0.0, 0.0)], segment=1)))
    later = replace(odd(C, 2), a_n=90, b_n=200)
    graph.insert(A, GraphEntry(9, closures=(later,)))
    assert seen_by(A, graph) == (first(A, B, C), set())


def test_it_joins_nobody_to_anybody_else() -> None:
    graph = graph_of((A, plain(B)), (A, odd(C, 1)), (C, plain(D)))
    assert seen_by(A, graph) == (first(A, B), set())
    assert seen_by(D, graph) == (first(C, D), set())


def test_a_closure_that_says_so_of_two_who_agree_with_others_places_nobody() -> None:
    """A knows C by its own closure alone, and that is of the mirror image."""
    graph = graph_of((A, plain(B)), (A, odd(C, 1)), (B, plain(C)))
    group = Group(first(A, B, C), min(first(A)))
    place = placed(graph, group, None)[min(first(C))][0]
    assert place == pytest.approx(product(POSE, POSE))
    odd_group = Group(first(A, B), min(first(A)), mirrored=frozenset(first(C)))
    assert placed(graph, odd_group, None)[min(first(C))][0] == pytest.approx(POSE)
    assert len(factors.closures(graph, factors.numbering(graph, first(A, B, C)))) == 2
