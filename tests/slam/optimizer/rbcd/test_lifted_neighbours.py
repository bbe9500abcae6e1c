"""What a robot's block hangs on: which closures, to which poses of others, and how stiffly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from rbcd_scenes import CARRIERS, COUNT, RANK, true_public
from slam_scenes import EXACT, SmallTeam, closure, small_team

from drslamd.conventions import Chain
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.rbcd.lifted_neighbours import (
    LiftedNeighbours,
    SharedClosures,
    lifted_neighbours,
    on_sphere,
    robots,
    shared_closures,
)


@pytest.fixture(scope="module")
def team() -> SmallTeam:
    return small_team(3, count=COUNT, noise=EXACT)


def neighbours_of(
    team: SmallTeam, robot: int, public: Mapping[int, PublicPoses]
) -> LiftedNeighbours:
    shared = shared_closures(team.graph, team.chains[robot])
    return lifted_neighbours(shared, team.n[robot], public, RANK)


def test_we_share_closures_with_those_that_measured_us_and_those_that_we_measured(
    team: SmallTeam,
) -> None:
    assert robots(team.graph, team.chains[1]) == {0, 2}
    assert robots(team.graph, Chain(1, 99)) == set()


def test_closures_lead_out_to_those_that_we_measured_and_in_from_those_that_measured_us(
    team: SmallTeam,
) -> None:
    """The lower robot of a pair made its closures."""
    around = neighbours_of(team, 1, {0: true_public(team, 0), 2: true_public(team, 2)})
    assert around.carriers.tolist() == [int(team.n[1][k]) for k in CARRIERS]
    assert around.arriving.j.tolist() == CARRIERS
    assert around.leaving.i.tolist() == CARRIERS
    for rows, robot in ((around.arriving.i, 0), (around.leaving.j, 2)):
        assert [around.chains[r] for r in rows] == [team.chains[robot]] * 2
        assert [int(around.n[r]) for r in rows] == [int(team.n[robot][k]) for k in CARRIERS]
        expected = true_public(team, robot).values[1:]
        assert np.array_equal(around.rows[rows], expected)


def test_each_closure_keeps_what_was_measured(team: SmallTeam) -> None:
    around = neighbours_of(team, 1, {0: true_public(team, 0), 2: true_public(team, 2)})
    for edges, pair in ((around.arriving, (0, 1)), (around.leaving, (1, 2))):
        made = [c for _, e in team.entries for c in e.closures if c.peer == team.chains[pair[1]]]
        mine = [c for c in made if c.a_n in team.n[pair[0]]]
        assert edges.measured == pytest.approx(np.array([c.a_T_b for c in mine]))
        assert edges.covariance[:, 0, 0] == pytest.approx([c.covariance[0] for c in mine])
        assert edges.covariance[:, 2, 2] == pytest.approx([c.covariance[5] for c in mine])


def test_poses_that_carry_closures_to_somebody_unknown_are_public_all_the_same(
    team: SmallTeam,
) -> None:
    around = neighbours_of(team, 1, {})
    assert around.carriers.tolist() == [int(team.n[1][k]) for k in CARRIERS]
    assert (len(around.leaving), len(around.arriving), len(around.rows)) == (0, 0, 0)


def test_closures_at_keyframes_that_are_not_ours_any_more_lead_nowhere(team: SmallTeam) -> None:
    shared = shared_closures(team.graph, team.chains[1])
    late = team.n[1][10:]
    around = lifted_neighbours(shared, late, {0: true_public(team, 0)}, RANK)
    assert around.carriers.tolist() == [int(team.n[1][15])]
    assert around.arriving.j.tolist() == [5]


def test_a_neighbour_of_which_one_pose_is_known_helps_with_that_one(team: SmallTeam) -> None:
    part = true_public(team, 0).chosen([int(team.n[0][15])])
    around = neighbours_of(team, 1, {0: part})
    assert around.n.tolist() == [int(team.n[0][15])]
    assert around.arriving.j.tolist() == [15]


@pytest.mark.parametrize(
    ("length", "is_used"), [(1.009, True), (1.011, False), (0.991, True), (0.989, False)]
)
def test_a_rotation_whose_length_is_wrong_is_none(
    team: SmallTeam, length: float, is_used: bool
) -> None:
    public = true_public(team, 0, length)
    assert on_sphere(public.values[1:]).tolist() == [is_used] * 2
    assert len(neighbours_of(team, 1, {0: public}).rows) == (2 if is_used else 0)


def test_a_closure_that_was_withdrawn_leads_nowhere() -> None:
    team = small_team(3, count=COUNT, noise=EXACT)
    gone = closure(0, int(team.n[0][5]), team.chains[1], int(team.n[1][5]), (0, 0, 0), kept=False)
    team.graph.insert(team.chains[0], GraphEntry(9, closures=(gone,)))
    around = neighbours_of(team, 1, {0: true_public(team, 0)})
    assert [int(n) for n in around.n] == [int(team.n[0][15])]


def test_a_pose_is_held_as_stiffly_as_all_its_closures_together() -> None:
    """A start of a closure is turned against its lever too, its end is not."""
    other = Chain(2, 1)
    covariance = np.tile(np.diag([0.04, 0.04, 0.01]), (2, 1, 1))
    measured = np.array([[3.0, 4.0, 0.5], [0.0, 0.0, 0.0]])
    leaving = SharedClosures(
        other, True, np.array([10, 10]), np.array([5, 6]), measured, covariance
    )
    arriving = SharedClosures(
        other, False, np.array([20]), np.array([5]), measured[:1], covariance[:1]
    )
    around = lifted_neighbours([leaving, arriving], np.array([10, 20, 30]), {}, RANK)
    assert around.carriers.tolist() == [10, 20]
    tau, kappa = 2 / (0.04 + 0.04), 2 / 0.01
    expected = [[2 * kappa + 25 * tau, 2 * tau], [kappa, tau]]
    assert around.weights == pytest.approx(np.array(expected))


def test_of_no_closures_there_are_no_neighbours() -> None:
    around = lifted_neighbours([], np.array([10, 20]), {}, RANK)
    assert (len(around.rows), len(around.carriers), around.weights.shape) == (0, 0, (0, 2))
    assert around.rows.shape == (0, 2 * RANK)
