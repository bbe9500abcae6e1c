"""Where a robot is by its placing alone, and how well that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relocation.placed_pose import PlacedPose, covariance_by_peers, placed_pose
from drslamd.slam.relocation.placing import Placed, Prior, WayUnder, place
from drslamd.slam.relocation.question import Found
from drslamd.slam.relocation.sightings import NONE, Sightings

ROBOT, START = 4, 100
EXACT = OdometryNoise(0.0, 0.0, 0.0, 0.0)
W_T_O = np.array([4.0, -1.0, 2.2])
LAST = {0: np.array([-1.0, 0.5, 0.4]), 1: np.array([6.0, 4.0, -2.0])}
"""Where peers were solved last; both have driven on since."""
PLACES = np.array([[0.0, 0.0], [6.0, 5.0]])


def team(claimed: int = 2) -> TeamEstimate:
    ends = {k: Trajectory(Chain(k, 1), np.array([5]), pose[None]) for k, pose in LAST.items()}
    root = np.random.default_rng(5).normal(size=(6, 6)) * [0.1, 0.1, 0.05, 0.1, 0.1, 0.05]
    joint = (root.T @ root)[: 3 * claimed, : 3 * claimed]
    return TeamEstimate(Segment(0, 1, 0), ends, joint)


def seen_on_a_bend() -> tuple[Sightings, WayUnder]:
    """Three metres of a quarter of a circle, ten sightings of either peer."""
    along = np.linspace(0, 1, 20)
    radius = 6.0 / np.pi
    q = radius * np.stack([np.sin(along * np.pi / 2), 1 - np.cos(along * np.pi / 2)], axis=-1)
    peer = np.arange(20) % 2
    metres = np.hypot(*(se2.transform(W_T_O, q) - PLACES[peer]).T)
    wide = np.full(20, 0.05)
    seen = Sightings(along * 6e6 + START * GRID_US, PLACES[peer], metres, wide, wide, peer)
    return seen, WayUnder(q, q[0], along * 3.0, OdometryNoise(0.01, 0.001, 0.01, 0.01))


def answer(seen: Sightings, stretch: WayUnder) -> Placed:
    found = place(seen, stretch, Prior(W_T_O[:2], 100.0 * np.eye(2), 3.0), LINKTRACK)
    assert isinstance(found, Placed)
    return found


def test_what_peers_are_wrong_by_moves_the_placing_as_much_as_placing_it_again_says() -> None:
    """Each peer is shifted and turned about its last solved pose, and the question asked anew."""
    seen, stretch = seen_on_a_bend()
    placed = answer(seen, stretch)
    columns = []
    for peer in LAST:
        for axis in range(3):
            ends = []
            for step in (1e-4, -1e-4):
                moved = np.zeros(3)
                moved[axis] = step
                local = se2.transform(se2.inverse(LAST[peer]), seen.place)
                there = np.append(LAST[peer][:2] + moved[:2], LAST[peer][2] + moved[2])
                mine = (seen.peer == peer)[:, None]
                elsewhere = np.where(mine, se2.transform(there, local), seen.place)
                again = answer(replace(seen, place=elsewhere), stretch).w_T_o
                ends.append(np.append(se2.transform(again, placed.at), again[2]))
            columns.append((ends[0] - ends[1]) / 2e-4)
    by_asking = np.stack(columns, axis=-1)
    expected = by_asking @ team().joint @ by_asking.T
    found = covariance_by_peers(placed.by_peers, seen, team())
    assert found == pytest.approx(expected, rel=0.03, abs=0.02 * float(np.abs(expected).max()))


@pytest.mark.parametrize(("claimed", "is_known"), [(2, True), (1, False)])
def test_who_was_placed_by_a_peer_of_which_nothing_is_claimed_has_no_such_pose(
    claimed: int, is_known: bool
) -> None:
    seen, stretch = seen_on_a_bend()
    placed = answer(seen, stretch)
    found = Found(team(claimed), START, (0, 1), placed, seen)
    pose = placed_pose(found, placed, a_track(60), ROBOT)
    assert (pose is not None) is is_known


def a_track(steps: int, start: int = START) -> Track:
    """Along x, a tenth of a metre each."""
    track = Track(1_000)
    for n in range(start, start + steps):
        track.append(n, np.round(np.array([0.1 * (n - START), 0.0, 0.0]) / RESOLUTION))
    return track


def test_the_place_is_known_best_under_the_middle_of_the_way_and_a_turn_moves_all_else() -> None:
    """Sightings of two seconds: the body was a metre along x then, where `at` is."""
    seen = replace(seen_on_a_bend()[0], utime=START * GRID_US + np.linspace(0, 2e6, 20))
    placed = Placed(
        np.array([1.0, 2.0, np.pi / 2]),
        np.diag([0.04, 0.01, 0.1**2]),
        np.array([1.0, 0.0]),
        np.zeros((3, 20, 2)),
    )
    found = Found(team(), START, (0, 1), placed, seen)
    pose = placed_pose(found, placed, a_track(31), ROBOT)
    assert pose is not None
    assert pose.n == START + 10
    now = pose.now(a_track(31), EXACT)
    assert now is not None
    assert now.utime == (START + 30) * GRID_US
    assert now.pose == pytest.approx([1.0, 5.0, np.pi / 2], abs=1e-6)
    # two metres on, along y of the team: a turn moves it along x
    assert now.covariance[0, 0] == pytest.approx(0.04 + (2 * 0.1) ** 2)
    assert now.covariance[1, 1] == pytest.approx(0.01)
    assert now.covariance[2, 2] == pytest.approx(0.1**2)


def test_odometry_that_was_interrupted_again_leads_nowhere() -> None:
    pose = PlacedPose(
        Found(team(), START, (0,), "", NONE), ROBOT, START + 5, np.zeros(3), np.eye(3)
    )
    assert pose.now(a_track(20), EXACT) is not None
    assert pose.now(a_track(20, START + 1), EXACT) is None
    assert pose.now(Track(1_000), EXACT) is None
