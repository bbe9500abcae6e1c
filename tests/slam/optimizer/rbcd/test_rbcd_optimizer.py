"""The paper's module 3 as one robot runs it: its block, its neighbours, round by round."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from rbcd_scenes import CARRIERS, COUNT, RANK, a_round, good_team, in_frame, true_public
from slam_scenes import (
    EXACT,
    SmallTeam,
    inverted,
    product,
    same_pose,
    small_team,
)

from drslamd.conventions import Segment
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer.rbcd.rbcd_optimizer import (
    AFTER_NEWS,
    SETTLED,
    at_anchor,
)


@pytest.fixture(scope="module")
def team() -> SmallTeam:
    return good_team()


def said(estimate: TeamEstimate) -> PublicPoses:
    """What a robot tells of its state."""
    state = estimate.lifted
    assert state is not None
    table = dict(zip(state.n.tolist(), state.rows, strict=True))
    values = np.array([state.anchor, *(table[int(n)] for n in state.carriers)])
    numbers = tuple(int(n) for n in state.carriers)
    return PublicPoses(*estimate.frame.chain, RANK, numbers, values)


# where a block starts


def test_the_robot_whose_frame_it_is_begins_at_its_origin(team: SmallTeam) -> None:
    found = a_round(team, 0, {})
    assert found is not None
    own = found.trajectories[0]
    assert own.n.tolist() == team.n[0].tolist()
    assert same_pose(own.poses[0], np.zeros(3))
    for pose, true in zip(own.poses, in_frame(team, 0), strict=True):
        assert same_pose(pose, true, 5e-3)


def test_a_robot_that_nobody_has_placed_waits(team: SmallTeam) -> None:
    assert a_round(team, 1, {}) is None
    assert a_round(team, 2, {}) is None


@pytest.mark.parametrize(("robot", "other"), [(1, 0), (0, 1), (1, 2), (2, 1)])
def test_a_robot_is_placed_by_its_closures_with_one_who_is(
    team: SmallTeam, robot: int, other: int
) -> None:
    """Whichever of the two made them."""
    members = {Segment(*team.chains[r], 0) for r in range(3)}
    group = Group(members, Segment(*team.chains[3 - robot - other], 0))
    public = replace(true_public(team, other), frame=group.frame.robot)
    found = a_round(team, robot, {other: public}, group=group)
    assert found is not None
    for pose, true in zip(found.trajectories[robot].poses, in_frame(team, robot), strict=True):
        assert same_pose(pose, true, 0.3)


def test_a_robot_that_is_placed_needs_an_origin_too(team: SmallTeam) -> None:
    public = {0: true_public(team, 0)}
    before = a_round(team, 1, public)
    assert a_round(team, 1, public, before) is not None
    assert a_round(team, 1, {}, before) is None


def test_a_block_goes_on_from_where_it_was_and_new_keyframes_follow_by_odometry(
    team: SmallTeam,
) -> None:
    before = a_round(team, 0, {})
    assert before is not None
    assert before.lifted is not None
    turned = np.exp(0.4j)
    state = before.lifted
    half = replace(state, n=state.n[:10], rows=state.rows[:10] * turned)
    found = a_round(team, 0, {}, replace(before, lifted=half))
    assert found is not None
    assert found.lifted is not None
    # all turned alike is nothing that could be gained by turning back
    assert np.allclose(found.lifted.rows, before.lifted.rows * turned, atol=1e-3)


def test_what_was_solved_in_another_frame_is_no_start(team: SmallTeam) -> None:
    public = {0: true_public(team, 0)}
    before = a_round(team, 1, public)
    assert before is not None
    elsewhere = replace(before, frame=Segment(9, 9, 0))
    plain, again = a_round(team, 1, public), a_round(team, 1, public, elsewhere)
    assert plain is not None
    assert again is not None
    assert np.array_equal(plain.trajectories[1].poses, again.trajectories[1].poses)


def test_only_segments_of_the_group_are_in_the_block() -> None:
    team = small_team(3, count=COUNT, noise=EXACT)
    later = replace(team.entries[0][1].keyframes[-1], n=500, segment=1)
    team.graph.insert(team.chains[0], GraphEntry(9, keyframes=(later,)))
    found = a_round(team, 0, {})
    assert found is not None
    assert found.trajectories[0].n.tolist() == team.n[0].tolist()


# neighbours


@pytest.mark.parametrize(
    ("anchor", "is_used"), [(1.009, True), (1.011, False), (0.991, True), (0.989, False)]
)
def test_an_origin_whose_length_is_wrong_is_none(
    team: SmallTeam, anchor: float, is_used: bool
) -> None:
    assert (a_round(team, 1, {0: true_public(team, 0, anchor=anchor)}) is not None) is is_used


def test_poses_of_a_higher_rank_are_not_listened_to(team: SmallTeam) -> None:
    wrong = true_public(team, 0, rank=RANK + 1)
    assert a_round(team, 1, {0: wrong}) is None
    right = {2: true_public(team, 2)}
    plain, mixed = a_round(team, 1, right), a_round(team, 1, {**right, 0: wrong})
    assert plain is not None
    assert mixed is not None
    assert np.array_equal(plain.trajectories[1].poses, mixed.trajectories[1].poses)


def test_poses_of_a_lower_rank_lie_in_its_directions(team: SmallTeam) -> None:
    plain, flat = (a_round(team, 1, {0: true_public(team, 0, rank=k)}) for k in (RANK, 1))
    assert plain is not None
    assert flat is not None
    assert np.array_equal(plain.trajectories[1].poses, flat.trajectories[1].poses)


def origin_of(team: SmallTeam, public: Mapping[int, PublicPoses]) -> complex:
    """Where robot 1 thinks that the frame begins."""
    found = a_round(team, 1, public)
    assert found is not None
    assert found.lifted is not None
    return complex(found.lifted.anchor[RANK])


def test_the_origin_is_as_its_owner_says_it_else_as_the_lowest_robot_does(
    team: SmallTeam,
) -> None:
    public = {robot: true_public(team, robot) for robot in (0, 2)}
    for robot, said_by in public.items():
        said_by.values[0, RANK] = 1e-6 * (robot + 1)
    assert origin_of(team, public) == 1e-6
    assert origin_of(team, {2: public[2]}) == 3e-6
    public[0].values[0, :RANK] *= 2
    assert origin_of(team, public) == 3e-6


# rounds


def test_a_round_says_where_we_and_the_known_poses_of_our_neighbours_are(team: SmallTeam) -> None:
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    found = a_round(team, 1, public)
    assert found is not None
    assert found.frame == Segment(*team.chains[0], 0)
    assert set(found.trajectories) == {0, 1, 2}
    for robot in (0, 2):
        other = found.trajectories[robot]
        assert other.chain == team.chains[robot]
        assert other.n.tolist() == [int(team.n[robot][k]) for k in CARRIERS]
        for pose, k in zip(other.poses, CARRIERS, strict=True):
            assert same_pose(pose, in_frame(team, robot)[k], 1e-6)


def played(team: SmallTeam, rounds: int) -> dict[int, list[TeamEstimate]]:
    """The team takes turns; everybody hears everybody."""
    found: dict[int, list[TeamEstimate]] = {robot: [] for robot in range(3)}
    public: dict[int, PublicPoses] = {}
    for _ in range(rounds):
        for robot in range(3):
            others = {k: p for k, p in public.items() if k != robot}
            before = found[robot][-1] if found[robot] else None
            answer = a_round(team, robot, others, before)
            assert answer is not None
            found[robot].append(answer)
            public[robot] = said(answer)
    return found


def test_in_turns_the_team_comes_to_where_everybody_is(team: SmallTeam) -> None:
    found = played(team, 30)
    for robot in range(3):
        poses = found[robot][-1].trajectories[robot].poses
        off = [pose[:2] - true[:2] for pose, true in zip(poses, in_frame(team, robot), strict=True)]
        assert np.sqrt(np.mean(np.sum(np.square(off), axis=1))) < 0.06


def test_alone_with_its_neighbours_a_block_costs_less_each_round_until_it_has_converged(
    team: SmallTeam,
) -> None:
    """By the relative gain of a round, on both sides of its bound."""
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    before = a_round(team, 1, public)
    assert before is not None
    flags = []
    for _ in range(60):
        after = a_round(team, 1, public, before)
        assert after is not None
        assert after.cost <= before.cost
        gain = before.cost - after.cost
        assert after.converged is bool(gain <= SETTLED * (1 + after.cost))
        flags.append(after.converged)
        before = after
    assert not flags[0]
    assert flags[-1]


def test_while_nothing_new_is_measured_a_block_leans_further_and_further_out(
    team: SmallTeam,
) -> None:
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    found, moves = None, []
    for _ in range(5):
        found = a_round(team, 1, public, found)
        assert found is not None
        assert found.lifted is not None
        moves.append(found.lifted.quiet)
    assert moves == [0, 1, 2, 3, 4]
    # a neighbour less is news
    fewer = a_round(team, 1, {0: public[0]}, found)
    assert fewer is not None
    assert fewer.lifted is not None
    assert fewer.lifted.quiet == AFTER_NEWS


def test_a_block_that_could_gain_hardly_anything_stays_where_it_is(team: SmallTeam) -> None:
    public = {0: true_public(team, 0), 2: true_public(team, 2)}
    found = a_round(team, 1, public)
    while found is not None and not found.converged:
        found = a_round(team, 1, public, found)
    assert found is not None
    again = a_round(team, 1, public, found)
    assert again is not None
    assert again.lifted is not None
    assert found.lifted is not None
    assert np.array_equal(again.lifted.rows, found.lifted.rows)


def test_where_the_owner_of_the_frame_has_moved_everything_moves_with_it(team: SmallTeam) -> None:
    public = true_public(team, 0)
    found = a_round(team, 1, {0: public})
    assert found is not None
    turned = replace(public, values=public.values.copy())
    turned.values[0, 0] = np.exp(0.3j)
    turned.values[0, RANK] = 1.0 + 2.0j
    carried = at_anchor(found, turned)
    step = inverted(np.array([1.0, 2.0, 0.3]))
    for robot, trajectory in found.trajectories.items():
        for old, new in zip(trajectory.poses, carried.trajectories[robot].poses, strict=True):
            assert same_pose(new, product(step, old))
    assert carried.lifted is not None
    assert np.array_equal(carried.lifted.anchor, turned.values[0])
    # what is no pose, or was said already, changes nothing
    turned.values[0, 0] = 2.0
    assert at_anchor(found, turned) is found
    assert at_anchor(found, public) is found
