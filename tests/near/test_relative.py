"""Of two robots together: against the Jacobian of both legs, worked out by differences."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from slam_scenes import NOISE, wander

from drslamd.conventions import Chain, Segment
from drslamd.near.leg import Leg
from drslamd.near.relative import FEW, relatives
from drslamd.slam import se2
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory

POSES = {4: np.array([1.0, 2.0, 0.5]), 9: np.array([-3.0, 4.0, -2.5]), 2: np.array([0.5, 0, 3.0])}
ROOT = np.random.default_rng(1).normal(0, 0.05, (9, 9))
TEAM = TeamEstimate(
    Segment(4, 1, 0),
    {r: Trajectory(Chain(r, 1), np.array([0]), pose[None]) for r, pose in POSES.items()},
    ROOT @ ROOT.T,
)
WAYS = {r: wander(np.random.default_rng(r), 30, 0.1) for r in POSES}


def leg_of(robot: int) -> Leg:
    leg = Leg.of(TEAM, robot, NOISE)
    leg.along(WAYS[robot])
    return leg


def seen(starts: np.ndarray, peer: int) -> np.ndarray:
    """a_T_b at the ends of both ways, of two start poses (6,)."""
    ends = [
        se2.compose(start, se2.between(WAYS[r][0], WAYS[r][-1]))
        for r, start in ((4, starts[:3]), (peer, starts[3:]))
    ]
    return se2.between(ends[0], ends[1])


def test_peers_are_where_both_ways_lead_as_sure_as_the_solution_is_of_both_together() -> None:
    own, legs = leg_of(4), {9: leg_of(9), 2: leg_of(2)}
    poses, covariance = relatives(TEAM, 4, own, legs).seen_from(own.end, own.added)
    for k, peer in enumerate(legs):
        starts = np.concatenate([POSES[4], POSES[peer]])
        expected = seen(starts, peer)
        assert np.allclose(poses[k, :2], expected[:2])
        assert abs(float(se2.wrap(poses[k, 2] - expected[2]))) < 1e-9
        nudge = 1e-6 * np.eye(6)
        j = np.array([(seen(starts + d, peer) - seen(starts - d, peer)) / 2e-6 for d in nudge]).T
        joint = TEAM.joint_of(4, peer)
        known = j @ joint @ j.T
        turn = np.eye(3)
        cos, sin = np.cos(own.end[2]), np.sin(own.end[2])
        turn[:2, :2] = [[cos, sin], [-sin, cos]]
        away = legs[peer].end[0] - own.end[0], legs[peer].end[1] - own.end[1]
        lever = turn @ np.array([[1, 0, -away[1]], [0, 1, away[0]], [0, 0, 1]])
        known += lever @ se2.unpacked(own.added) @ lever.T
        known += turn @ se2.unpacked(legs[peer].added) @ turn.T
        assert np.allclose(covariance[:, k], se2.packed(known), atol=1e-8)


def test_a_pair_that_solutions_moved_is_claimed_as_much_wider_and_no_other() -> None:
    own, legs = leg_of(4), {9: leg_of(9), 2: leg_of(2)}
    plain = relatives(TEAM, 4, own, legs).known
    moved = relatives(replace(TEAM, boldness={(4, 9): 5.0}), 4, own, legs).known
    known = np.array(legs[9].added)
    assert np.allclose(moved[:, 0] - known, 5.0 * (plain[:, 0] - known))
    assert np.array_equal(moved[:, 1], plain[:, 1])


def test_what_both_are_wrong_in_alike_is_no_error_of_one_seen_from_the_other() -> None:
    alike = np.tile(np.diag([4.0, 4.0, 0.0]), (3, 3))
    team = TeamEstimate(TEAM.frame, TEAM.trajectories, alike)
    own, peer = Leg.of(team, 4, NOISE), Leg.of(team, 9, NOISE)
    _, covariance = relatives(team, 4, own, {9: peer}).seen_from(own.end, own.added)
    assert np.abs(covariance).max() < 1e-12


def test_a_leg_is_as_unsure_of_its_length_as_what_was_learned_of_the_scale() -> None:
    wide, narrow = replace(NOISE, scale=0.2), replace(NOISE, scale=0.05)
    known = replace(TEAM, scale={4: Learned(0.0, math.sqrt(0.05**2 - 0.01**2))})
    found, expected = Leg.of(known, 4, wide), Leg.of(TEAM, 4, narrow)
    for leg in (found, expected):
        leg.along(WAYS[4])
    assert np.allclose(found.added, expected.added)


def test_nobody_is_seen_where_nobody_is_known() -> None:
    own = leg_of(4)
    poses, covariance = relatives(TEAM, 4, own, {}).seen_from(own.end, own.added)
    assert poses.shape == (0, 3)
    assert covariance.shape == (6, 0)


def test_few_peers_are_seen_as_many_are() -> None:
    """One by one in plain numbers, or all in rows of an array."""
    own, leg = leg_of(4), leg_of(9)
    few = relatives(TEAM, 4, own, {9: leg})
    many = replace(few, poses=np.tile(few.poses, (FEW + 1, 1)), known=np.tile(few.known, FEW + 1))
    for pose in (own.end, (1.0, -2.0, 30.0), (0.0, 0.0, -30.0)):
        one, sure = few.seen_from(pose, own.added)
        each, sures = many.seen_from(pose, own.added)
        assert (each == one).all()
        assert np.allclose(sures, sure, rtol=1e-12, atol=0)
        assert abs(one[0, 2]) <= np.pi


def test_a_pair_is_told_as_sure_as_it_was_seen_to_be_and_the_team_as_before() -> None:
    own, legs = leg_of(4), {9: leg_of(9), 2: leg_of(2)}
    narrow = replace(TEAM, narrower={(4, 9): 0.3})
    plain, known = (relatives(team, 4, own, legs).known for team in (TEAM, narrow))
    added = np.array(legs[9].added)
    assert np.allclose(known[:, 0] - added, 0.3 * (plain[:, 0] - added))
    assert np.array_equal(known[:, 1], plain[:, 1])
    assert np.array_equal(narrow.relatives([(4, 9)])[2], TEAM.relatives([(4, 9)])[2])
