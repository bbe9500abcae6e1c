"""Where a robot stands: what its parts say of its pose, put together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from message_builders import a_status
from robot_scenes import RobotScene

from drslamd.conditions.diagnosis import why_not_localised
from drslamd.conventions import SECOND_US, Chain
from drslamd.gossip.message_types import Heard, PoseState
from drslamd.slam.doubt import Doubt, Reason
from drslamd.slam.graph.estimate import MUCH_WORSE, Learned, PoseNow, Trajectory
from drslamd.slam.range_watch import RangeWatch
from drslamd.slam.relative_pose.estimate import Verdict
from drslamd.slam.relative_pose.mistakes.mounting_search import MOST
from drslamd.slam.revisions import ALLOWED
from drslamd.standing import Standing


def standing(scene: RobotScene) -> Standing:
    robot = scene.robot
    return Standing(scene.config, robot.team, robot.front, robot.back, robot.wheels.rhythm)


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


@pytest.mark.row("D9")
@pytest.mark.parametrize(("later_s", "state"), [(0.5, PoseState.LOCALISED), (0.6, PoseState.STALE)])
def test_with_wheels_that_speak_20_times_a_second_it_is_old_after_half_a_second(
    later_s: float, state: PoseState
) -> None:
    scene = driven()
    for k in range(200):
        scene.robot.wheels.rhythm.add(1, k * 50_000)
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


@pytest.mark.parametrize(
    ("moved_m", "boldness", "is_doubt"),
    [(0.3, 1.0, False), (0.5, 0.25 / 0.03 / ALLOWED, False), (0.8, 0.64 / 0.03 / ALLOWED, True)],
)
def test_a_pose_is_as_wide_as_solutions_moved_what_was_claimed_before(
    moved_m: float, boldness: float, is_doubt: bool
) -> None:
    """Solved with a sigma of 0.1 m, it was moved along x."""
    honest, bold = driven(), driven()
    estimate = bold.robot.back.estimate
    assert estimate is not None
    own = estimate.trajectories[0]
    moved = replace(own, poses=own.poses + [moved_m, 0.0, 0.0])
    bold.robot.back.on_solution(replace(estimate, trajectories={0: moved}))
    expected, found = standing(honest).pose(), standing(bold).pose()
    assert expected is not None
    assert found is not None
    assert found.covariance == pytest.approx(boldness * expected.covariance)
    assert standing(bold).is_doubted()[0] is is_doubt
    where = standing(bold).whereabouts(bold.utime)
    assert where.doubt == (Doubt(0, Reason.REVISIONS) if is_doubt else None)
    assert where.pose is not None
    assert where.pose.covariance == pytest.approx(found.covariance)


def test_ranges_that_are_off_widen_where_it_is_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = driven()
    pose = standing(scene).pose()
    assert pose is not None
    monkeypatch.setattr(RangeWatch, "gap_m", 0.7)
    where = standing(scene).whereabouts(scene.utime)
    assert where.state is PoseState.LOCALISED
    assert where.pose is not None
    wider = pose.covariance + np.diag([0.49, 0.49, 0.0])
    assert where.pose.covariance == pytest.approx(wider)


@pytest.mark.parametrize("is_solved", [True, False])
@pytest.mark.parametrize("windows", [MOST - 1, MOST])
def test_windows_with_robots_of_the_solution_are_a_witness(windows: int, is_solved: bool) -> None:
    scene = driven()
    estimate = scene.robot.back.estimate
    assert estimate is not None
    peer = Trajectory(Chain(4, 1), np.array([1_000]), np.zeros((1, 3)))
    trajectories = {**estimate.trajectories, 4: peer}
    both = replace(estimate, trajectories=trajectories, joint=0.01 * np.eye(6))
    scene.robot.back.on_solution(both if is_solved else estimate)
    pair = scene.own_pair(4)
    for _ in range(windows):
        pair.search.on_verdict(Verdict.POOR_FIT)
    is_doubt = is_solved and windows == MOST
    expected = Doubt(0, Reason.WINDOWS, (4,)) if is_doubt else None
    assert standing(scene).whereabouts(scene.utime).doubt == expected
    assert standing(scene).is_doubted() == (is_doubt, is_doubt)


def test_a_robot_whose_id_another_uses_has_no_pose() -> None:
    scene = driven()
    other = a_status((Heard(0, 1, 0),))
    assert standing(scene).whereabouts(scene.utime).state is PoseState.LOCALISED
    for _ in range(2):
        scene.later(1)
        scene.hear(0, other, epoch=7)
    found = standing(scene).whereabouts(scene.utime)
    assert (found.state, found.pose) == (PoseState.NOT_LOCALISED, None)
    assert "another robot uses the id" in str(why_not_localised(scene.robot, scene.utime))


@pytest.mark.parametrize(
    ("degrees", "is_told", "state"),
    [
        (39.0, True, PoseState.LOCALISED),
        (41.0, True, PoseState.NOT_LOCALISED),
        (41.0, False, PoseState.LOCALISED),
    ],
)
def test_who_was_just_placed_has_no_pose_before_its_heading_is_known(
    monkeypatch: pytest.MonkeyPatch, degrees: float, is_told: bool, state: PoseState
) -> None:
    scene = RobotScene()
    covariance = np.diag([0.1, 0.1, np.radians(degrees) ** 2])
    found = PoseNow(scene.utime, np.zeros(3), covariance)
    monkeypatch.setattr(scene.robot.standing, "pose", lambda: found)
    if is_told:
        scene.robot.front.resumption._told_at = scene.utime
    assert scene.robot.whereabouts(scene.utime).state is state


@pytest.mark.parametrize(("sigma_rad", "is_placed"), [(0.09, True), (0.11, False)])
def test_after_a_hole_the_pose_is_that_of_the_placing_or_of_module_3_whichever_turns_less(
    sigma_rad: float, is_placed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Module 3 knows the heading to a tenth of a radian, and what wheels add since."""
    scene = driven()
    found = standing(scene)
    solved = found.pose()
    assert solved is not None
    assert solved.covariance[2, 2] == pytest.approx(0.1**2, rel=0.02)
    placed = solved._replace(pose=np.ones(3), covariance=np.diag([0.1, 0.1, sigma_rad]) ** 2)
    monkeypatch.setattr(scene.robot.front.relocation, "placed", lambda estimate, track: placed)
    where = found.whereabouts(scene.utime)
    assert where.state is PoseState.LOCALISED
    assert where.pose is not None
    assert where.is_placed is is_placed
    assert bool((where.pose.pose == 1.0).all()) is is_placed
    later = found.whereabouts(scene.utime + 2 * SECOND_US)
    assert (later.state, later.is_placed) == (PoseState.STALE, False)
