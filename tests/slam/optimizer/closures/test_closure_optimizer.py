"""The paper's graph solved exactly, as one robot of a team runs it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from slam_scenes import (
    NOISE,
    Array,
    closure,
    driven,
    group_of,
    inverted,
    keyframes,
    model_of,
    product,
    small_team,
    wander,
)

from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer.closures.closure_optimizer import ClosureOptimizer
from drslamd.slam.optimizer.factors import chain_links

COUNT = 40


class Team:
    """Three robots whose wheels are a little wrong, with true closures between them."""

    def __init__(self, seed: int, sigma: float = 0.02) -> None:
        self.team = small_team(seed, count=COUNT)
        for b in (1, 2):
            for k in range(0, COUNT, 3):
                self.close(100 * b + k, b, k, self.true(b, k), sigma)

    def true(self, b: int, k: int) -> Array:
        """Pose of robot b in robot 0 at keyframe k."""
        return product(inverted(self.team.truth[0][k]), self.team.truth[b][k])

    def close(self, number: int, b: int, k: int, a_T_b: Array, sigma: float) -> None:
        n, chains = self.team.n, self.team.chains
        item = closure(number, int(n[0][k]), chains[b], int(n[b][k]), a_T_b, sigma)
        self.team.graph.insert(chains[0], GraphEntry(1000 + number, closures=(item,)))

    def solved(self, previous: TeamEstimate | None = None) -> TeamEstimate:
        graph: PoseGraph = self.team.graph
        job = ClosureOptimizer().job(graph, group_of(graph), previous, {})
        assert job is not None
        return job()

    def worst(self, estimate: TeamEstimate) -> float:
        """Largest distance from the truth, m, in the frame of robot 0's first pose."""
        origin = inverted(self.team.truth[0][0])
        off = [
            pose - product(origin, true)
            for robot, trajectory in estimate.trajectories.items()
            for pose, true in zip(trajectory.poses, self.team.truth[robot], strict=True)
        ]
        return float(np.hypot(*np.array(off)[:, :2].T).max())


def test_a_team_is_solved_in_the_frame_of_its_lowest_robot() -> None:
    team = Team(1)
    estimate = team.solved()
    assert estimate.converged
    assert set(estimate.trajectories) == {0, 1, 2}
    assert np.allclose(estimate.trajectories[0].poses[0], 0, atol=1e-9)
    assert team.worst(estimate) < 0.25


def test_from_the_last_estimate_it_is_the_same_and_sooner_there() -> None:
    team = Team(2)
    cold = team.solved()
    team.close(900, 1, 20, team.true(1, 20), 0.02)
    again, warm = team.solved(), team.solved(cold)
    assert warm.cost == pytest.approx(again.cost, rel=1e-6)
    assert warm.iterations < again.iterations
    for robot, trajectory in again.trajectories.items():
        assert np.allclose(warm.trajectories[robot].poses, trajectory.poses, atol=1e-4)


def test_an_estimate_that_went_astray_as_a_whole_comes_back_into_its_frame() -> None:
    team = Team(6)
    there = team.solved()
    astray = {
        r: replace(t, poses=se2.compose(np.array([[3.0, -1.0, 0.5]]), t.poses))
        for r, t in there.trajectories.items()
    }
    again = team.solved(replace(there, trajectories=astray))
    for robot, trajectory in there.trajectories.items():
        off = again.trajectories[robot].poses - trajectory.poses
        assert np.abs(off[:, :2]).max() < 1e-3
        assert np.abs(se2.wrap(off[:, 2])).max() < 1e-3


def test_beside_a_single_closure_a_heading_is_as_uncertain_as_its_odometry() -> None:
    rng = np.random.default_rng(7)
    graph, n = PoseGraph(), 10 * np.arange(COUNT)
    one, other = Chain(0, 1), Chain(1, 1)
    for chain in (one, other):
        odometry = driven(rng, wander(rng, COUNT, 0.4), NOISE)
        graph.insert(chain, GraphEntry(0, model_of(NOISE), keyframes(n, odometry)))
    only = closure(0, 100, other, 100, np.array([1.0, 2.0, 0.5]))
    graph.insert(one, GraphEntry(1, closures=(only,)))
    members = {Segment(*one, 0), Segment(*other, 0)}
    job = ClosureOptimizer().job(graph, Group(members, min(members)), None, {})
    assert job is not None
    seen = graph.view.chains[0]
    random = chain_links(seen, calibrated=True).covariance[:, 2, 2].sum()
    way = np.hypot(*np.diff(seen.keyframes.poses[:, :2], axis=0).T).sum()
    covariance = job().covariance(0)
    assert covariance is not None
    # (a constant yaw rate turns every link alike)
    expected = random + (NOISE.yaw_rad_per_m * way) ** 2
    assert covariance[2, 2] == pytest.approx(expected, rel=1e-2)


def test_two_closures_between_the_same_keyframes_both_count() -> None:
    team = Team(3)
    once = team.solved()
    wrong = team.true(1, 12) + [0.05, 0, 0]
    team.close(900, 1, 12, wrong, 0.02)
    twice = team.solved()
    team.close(901, 1, 12, wrong, 0.02)
    thrice = team.solved()
    assert once.cost + 1 < twice.cost < thrice.cost - 1


def test_closures_that_agree_only_with_each_other_count_for_nothing() -> None:
    """Robot 2 seen elsewhere from robot 1, five times alike; who knows robot 0 knows better."""
    team = Team(8)
    before = team.solved()
    n, chains = team.team.n, team.team.chains
    for k in range(5, COUNT, 7):
        seen = product(inverted(team.team.truth[1][k]), [2.0, 1.0, 0.5], team.team.truth[2][k])
        item = closure(900 + k, int(n[1][k]), chains[2], int(n[2][k]), seen, 0.02)
        team.team.graph.insert(chains[1], GraphEntry(2000 + k, closures=(item,)))
    after = team.solved()
    for robot, trajectory in before.trajectories.items():
        off = after.trajectories[robot].poses - trajectory.poses
        assert np.abs(off[:, :2]).max() < 0.02
    assert np.diag(after.joint / before.joint) == pytest.approx(1.0, rel=0.1)


def test_what_closures_are_worth_shows_in_the_covariances() -> None:
    """The same edges, once with good closures and once with poor ones."""
    spreads = []
    for sigma in (0.02, 0.3):
        variances = np.diag(Team(4, sigma).solved().joint).reshape(3, 3)
        spreads.append(np.sqrt(variances[:, 0] + variances[:, 1]))
    for robot in (1, 2):
        assert 0.01 < spreads[0][robot] < 0.9 * spreads[1][robot] < 0.9
    assert spreads[0][0] < spreads[1][0] < 1.0


@pytest.mark.parametrize(("in_vain", "is_anew"), [(2, False), (3, True)])
def test_who_came_to_no_end_three_times_begins_anew(in_vain: int, is_anew: bool) -> None:
    team = Team(1)
    before = replace(team.solved(), in_vain=in_vain)
    graph = team.team.graph
    job: Any = ClosureOptimizer().job(graph, group_of(graph), before, {})
    assert (job.args[0].start is None) is is_anew
