"""The pose of now: the last solved one and the way since, with the noise of both."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import EXACT, NOISE, Array, product, same_pose, wander

from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import Learned, PoseNow, TeamEstimate, Trajectory
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.pose_now import carried, pose_now

SOLVED = np.array([5.0, -3.0, 2.0])
KNOWN = np.array([[0.04, 0.01, 0.004], [0.01, 0.09, -0.006], [0.004, -0.006, 0.0025]])
PATH = wander(np.random.default_rng(1), 40, 0.1)
FIRST, LAST = 500, 510
"""Sample at which the track begins, and that of the last solved keyframe."""


def track_of(path: Array, skipped: tuple[int, ...] = ()) -> Track:
    track = Track(1000)
    for k, pose in enumerate(path):
        if k not in skipped:
            track.append(FIRST + k, np.round(pose / RESOLUTION))
    return track


def estimate(last: int = LAST) -> TeamEstimate:
    """Robots 4 and 7; of both something is claimed."""
    n = np.array([last - 10, last])
    of_4 = Trajectory(Chain(4, 1), n, np.stack([np.zeros(3), SOLVED]))
    of_7 = Trajectory(Chain(7, 1), n, np.ones((2, 3)))
    joint = np.zeros((6, 6))
    joint[:3, :3], joint[3:, 3:] = np.eye(3), KNOWN
    return TeamEstimate(Segment(4, 1, 0), {7: of_7, 4: of_4}, joint)


def known(noise: OdometryNoise = NOISE, team: TeamEstimate | None = None) -> PoseNow:
    found = pose_now(team or estimate(), 4, track_of(PATH), noise)
    assert found is not None
    return found


# where


def test_it_is_the_last_solved_pose_and_the_way_of_the_track_since_then() -> None:
    found = known()
    way = product(se2.inverse(PATH[10]), PATH[-1])
    assert same_pose(found.pose, product(SOLVED, way), 1e-3)
    assert found.utime == (FIRST + 39) * GRID_US


def test_its_angle_is_wrapped() -> None:
    spot = np.zeros((12, 3))
    spot[11, 2] = 2.0
    found = pose_now(estimate(), 4, track_of(spot), NOISE)
    assert found is not None
    assert found.pose[2] == pytest.approx(4.0 - 2 * math.pi, abs=1e-3)


def test_what_was_learned_of_the_wheels_is_taken_out_of_the_way() -> None:
    """A metre ahead and a turn of a radian on the spot, which were 0.8 m and 1.5 rad."""
    path = np.zeros((13, 3))
    path[11:, 0], path[12, 2] = 1.0, 1.0
    team = replace(estimate(), scale={4: Learned(0.2, 0.01)}, turn={4: Learned(0.5, 0.1)})
    found = pose_now(team, 4, track_of(path), NOISE)
    assert found is not None
    assert same_pose(found.pose, product(SOLVED, (0.8, 0.0, 1.5)), 1e-3)
    others = replace(estimate(), scale={7: Learned(0.2, 0.01)}, turn={7: Learned(0.5, 0.1)})
    found = pose_now(others, 4, track_of(path), NOISE)
    assert found is not None
    assert same_pose(found.pose, product(SOLVED, (1.0, 0.0, 1.0)), 1e-3)


@pytest.mark.parametrize(("robot", "claimed"), [(7, True), (4, True), (5, False)])
def test_of_a_robot_that_was_not_solved_nothing_is_known(robot: int, claimed: bool) -> None:
    assert (pose_now(estimate(), robot, track_of(PATH), NOISE) is not None) is claimed


def test_without_covariance_keyframes_or_track_there_is_no_pose() -> None:
    team, track = estimate(), track_of(PATH)
    assert pose_now(replace(team, joint=np.zeros((3, 3))), 4, track, NOISE) is None
    none = replace(team.trajectories[4], n=np.zeros(0), poses=np.zeros((0, 3)))
    assert pose_now(replace(team, trajectories={4: none}), 4, track, NOISE) is None
    assert pose_now(team, 4, Track(10), NOISE) is None


@pytest.mark.parametrize(
    ("last", "is_led"),
    [(FIRST - 1, False), (FIRST, True), (FIRST + 39, True), (FIRST + 40, False)],
)
def test_a_track_leads_from_keyframes_that_it_has(last: int, is_led: bool) -> None:
    assert (pose_now(estimate(last), 4, track_of(PATH), NOISE) is not None) is is_led


@pytest.mark.parametrize(("hole", "is_led"), [(9, True), (11, False), (30, False)])
def test_across_a_hole_the_way_is_not_known(hole: int, is_led: bool) -> None:
    found = pose_now(estimate(), 4, track_of(PATH, (hole,)), NOISE)
    assert (found is not None) is is_led


# how sure


def test_who_stands_is_as_sure_as_the_solution() -> None:
    still = pose_now(estimate(), 4, track_of(np.tile(PATH[10], (30, 1))), NOISE)
    assert still is not None
    assert np.allclose(still.covariance, KNOWN, rtol=0, atol=1e-15)


def test_an_exact_way_turns_what_was_not_known_of_the_heading_into_place() -> None:
    """By derivatives of where it ends, taken by differences."""
    found = known(EXACT)
    way, h = product(se2.inverse(PATH[10]), PATH[-1]), 1e-6
    columns = [
        (product(SOLVED + h * unit, way) - product(SOLVED - h * unit, way)) / (2 * h)
        for unit in np.eye(3)
    ]
    j = np.stack(columns, axis=1)
    assert np.allclose(found.covariance, j @ KNOWN @ j.T, rtol=1e-3, atol=1e-6)


def noisy_ends(drives: int) -> Array:
    """(drives, 3) errors at the end, of drives that begin wrong and with wheels that are wrong."""
    rng = np.random.default_rng(2)
    poses = SOLVED + rng.multivariate_normal(np.zeros(3), KNOWN / 25, drives)
    step = se2.between(PATH[10:-1], PATH[11:])
    scale = 1 + rng.normal(0, NOISE.scale, drives)
    yaw = rng.normal(0, NOISE.yaw_rad_per_m, drives)
    for x, y, theta in step:
        length = math.hypot(x, y)
        turn = yaw * length + rng.normal(0, NOISE.yaw_rad_per_sqrt_m * math.sqrt(length), drives)
        shift = rng.normal(0, NOISE.translation_per_sqrt_m * math.sqrt(length), (drives, 2))
        half = np.column_stack([np.zeros((drives, 2)), turn / 2])
        move = np.column_stack([scale[:, None] * [x, y] + shift, np.full(drives, theta)])
        for part in (half, move, half):
            poses = se2.compose(poses, part)
    true = product(SOLVED, product(se2.inverse(PATH[10]), PATH[-1]))
    error = poses - true
    error[:, 2] = se2.wrap(error[:, 2])
    return np.asarray(error)


def test_it_is_as_unsure_as_noisy_drives_from_the_solution_are_wrong() -> None:
    """3 m of curves, from a pose that is known to some centimetres."""
    way = se2.between(PATH[10:11], PATH[10:])
    found = carried(KNOWN / 25, SOLVED[2], way, NOISE, 1.0)
    error = noisy_ends(20_000)
    seen = error.T @ error / len(error)
    sigma = np.sqrt(np.diag(found))
    assert np.abs((seen - found) / np.outer(sigma, sigma)).max() < 0.04
    # neither the solution nor the way alone is enough
    for alone in (carried(KNOWN / 25, SOLVED[2], way, EXACT, 1.0), found * 0):
        assert np.abs((seen - alone) / np.outer(sigma, sigma)).max() > 0.15


def test_odometry_that_is_believed_less_adds_so_much_more() -> None:
    level = replace(estimate(), odometry_level={4: 3.0})
    still, usual, worse = known(EXACT), known(), known(team=level)
    added = usual.covariance - still.covariance
    assert np.allclose(worse.covariance - still.covariance, 9 * added, rtol=1e-6, atol=1e-9)
    assert np.linalg.eigvalsh(added)[0] > 0
    assert np.array_equal(worse.pose, usual.pose)
    others = known(team=replace(estimate(), odometry_level={7: 3.0}))
    assert np.array_equal(others.covariance, usual.covariance)


def test_a_scale_that_was_learned_adds_what_is_left_of_it() -> None:
    team = replace(estimate(), scale={4: Learned(0.0, 1e-9)})
    wide = replace(NOISE, scale=0.2)
    assert np.allclose(known(wide, team).covariance, known(replace(NOISE, scale=0.01)).covariance)
    assert known(wide).covariance[0, 0] > known(wide, team).covariance[0, 0] + 0.01


def test_a_point_that_begins_to_drive_may_be_anywhere_on_a_circle() -> None:
    """It is said to be where it stood, as uncertain as it is far from there."""
    stood = known(team=replace(estimate(), points=frozenset([4])))
    assert stood.pose == pytest.approx(SOLVED)
    aside = math.dist(PATH[10][:2], PATH[-1][:2])
    assert stood.covariance - KNOWN == pytest.approx(np.diag([aside**2, aside**2, 0.0]), abs=1e-3)


def test_a_way_whose_heading_a_gyro_gave_is_as_uncertain_as_the_gyro() -> None:
    """A metre ahead in a second: 0.01 rad/sqrt(s), and 0.002 rad/s besides."""
    path = np.zeros((21, 3))
    path[10:, 0] = np.linspace(0, 1, 11)
    gyro = GyroNoise(0.01, 0.002, FIRST + 5)
    team = replace(estimate(), joint=np.zeros((6, 6)))
    found = pose_now(team, 4, track_of(path), replace(EXACT, gyro=gyro))
    assert found is not None
    assert found.covariance[2, 2] == pytest.approx(0.01**2 + 0.002**2, rel=1e-6)
    late = replace(gyro, since=FIRST + 15)
    found = pose_now(team, 4, track_of(path), replace(EXACT, gyro=late))
    assert found is not None
    assert found.covariance[2, 2] == pytest.approx(0.01**2 / 2 + 0.001**2, rel=1e-6)


def test_of_a_robot_whose_wheels_tell_the_mirror_image_the_image_says_where_it_goes() -> None:
    """And nothing is claimed of its heading, for it may stand the other way round."""
    odd = replace(
        estimate(), points=frozenset([4]), mirrored={4: 0.0025}, turn={4: Learned(-2.0, 0.1)}
    )
    found, twin = known(team=odd), PATH * [1, -1, -1]
    way = product(se2.inverse(twin[10]), twin[-1])
    assert same_pose(found.pose, product(SOLVED, way), 1e-3)
    assert found.covariance[2, 2] == NO_HEADING
    assert not found.covariance[:2, 2].any()
    right = pose_now(estimate(), 4, track_of(twin), NOISE)
    assert right is not None
    apart = right.covariance[:2, :2] - found.covariance[:2, :2]
    # what place and heading have in common is not known of it
    assert np.abs(apart).max() < 0.05
