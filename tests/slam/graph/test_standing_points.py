"""What stands and has a place and no heading: to whom it belongs, and what it is in the graph."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, closure, keyframes, model_of, range_item

from drslamd.conventions import Chain, Segment, is_node, node_chain
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry
from drslamd.slam.graph.pose_graph import MAX_NODES, MAX_PLACES, PoseGraph
from drslamd.slam.graph.standing_points import (
    SAME_PLACE_M,
    where_it_stands,
    with_points,
    without_headings,
)
from drslamd.slam.graph.tables import NO_HEADING

A, B, C = Chain(0, 1), Chain(1, 1), Chain(2, 1)
NODE = node_chain(77)
NUMBERS = range(0, 100, 10)


def first(chain: Chain) -> Segment:
    return Segment(*chain, 0)


def place_of(peer: Chain, b_n: int = 0, number: int = 0, kept: bool = True) -> ClosureMeasurement:
    """Somebody has found it."""
    told = closure(number, 0, peer, b_n, (3.0, 1.0, 0.0), kept=kept)
    return replace(told, covariance=(0.04, 0.0, 0.0, 0.04, 0.0, float(NO_HEADING)))


def graph_of(*told: tuple[Chain, ClosureMeasurement]) -> PoseGraph:
    graph = PoseGraph()
    for chain in (A, B, C):
        way = [(n / 20, 0.0, 0.0) for n in NUMBERS]
        graph.insert(chain, GraphEntry(0, model_of(NOISE), keyframes(NUMBERS, way)))
    for k, (chain, item) in enumerate(told):
        graph.insert(chain, GraphEntry(k + 1, closures=(item,)))
    return graph


def group_of(current: Chain, graph: PoseGraph) -> tuple[set[Segment], set[Segment]]:
    """Members and points."""
    known = team_frame.group_of(first(current), graph, looks_back=True)
    members, points = with_points(first(current), known, graph)
    return members, set(points)


def test_who_knows_a_place_is_a_group_with_it() -> None:
    graph = graph_of((A, place_of(NODE)))
    assert group_of(A, graph) == ({first(A)}, {first(NODE)})
    assert group_of(B, graph) == (set(), set())


def test_two_who_know_one_place_are_two_groups() -> None:
    graph = graph_of((A, place_of(NODE)), (B, place_of(NODE)))
    assert group_of(A, graph) == ({first(A)}, {first(NODE)})
    assert group_of(B, graph) == ({first(B)}, {first(NODE)})
    assert team_frame.groups(graph) == []


def test_a_point_belongs_to_all_who_are_joined_with_the_teller() -> None:
    graph = graph_of((A, closure(0, 0, B, 0, (1, 1, 1))), (B, place_of(NODE)))
    assert group_of(A, graph) == group_of(B, graph) == ({first(A), first(B)}, {first(NODE)})


def test_a_parked_robot_is_a_point_of_the_lowest_frame_that_knows_it() -> None:
    graph = graph_of((B, place_of(C)), (A, place_of(C)))
    assert group_of(C, graph) == ({first(A)}, {first(C)})


def test_who_has_a_heading_is_no_point() -> None:
    graph = graph_of((A, closure(0, 0, C, 0, (1, 1, 1))), (B, place_of(C)))
    assert group_of(A, graph) == ({first(A), first(C)}, set())
    assert group_of(B, graph) == (set(), set())


def test_a_place_that_is_withdrawn_is_gone() -> None:
    graph = graph_of((A, place_of(NODE)), (A, place_of(NODE, kept=False)))
    assert group_of(A, graph) == (set(), set())


def test_a_robot_stands_where_it_was_last_said_to() -> None:
    graph = PoseGraph()
    near = 4 + SAME_PLACE_M - 0.01
    far = 4 + SAME_PLACE_M + 0.01
    places = (0.0, far, 4.0, near, near, 6.0, 4.0)
    way = [(x, 0.0, float(k)) for k, x in enumerate(places)]
    graph.insert(A, GraphEntry(0, model_of(NOISE), keyframes([0], [(0, 0, 0)])))
    graph.insert(C, GraphEntry(0, model_of(NOISE), keyframes(range(7), way)))
    told = (place_of(C, 0), place_of(C, 2, number=1))
    graph.insert(A, GraphEntry(1, closures=told))
    assert np.flatnonzero(where_it_stands(graph, first(C))).tolist() == [2, 3, 4]


def test_each_place_of_a_module_is_a_keyframe_and_a_segment() -> None:
    graph = graph_of((A, place_of(NODE, 0)), (B, place_of(NODE, 4)))
    chain = graph.view.chains[NODE.robot]
    assert chain.keyframes.n.tolist() == chain.keyframes.segment.tolist() == [0, 4]
    assert where_it_stands(graph, Segment(*NODE, 4)).tolist() == [False, True]
    assert group_of(B, graph) == ({first(B)}, {Segment(*NODE, 4)})


def test_in_whatever_order_it_was_said_the_graph_is_the_same() -> None:
    told = [
        (A, GraphEntry(1, ranges=(range_item(10, NODE, 0, 3.0),))),
        (B, GraphEntry(1, ranges=(range_item(10, NODE, 1, 3.0),))),
        (B, GraphEntry(2, closures=(place_of(NODE, 1),))),
    ]
    digests = set()
    for order in (told, told[::-1]):
        graph = graph_of()
        for chain, entry in order:
            graph.insert(chain, entry)
        digests.add(graph.digest({0, 1, NODE.robot}))
    assert len(digests) == 1
    assert digests != {graph_of().digest({0, 1, NODE.robot})}


@pytest.mark.parametrize(("place", "is_held"), [(MAX_PLACES - 1, True), (MAX_PLACES, False)])
def test_a_module_stood_at_so_many_places_at_most(place: int, is_held: bool) -> None:
    graph = graph_of((A, place_of(NODE, place)))
    assert (NODE.robot in graph.nodes) is is_held


def test_so_many_modules_are_held_at_most() -> None:
    graph = graph_of(*((A, place_of(node_chain(k))) for k in range(MAX_NODES + 1)))
    assert len(graph.nodes) == MAX_NODES
    assert node_chain(MAX_NODES).robot not in graph.nodes


def test_modules_and_robots_have_different_numbers() -> None:
    assert is_node(node_chain(0).robot)
    assert not is_node(254)


def test_of_headings_of_points_nothing_is_claimed() -> None:
    joint = np.arange(36.0).reshape(6, 6)
    out = without_headings(joint, np.array([False, True]))
    assert out[5].tolist() == out[:, 5].tolist() == [0, 0, 0, 0, 0, NO_HEADING]
    assert np.array_equal(out[:5, :5], joint[:5, :5])
