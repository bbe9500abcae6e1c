"""What is claimed with `rbcd`, against the exact solver."""

from __future__ import annotations

import numpy as np
import pytest
from rbcd_scenes import CARRIERS, a_round, good_team, true_public
from slam_scenes import SmallTeam, closure, group_of, inverted, product

from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer.closures.claimed import WholeGraph
from drslamd.slam.optimizer.closures.closure_optimizer import ClosureOptimizer
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver


@pytest.fixture
def team() -> SmallTeam:
    return good_team()


def test_what_is_claimed_is_that_of_the_whole_graph_whoever_moved_how_far(team: SmallTeam) -> None:
    """As the exact solver claims it, of our last pose and of the last public ones of neighbours."""
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    found = a_round(team, 1, public)
    assert found is not None
    exact = ClosureOptimizer().job(team.graph, group_of(team.graph), None, {})
    assert exact is not None
    ours, expected = found.covariance(1), exact().covariance(1)
    assert ours is not None
    assert expected is not None
    sigma = np.sqrt(np.diag(expected))
    assert (ours - expected) / np.outer(sigma, sigma) == pytest.approx(np.zeros((3, 3)), abs=0.1)
    apart = found.relative(1, 2)
    assert apart is not None
    assert 0 < np.linalg.eigvalsh(apart[1])[0] < np.linalg.eigvalsh(apart[1])[-1] < 1.0


def test_what_is_claimed_is_reckoned_once_for_each_news_of_anybody(team: SmallTeam) -> None:
    """Also of a closure between two others, that we only hear of."""
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    found = a_round(team, 1, public)
    assert found is not None
    again = a_round(team, 1, public, found)
    assert again is not None
    assert again.joint is found.joint
    assert again.lifted is not None
    a_T_b = product(inverted(team.truth[0][3]), team.truth[2][3])
    item = closure(900, int(team.n[0][3]), team.chains[2], int(team.n[2][3]), a_T_b, 0.02)
    team.graph.insert(team.chains[0], GraphEntry(2000, closures=(item,)))
    anew = a_round(team, 1, public, again)
    assert anew is not None
    assert not np.array_equal(anew.joint, found.joint)


def test_a_neighbour_is_claimed_where_its_newest_public_pose_is(team: SmallTeam) -> None:
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    found = a_round(team, 1, public)
    assert found is not None
    whole = WholeGraph.of(team.graph, group_of(team.graph))
    places = [int(whole.places.of_robot(2)[k]) for k in (CARRIERS[0], CARRIERS[-1])]
    poses = whole.in_frame(PoseGraphSolver(whole.edges, len(whole.places.n)).solve().poses)
    first, last = (whole.joint([place], poses) for place in places)
    claimed = found.covariance(2)
    assert claimed is not None
    assert np.sqrt(np.diag(claimed) / np.diag(last)) == pytest.approx(1.0, abs=0.1)
    assert np.abs(np.sqrt(np.diag(claimed) / np.diag(first)) - 1).max() > 0.1


def test_of_a_neighbour_outside_of_the_group_nothing_is_claimed(team: SmallTeam) -> None:
    """Its public poses are there before its keyframes."""
    members = {s for s in group_of(team.graph).members if s.robot != 2}
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    found = a_round(team, 1, public, group=Group(members, min(members)))
    assert found is not None
    assert list(found.trajectories) == [1, 0, 2]
    assert found.covariance(0) is not None
    assert found.covariance(2) is None
