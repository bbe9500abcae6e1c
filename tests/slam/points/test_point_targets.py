"""What is heard and may stand."""

from __future__ import annotations

import pytest
from slam_scenes import NOISE, keyframes, model_of

from drslamd.conventions import GRID_US, SECOND_US, Chain, Segment, node_chain
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.odometry.track import Track
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.points.point_targets import STANDS_US, point_targets
from drslamd.slam.points.point_tracker import Target

ROBOT, UWB_ID = Chain(5, 1), 50
AHEAD_US = 3 * SECOND_US
SAID_US = 100 * GRID_US - AHEAD_US
"""When, on our clock, it was at its keyframe 100."""


def targets(
    after_us: int = STANDS_US,
    has_log: bool = True,
    estimate: TeamEstimate | None = None,
    ahead_us: int | None = AHEAD_US,
) -> dict[int, Target]:
    graph = PoseGraph()
    if has_log:
        entry = GraphEntry(0, model_of(NOISE, (0.3, 0.4)), keyframes([100], [(0, 0, 0)]))
        graph.insert(ROBOT, entry)
    peer = PeerInRange(ROBOT, UWB_ID, True, Track(10), ahead_us)
    carrier = {UWB_ID: ROBOT.robot}.get
    return point_targets([UWB_ID, 9], [peer], carrier, graph, estimate, SAID_US + after_us)


@pytest.mark.parametrize(("after_us", "stands"), [(STANDS_US - 1, False), (STANDS_US, True)])
def test_a_robot_without_a_keyframe_for_some_seconds_stands(after_us: int, stands: bool) -> None:
    found = targets(after_us)
    assert found[9] == Target(node_chain(9))
    assert found.get(UWB_ID) == (Target(ROBOT, 100, SAID_US, 0.5) if stands else None)


def test_a_robot_that_has_said_nothing_of_its_wheels_is_a_module() -> None:
    assert targets(has_log=False)[UWB_ID] == Target(node_chain(UWB_ID))


def test_without_its_clock_nobody_knows_since_when_a_robot_stands() -> None:
    assert UWB_ID not in targets(ahead_us=None)


@pytest.mark.parametrize("is_point", [True, False])
def test_who_has_a_pose_needs_no_place(is_point: bool) -> None:
    points = frozenset([ROBOT.robot] if is_point else [])
    nobody = Trajectory(ROBOT, keyframes([], []), keyframes([], []))  # type: ignore[arg-type]
    estimate = TeamEstimate(Segment(0, 1, 0), {ROBOT.robot: nobody}, points=points)
    assert (UWB_ID in targets(estimate=estimate)) is is_point
