"""Which segments closures join, and how."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from slam_scenes import closure, keyframes

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.graph.thinning.joints import Joint, joints_of, only_segments

A, B = Chain(0, 1), Chain(1, 1)
ORIGIN = np.zeros(3)


def joints(*closures: ClosureMeasurement, break_at: int = 100) -> list[Joint]:
    """Between two robots with four keyframes each, those of b of two segments from a break on."""
    graph = PoseGraph()
    for k in range(4):
        for chain, segment in ((A, 0), (B, int(10 * k >= break_at))):
            frames = keyframes([10 * k], [ORIGIN], segment)
            graph.insert(chain, GraphEntry(k, keyframes=frames))
    graph.insert(A, GraphEntry(4, closures=closures))
    chains = graph.view.chains
    return joints_of(chains, only_segments(chains), graph.view.pairs)


def whole(number: int, n: int) -> ClosureMeasurement:
    return closure(number, n, B, n, ORIGIN)


def place(number: int, n: int) -> ClosureMeasurement:
    xx, xy, xt, yy, yt, _ = whole(number, n).covariance
    return replace(whole(number, n), covariance=(xx, xy, xt, yy, yt, NO_HEADING))


def test_closures_join_the_segments_of_their_keyframes() -> None:
    (one,) = joints(whole(0, 0), whole(1, 30))
    assert (one.a, one.b) == (Segment(*A, 0), Segment(*B, 0))
    assert one.closures.number.tolist() == [0, 1]
    first, second = joints(whole(0, 0), whole(1, 30), break_at=20)
    assert (first.b.segment, second.b.segment) == (0, 1)
    assert (first.closures.number.tolist(), second.closures.number.tolist()) == ([0], [1])
    assert joints() == []


def test_who_says_a_whole_pose_is_believed_before_who_says_but_a_place() -> None:
    (both,) = joints(place(0, 0), whole(1, 10))
    assert not both.tells_place_only
    assert both.closures.number.tolist() == [1]
    (one,) = joints(place(0, 0), place(1, 10))
    assert one.tells_place_only
    assert one.closures.number.tolist() == [0, 1]


def test_wheels_as_configured_are_believed_before_any_that_turn_the_other_way() -> None:
    """And these before a mere place."""
    odd = replace(whole(1, 10), corrected=(0.0, 0.0, 0.0, -2.0))
    (one,) = joints(place(0, 0), odd)
    assert (one.is_mirrored, one.tells_place_only) == (True, False)
    assert one.closures.number.tolist() == [1]
    (both,) = joints(whole(0, 0), odd, place(2, 20))
    assert (both.is_mirrored, both.tells_place_only) == (False, False)
    assert both.closures.number.tolist() == [0]
    wide = replace(whole(1, 10), corrected=(0.0, 0.3, 0.0, -0.5))
    (plain,) = joints(wide)
    assert not plain.is_mirrored
