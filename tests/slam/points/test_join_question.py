"""How two robots lie to each other by what stands between them."""

from __future__ import annotations

import numpy as np
import pytest
from joining_scene import COUNT, NODES, A, B, graph_of, paths
from passing_scene import SENSORS
from slam_scenes import angle_between, inverted, product, range_item

from drslamd.conventions import Chain, Segment, node_chain
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.points.join_question import FEWEST, join_question, points_told
from drslamd.slam.points.joining import Joined


def joined(graph: PoseGraph) -> Joined | str:
    question = join_question(graph, A, B, SENSORS)
    assert question is not None
    return question.answer()


@pytest.mark.parametrize(("things", "mutual", "least"), [(2, 0, 1), (1, COUNT, 4), (2, COUNT, 5)])
def test_two_things_or_one_and_ranges_say_how_robots_lie(
    things: int, mutual: int, least: int
) -> None:
    """Nothing is said where that is vague, and what is said is right."""
    named = 0
    for seed in range(1, 11):
        found = joined(graph_of(seed, list(NODES)[:things], mutual))
        if isinstance(found, str):
            assert found == "ambiguous" or "not enough" in found or "known to both" in found
            continue
        named += 1
        a, b = paths(seed)
        true = product(inverted(a[-1]), b[-1])
        assert np.hypot(*(found.a_T_b - true)[:2]) < 0.3
        assert abs(angle_between(found.a_T_b[2], true[2])) < 0.1
        assert (found.a_n, found.b_n) == (10 * COUNT - 10, 1000 + 10 * COUNT - 10)
    assert named >= least


@pytest.mark.parametrize("mutual", [0, FEWEST - 1])
def test_one_thing_alone_is_not_enough(mutual: int) -> None:
    assert "not enough" in str(joined(graph_of(5, list(NODES)[:1], mutual)))


def test_nothing_in_common_joins_nobody() -> None:
    assert "known to both" in str(joined(graph_of(5, [], COUNT)))


def test_a_thing_that_was_moved_between_them_does_not_fit() -> None:
    graph = graph_of(5, list(NODES), 0)
    there = NODES[node_chain(8)]
    path = paths(5)[1]
    metres = np.hypot(*(path[:, :2] - there - [-2.0, 1.4]).T)
    moved = [range_item(1000 + 10 * k, node_chain(8), 0, float(r)) for k, r in enumerate(metres)]
    pair = graph.pairs.pop((B.robot, node_chain(8).robot))
    assert len(pair.ranges) == COUNT
    told = tuple(pair.kept_closures())
    graph.insert(B, GraphEntry(2, None, (), tuple(moved), told))
    assert joined(graph) == "they do not fit each other"


def test_a_robot_without_a_log_has_no_side() -> None:
    graph = graph_of(5, list(NODES), 0)
    assert join_question(graph, A, Chain(5, 1), SENSORS) is None
    assert points_told(graph, A) == {Segment(*node, 0) for node in NODES}
