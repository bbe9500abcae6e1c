"""Groups, their frame, and where everybody starts."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from slam_scenes import (
    EXACT,
    Array,
    angle_between,
    closure,
    inverted,
    keyframes,
    product,
    same_pose,
    small_team,
    wander,
)

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import KeyframeTable
from drslamd.slam.graph.team_frame import (
    Group,
    by_odometry,
    gauge_segment,
    group_of,
    group_with,
    groups,
    placed,
)
from drslamd.slam.odometry.correction import Correction

CHAINS = [Chain(r, 10 + r) for r in range(5)]
A, B, C, D, E = CHAINS


def segment(chain: Chain, number: int = 0) -> Segment:
    return Segment(*chain, number)


def team_of(*joined: tuple[Chain, Chain], breaks: tuple[Chain, ...] = ()) -> PoseGraph:
    """Everybody has keyframes 0, 10, ... 90; closures at 10 join robots, `breaks` break at 50."""
    graph = PoseGraph()
    for chain in CHAINS:
        path = wander(np.random.default_rng(chain.robot), 10, 0.4)
        parts = [keyframes(range(0, 50, 10), path[:5])]
        parts.append(keyframes(range(50, 100, 10), path[5:], segment=int(chain in breaks)))
        graph.insert(chain, GraphEntry(0, keyframes=parts[0] + parts[1]))
    for number, (a, b) in enumerate(joined):
        item = closure(number, 10, b, 10, (1, 2, 0.3))
        graph.insert(a, GraphEntry(1 + number, closures=(item,)))
    return graph


def test_a_group_is_found_by_any_start_in_it() -> None:
    graph = team_of((A, B), (C, D))
    assert group_with({D, E}, graph) == {segment(C), segment(D)}
    assert group_with({E}, graph) == group_with(set(), graph) == set()
    # of two groups the lower one, on all robots alike
    assert group_with({D, B}, graph) == {segment(A), segment(B)}
    assert group_with({Chain(0, 9)}, graph) == set()


def in_frame(graph: PoseGraph, members: set[Segment], frame: Segment) -> Group:
    known = {Segment(*c.chain, int(s)) for c in graph.chains.values() for s in c.keyframes.segment}
    assert members <= known
    return Group(members, frame)


# groups


def test_closures_join_robots_into_groups() -> None:
    found = groups(team_of((A, B), (C, B), (D, E)))
    expected = [{segment(A), segment(B), segment(C)}, {segment(D), segment(E)}]
    assert sorted(found, key=len, reverse=True) == expected


def test_groups_that_a_late_closure_joins_become_one() -> None:
    assert groups(team_of((A, B), (C, D), (E, D), (B, E))) == [{segment(c) for c in CHAINS}]


def test_who_has_no_closure_is_in_no_group() -> None:
    assert groups(team_of()) == []
    assert groups(team_of((A, B))) == [{segment(A), segment(B)}]


def test_a_break_makes_another_member_of_it() -> None:
    graph = team_of((A, B), breaks=(A,))
    assert groups(graph) == [{segment(A, 0), segment(B, 0)}]
    late = closure(0, 90, C, 90, (0, 0, 0))
    graph.insert(A, GraphEntry(9, closures=(late,)))
    assert groups(graph) == [{segment(A, 0), segment(B, 0)}, {segment(A, 1), segment(C, 0)}]


def test_withdrawn_closures_and_those_to_missing_keyframes_join_nobody() -> None:
    graph = team_of((A, B))
    withdrawn = closure(0, 10, B, 10, (1, 2, 0.3), kept=False)
    nowhere = closure(1, 11, B, 10, (1, 2, 0.3))
    graph.insert(A, GraphEntry(5, closures=(withdrawn, nowhere)))
    assert groups(graph) == []


def test_a_robot_that_starts_anew_leaves_its_group() -> None:
    graph = team_of((A, B), (B, C))
    again = Chain(1, 99)
    graph.insert(again, GraphEntry(0, keyframes=keyframes([10], np.zeros((1, 3)))))
    assert groups(graph) == []


@pytest.mark.parametrize(
    ("living", "frame"),
    [({0, 1, 2}, segment(A)), ({1, 2}, segment(B)), ({2}, segment(C)), ({4}, None), (set(), None)],
)
def test_the_frame_is_that_of_the_lowest_living_robot(
    living: set[int], frame: Segment | None
) -> None:
    assert gauge_segment({segment(C), segment(A), segment(B)}, living) == frame


def test_of_its_segments_the_first_in_the_group_counts() -> None:
    assert gauge_segment({segment(A, 3), segment(A, 1), segment(B, 0)}, {0, 1}) == segment(A, 1)


# where everybody starts


def exact(robots: int = 3) -> tuple[PoseGraph, Group, dict[int, Array]]:
    """A team without errors and the truth in the frame of robot 0's odometry."""
    team = small_team(3, robots=robots, noise=EXACT, closure_sigma=0.0)
    members = {Segment(*chain, 0) for chain in team.chains.values()}
    origin = inverted(team.truth[0][0])
    truth = {r: np.array([product(origin, p) for p in path]) for r, path in team.truth.items()}
    return team.graph, Group(members, Segment(*team.chains[0], 0)), truth


def as_estimate(group: Group, graph: PoseGraph, poses: dict[int, Array]) -> TeamEstimate:
    return TeamEstimate(
        group.frame,
        {
            r: Trajectory(graph.chains[r].chain, graph.chains[r].keyframes.n[: len(p)], p)
            for r, p in poses.items()
        },
    )


def test_the_frame_s_own_robot_starts_at_its_odometry_and_the_others_at_their_closures() -> None:
    graph, group, truth = exact()
    start = placed(graph, group, None)
    assert set(start) == group.members
    for member, poses in start.items():
        for ours, true in zip(poses, truth[member.robot], strict=True):
            assert same_pose(ours, true, 2e-2)


def test_robots_that_are_joined_only_through_others_are_placed_too() -> None:
    graph, group, truth = exact(4)
    for key in ((0, 2), (0, 3), (1, 3)):
        del graph.pairs[key]
    for member, poses in placed(graph, group, None).items():
        assert same_pose(poses[-1], truth[member.robot][-1], 5e-2)


def test_poses_that_were_solved_stay_as_they_were() -> None:
    graph, group, truth = exact()
    moved = {r: poses + [0.5, -0.2, 0.0] for r, poses in truth.items()}
    start = placed(graph, group, as_estimate(group, graph, moved))
    for member, poses in start.items():
        assert np.allclose(poses, moved[member.robot])


def test_new_keyframes_follow_the_solved_ones_by_odometry() -> None:
    graph, group, truth = exact()
    solved = {r: poses[:25] for r, poses in truth.items()}
    for member, poses in placed(graph, group, as_estimate(group, graph, solved)).items():
        assert np.allclose(poses[:25], solved[member.robot])
        for ours, true in zip(poses[25:], truth[member.robot][25:], strict=True):
            assert same_pose(ours, true, 1e-2)


def wide(robots: tuple[int, ...]) -> tuple[PoseGraph, Group, dict[int, Array]]:
    """A team whose odometry is exact but for turns of some, which are a third too short in it."""
    graph, group, truth = exact()
    other = PoseGraph()
    for robot, chain in graph.chains.items():
        path = truth[robot]
        said = [np.zeros(3)]
        for here, there in itertools.pairwise(path):
            x, y, theta = product(inverted(here), there)
            short = theta / 3 if robot in robots else 0.0
            x, y, _ = product((0.0, 0.0, -short / 2), (x, y, 0.0))
            pose = product(said[-1], (x, y, theta - short))
            said.append(np.append(pose[:2], said[-1][2] + theta - short))
        other.insert(chain.chain, GraphEntry(0, None, keyframes(chain.keyframes.n, said)))
    for pair in graph.pairs.values():
        other.insert(pair.a, GraphEntry(1, closures=tuple(pair.kept_closures())))
    return other, group, truth


KNOWN = {0: Correction(turn=0.5), 2: Correction(turn=0.5)}


def test_who_is_not_mounted_as_configured_is_placed_by_odometry_as_it_should_have_been() -> None:
    graph, group, truth = wide((0, 2))
    start = placed(graph, group, None, KNOWN)
    for member, poses in start.items():
        for ours, true in zip(poses, truth[member.robot], strict=True):
            assert same_pose(ours, true, 3e-2)
    # the odometry of robot 1 is right, and that of the frame begins where it began
    plain = placed(graph, group, None)
    assert not same_pose(plain[group.frame][-1], truth[0][-1], 1.0)
    assert np.array_equal(start[group.frame][0], plain[group.frame][0])


def test_its_new_keyframes_follow_the_solved_ones_by_that_odometry_too() -> None:
    graph, group, truth = wide((0, 2))
    before = as_estimate(group, graph, {r: poses[:25] for r, poses in truth.items()})
    start = placed(graph, group, before, KNOWN)
    for member, poses in start.items():
        assert np.array_equal(poses[:25], truth[member.robot][:25])
        for ours, true in zip(poses[25:], truth[member.robot][25:], strict=True):
            assert same_pose(ours, true, 1e-2)


def test_a_new_frame_carries_all_poses_over() -> None:
    graph, group, truth = exact()
    before = as_estimate(group, graph, {r: p + [0.1, 0.1, 0.0] for r, p in truth.items()})
    other = Group(group.members, Segment(*graph.chains[1].chain, 0))
    start = placed(graph, other, before)
    # robot 1 is now at its own odometry, and nobody moved against it
    assert same_pose(start[other.frame][0], graph.chains[1].keyframes.poses[0], 1e-9)
    for member, poses in start.items():
        before_between = product(
            inverted(before.trajectories[1].poses[7]), before.trajectories[member.robot].poses[20]
        )
        now = product(inverted(start[other.frame][7]), poses[20])
        assert same_pose(now, before_between, 1e-9)


def test_an_estimate_of_strangers_is_of_no_use() -> None:
    graph, group, _ = exact()
    rows = graph.chains[0].keyframes.poses
    stranger = Segment(9, 9, 0)
    elsewhere = TeamEstimate(stranger, {9: Trajectory(Chain(9, 9), np.array([0]), np.ones((1, 3)))})
    assert np.allclose(placed(graph, group, elsewhere)[group.frame], rows)


def test_an_earlier_start_of_the_same_robot_is_a_stranger() -> None:
    graph, group, truth = exact()
    before = as_estimate(group, graph, truth)
    old = {r: Trajectory(Chain(r, 1), t.n, t.poses + 5.0) for r, t in before.trajectories.items()}
    start = placed(graph, group, TeamEstimate(group.frame, old))
    assert np.allclose(start[group.frame], graph.chains[0].keyframes.poses)


def test_an_earlier_start_of_the_new_frame_s_robot_carries_nothing_over() -> None:
    graph, group, truth = exact()
    before = as_estimate(group, graph, {r: p + [3.0, 3.0, 1.0] for r, p in truth.items()})
    old = before.trajectories[1]
    before.trajectories[1] = Trajectory(Chain(1, 1), old.n, old.poses + [9.0, 9.0, 0.0])
    other = Group(group.members, Segment(*graph.chains[1].chain, 0))
    start, afresh = placed(graph, other, before), placed(graph, other, None)
    for member, poses in start.items():
        assert np.array_equal(poses, afresh[member])


def test_two_segments_of_one_robot_are_placed_each_by_itself() -> None:
    graph = team_of((A, B), breaks=(A,))
    graph.insert(A, GraphEntry(9, closures=(closure(5, 70, B, 70, (-1, 0, 0.5)),)))
    members = {segment(A, 0), segment(A, 1), segment(B)}
    start = placed(graph, in_frame(graph, members, segment(A, 0)), None)
    assert np.allclose(start[segment(A, 0)], graph.chains[0].keyframes.poses[:5])
    b = start[segment(B)]
    assert same_pose(b[1], product(start[segment(A, 0)][1], (1, 2, 0.3)), 1e-9)
    assert same_pose(product(start[segment(A, 1)][2], (-1, 0, 0.5)), b[7], 1e-9)


def test_the_robot_that_most_closures_join_is_placed_first() -> None:
    """Three closures place B, and what C says of it, who is placed by one, does not count."""
    graph = team_of((A, B), (A, C))
    more = tuple(closure(7 + n, n, B, n, (1, 2, 0.3)) for n in (20, 30))
    graph.insert(A, GraphEntry(8, closures=more))
    graph.insert(B, GraphEntry(9, closures=(closure(50, 50, C, 50, (5, 5, 1)),)))
    members = {segment(A), segment(B), segment(C)}
    start = placed(graph, in_frame(graph, members, segment(A)), None)
    b, own = start[segment(B)], graph.chains[B.robot].keyframes.poses
    assert same_pose(b[3], product(start[segment(A)][3], (1, 2, 0.3)), 1e-9)
    assert same_pose(b[5], product(b[3], product(inverted(own[3]), own[5])), 1e-9)
    assert same_pose(start[segment(C)][5], product(b[5], (5, 5, 1)), 1e-9)


def test_keyframes_follow_the_nearest_that_is_known() -> None:
    rows = np.zeros((6, 5))
    rows[:, 0] = [0, 10, 20, 30, 40, 50]
    rows[:, 2] = np.arange(6)
    keyframes = KeyframeTable(rows)
    anchors = keyframes.chosen(np.array([1, 4]))
    at = np.array([[100.0, 0, 0], [200.0, 0, np.pi / 2]])
    poses = by_odometry(keyframes, anchors, at)
    assert np.allclose(poses[:3], [[99, 0, 0], [100, 0, 0], [101, 0, 0]])
    assert np.allclose(poses[3:, :2], [[200, -1], [200, 0], [200, 1]])
    assert angle_between(poses[5, 2], np.pi / 2) == pytest.approx(0)


def test_joints_name_the_segments_that_they_join() -> None:
    graph = team_of((A, B), breaks=(B,))
    graph.insert(A, GraphEntry(9, closures=(closure(5, 70, B, 70, (1, 0, 0)),)))
    found = [(j.a, j.b, j.closures.number.tolist()) for j in team_frame.joints(graph)]
    assert found == [(segment(A), segment(B, 0), [0]), (segment(A), segment(B, 1), [5])]


@pytest.mark.parametrize(
    ("current", "joined"),
    [(segment(A), True), (segment(A, 1), True), (segment(C, 1), False), (segment(E), False)],
    ids=["in it", "after a hole", "a hole of who was in none", "alone"],
)
def test_who_has_a_hole_is_in_the_group_of_what_it_drove_before(
    current: Segment, joined: bool
) -> None:
    graph = team_of((A, B), breaks=(A, C))
    expected = {segment(A), segment(B)} if joined else set()
    assert group_of(current, graph, looks_back=True) == expected
    at_once = joined and current.segment == 0
    assert group_of(current, graph, looks_back=False) == (expected if at_once else set())
