"""Where a robot stands: what its parts say of its pose, put together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from robot_scenes import RobotScene

from drslamd.conventions import SECOND_US
from drslamd.gossip.message_types import PoseState
from drslamd.slam.doubt import MUCH_WORSE, Doubt, Reason
from drslamd.slam.graph.estimate import Learned
from drslamd.standing import Standing


def standing(scene: RobotScene) -> Standing:
    robot = scene.robot
    return Standing(scene.config, robot.own, robot.front, robot.back)


def driven(level: float = 1.0, contradicted: tuple[tuple[int, int], ...] = ()) -> RobotScene:
    """Robot 0 drove half a metre, and half a metre more since it was solved."""
    scene = RobotScene()
    scene.drive(2)
    n = scene.robot.front.reckoning.track.end - 1 - 10
    estimate = replace(
        scene.localise((2.0, 3.0, np.pi / 2), 0.01 * np.eye(3), n=n),
        late_level={0: level},
        bias_m={pair: Learned(0.0, 0.1) for pair in ((0, 4), (0, 7), (4, 7))},
        contradicted=frozenset(contradicted),
    )
    scene.robot.back.on_solution(estimate)
    return scene


def test_without_a_solution_there_is_no_pose() -> None:
    scene = RobotScene()
    scene.drive(2)
    found = standing(scene)
    assert found.pose() is None
    assert found.whereabouts(scene.utime).state is PoseState.NOT_LOCALISED
    assert found.is_doubted() == (False, False)


def test_the_pose_is_the_last_solved_one_carried_on_by_odometry() -> None:
    scene = driven()
    now = standing(scene).pose()
    assert now is not None
    assert now.pose == pytest.approx([2.0, 3.5, np.pi / 2], abs=1e-4)
    assert now.utime == scene.utime
    where = standing(scene).whereabouts(scene.utime)
    assert where.state is PoseState.LOCALISED
    assert where.pose is not None
    # the way has noise of its own, as the robot's odometry is configured
    assert where.pose.covariance[0, 0] > 0.01


@pytest.mark.parametrize(("later_s", "state"), [(1.0, PoseState.LOCALISED), (1.1, PoseState.STALE)])
def test_it_grows_old_with_the_odometry(later_s: float, state: PoseState) -> None:
    scene = driven()
    assert standing(scene).whereabouts(scene.utime + round(later_s * SECOND_US)).state is state


def test_who_has_not_driven_may_be_as_fast_as_its_wheels_can_be() -> None:
    scene = RobotScene(extra="max_speed_mps = 2.0\n")
    scene.drive(3, metres=0.0)
    scene.localise((0.0, 0.0, 0.0), 1e-6 * np.eye(3))
    where = standing(scene).whereabouts(scene.utime + 3 * SECOND_US)
    assert where.state is PoseState.STALE
    assert where.pose is not None
    assert np.sqrt(where.pose.covariance[0, 0]) == pytest.approx(6.0, rel=1e-3)


@pytest.mark.parametrize(
    ("scene", "doubted", "doubt"),
    [
        (driven(), (False, False), None),
        (driven(MUCH_WORSE), (True, True), Doubt(0, Reason.ODOMETRY, level=MUCH_WORSE)),
        (driven(1.0, ((0, 4),)), (False, True), None),
        (driven(1.0, ((4, 7),)), (False, False), None),
        (driven(1.0, ((0, 4), (0, 7))), (True, True), Doubt(0, Reason.RANGES, (4, 7))),
    ],
    ids=["nothing", "odometry", "a partner", "others", "all partners"],
)
def test_doubt_is_of_ourselves_or_of_anybody_we_range(
    scene: RobotScene, doubted: tuple[bool, bool], doubt: Doubt | None
) -> None:
    found = standing(scene)
    assert found.is_doubted() == doubted
    assert found.whereabouts(scene.utime).doubt == doubt


@pytest.mark.parametrize("seconds", [1, 2])
def test_ranges_of_this_second_are_a_witness_too(seconds: int) -> None:
    scene = driven()
    scene.robot.front.watch.off = {4: seconds}
    is_doubt = seconds == 2
    assert standing(scene).is_doubted() == (is_doubt, is_doubt)
    scene.robot.front.watch.off = {4: seconds, 7: 0}
    assert standing(scene).is_doubted() == (False, is_doubt)
