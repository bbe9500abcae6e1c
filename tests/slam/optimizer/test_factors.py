"""Items as edges between numbered poses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import (
    NOISE,
    Array,
    closure,
    inverted,
    keyframes,
    product,
    range_item,
    same_pose,
    small_team,
    wander,
)

from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.thinning.chain_view import whole
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.factors import (
    Numbering,
    chain_links,
    corrections,
    numbering,
    sensible,
)
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.robot_model import RobotModel

A, B, C = Chain(0, 5), Chain(1, 6), Chain(2, 7)


def members(*chains: Chain, segment: int = 0) -> set[Segment]:
    return {Segment(*chain, segment) for chain in chains}


def chain_of(path: Array, n: list[int], segments: list[int] | None = None) -> ChainData:
    items = ChainData(A)
    for k, (frame,) in enumerate(zip(keyframes(n, path), strict=True)):
        items.add(
            frame
            if segments is None
            else Keyframe(frame.n, segments[k], frame.x, frame.y, frame.theta)
        )
    return items


def two_robots(told: bool = True) -> PoseGraph:
    """a at 0, 10, 20 ... on its clock, b in between, 1000 samples ahead.

    Args:
        told: do closures that were withdrawn, and one that was not, tell of the clocks?
    """
    graph = PoseGraph()
    path = wander(np.random.default_rng(0), 8, 0.4)
    graph.insert(A, GraphEntry(0, keyframes=keyframes(range(0, 80, 10), path)))
    graph.insert(B, GraphEntry(0, keyframes=keyframes(range(1005, 1085, 10), path)))
    if told:
        seen = tuple(closure(k, 10 * k, B, 1000 + 10 * k, (1, 0, 0), kept=False) for k in range(9))
        graph.insert(A, GraphEntry(99, closures=seen))
    return graph


# numbering


def test_poses_are_numbered_in_the_order_of_time() -> None:
    graph = two_robots()
    numbers = numbering(graph, members(A, B))
    assert numbers.robot.tolist() == [0, 1] * 8
    assert numbers.n[::2].tolist() == list(range(0, 80, 10))
    assert numbers.n[1::2].tolist() == list(range(1005, 1085, 10))
    assert numbers.place[0].tolist() == list(range(0, 16, 2))
    assert numbers.place[1].tolist() == list(range(1, 16, 2))


def test_keyframes_of_other_segments_have_no_place() -> None:
    path = wander(np.random.default_rng(1), 6, 0.4)
    graph = PoseGraph()
    for first, segment in ((0, 0), (30, 1)):
        part = keyframes(range(first, first + 30, 10), path[first // 10 :][:3], segment)
        graph.insert(A, GraphEntry(segment, keyframes=part))
    graph.insert(B, GraphEntry(0, keyframes=keyframes([5], path[:1])))
    numbers = numbering(graph, {Segment(*A, 1), Segment(*B, 0)})
    assert numbers.place[0].tolist() == [-1, -1, -1, 1, 2, 3]
    n = np.array([0.0, 30.0, 35.0, 50.0])
    assert numbers.of(graph.view.chains[0], n).tolist() == [-1, 1, -1, 3]
    assert numbers.of(whole(ChainData(C)), n).tolist() == [-1] * 4


def test_a_robot_that_only_others_measured_is_numbered_by_what_they_say() -> None:
    """a knows b's clock and b that of c; and c stood still for a while, far from any keyframe."""
    graph = two_robots()
    path = wander(np.random.default_rng(2), 8, 0.4)
    graph.insert(C, GraphEntry(0, keyframes=keyframes(range(50_005, 50_085, 10), path)))
    ranges = [range_item(1005 + k, C, 50_005 + k, 3.0) for k in range(0, 80, 10)]
    ranges += [range_item(1005 + k, C, 50_075, 3.0) for k in range(0, 60, 10)]
    graph.insert(B, GraphEntry(1, ranges=tuple(ranges)))
    numbers = numbering(graph, members(A, B, C))
    assert np.abs(numbers.place[2] - numbers.place[1]).max() <= 2


def test_without_any_measurement_each_clock_counts_as_it_is() -> None:
    numbers = numbering(two_robots(told=False), members(A, B))
    assert numbers.robot.tolist() == [0] * 8 + [1] * 8


# odometry


def test_links_join_neighbours_and_no_others() -> None:
    path = wander(np.random.default_rng(3), 7, 0.4)
    items = chain_of(path, [0, 7, 10, 20, 40, 50, 51], [0, 0, 0, 1, 1, 1, 2])
    edges = chain_links(whole(items), calibrated=True)
    assert list(zip(edges.i.tolist(), edges.j.tolist(), strict=True)) == [
        (0, 1),
        (1, 2),
        (3, 4),
        (4, 5),
    ]
    for i, j, measured in zip(edges.i, edges.j, edges.measured, strict=True):
        assert same_pose(measured, product(inverted(path[i]), path[j]), 3e-4)


def test_a_chain_of_one_keyframe_has_no_links() -> None:
    for path in (np.zeros((0, 3)), np.zeros((1, 3))):
        assert len(chain_links(whole(chain_of(path, list(range(len(path))))), calibrated=True)) == 0


@pytest.mark.parametrize("calibrated", [True, False])
def test_the_covariance_of_a_link_is_that_of_noisy_drives(calibrated: bool) -> None:
    """One link of 0.8 m in 40 steps; scale and yaw rate are drawn when nobody estimates them."""
    rng, drives, steps = np.random.default_rng(4), 20_000, 40
    path = np.array([[0.0, 0, 0.3], [0.8 * math.cos(0.5), 0.8 * math.sin(0.5), 0.7]])
    driven = chain_of(path, [0, 10])
    driven.model = RobotModel(NOISE)
    edges = chain_links(whole(driven), calibrated)
    way = np.array([math.cos(0.2), math.sin(0.2)]) * 0.8 / steps  # seen from the first pose
    length = 0.8 / steps
    scale = 1 + rng.normal(0, NOISE.scale, drives) * (not calibrated)
    bend = rng.normal(0, NOISE.yaw_rad_per_m, drives) * (not calibrated)
    place, wrong = np.zeros((drives, 2)), np.zeros(drives)
    for _ in range(steps):
        turn = bend * length + rng.normal(0, NOISE.yaw_rad_per_sqrt_m * math.sqrt(length), drives)
        place += se2.rotate(wrong + turn / 2, scale[:, None] * way)
        place += rng.normal(0, NOISE.translation_per_sqrt_m * math.sqrt(length), (drives, 2))
        wrong += turn
    errors = np.column_stack([place - way * steps, wrong])
    seen = errors.T @ errors / drives
    floor = np.diag([factors.LINK_FLOOR_M**2] * 2 + [factors.LINK_FLOOR_RAD**2])
    sigma = np.sqrt(np.diag(seen))
    difference = (edges.covariance[0] - floor - seen) / np.outer(sigma, sigma)
    # the way is one straight step in the graph, so the swing of its parts is 3/4 of what it is
    assert np.abs(difference).max() < 0.09


def test_links_of_a_team_carry_robot_and_way() -> None:
    team = small_team(1, robots=2, count=5)
    numbers = numbering(team.graph, members(*team.chains.values()))
    links = factors.odometry(team.graph, numbers, [0, 1])
    assert links.robot.tolist() == [0] * 4 + [1] * 4
    assert (numbers.robot[links.i] == links.robot).all()
    assert (numbers.robot[links.j] == links.robot).all()
    assert (numbers.n[links.j] - numbers.n[links.i] == 10).all()
    way = links.by_yaw[:, 2]
    assert way == pytest.approx(np.hypot(links.measured[:, 0], links.measured[:, 1]))
    assert way == pytest.approx(0.4, rel=0.2)
    # a straight step swings about its middle
    assert links.by_yaw[:, 0] == pytest.approx(-way / 2 * links.measured[:, 1])
    assert links.by_yaw[:, 1] == pytest.approx(way / 2 * links.measured[:, 0])
    turn = links.by_turn[:, 2]
    assert turn == pytest.approx(links.measured[:, 2])
    assert links.by_turn[:, 0] == pytest.approx(-turn / 2 * links.measured[:, 1])
    assert links.by_turn[:, 1] == pytest.approx(turn / 2 * links.measured[:, 0])


# ranges and closures


def numbered(graph: PoseGraph) -> Numbering:
    return numbering(graph, members(A, B))


def test_ranges_end_at_their_keyframes_with_their_antennas() -> None:
    graph = two_robots()
    item = range_item(20, B, 1035, 4.5, (0.1, 0.2), (0.3, 0.4), 0.07)
    item = replace(item, turn_a=0.25, turn_b=-0.5)
    back = range_item(1015, A, 10, 4.0)
    graph.insert(A, GraphEntry(1, ranges=(item,)))
    graph.insert(B, GraphEntry(1, ranges=(back,)))
    numbers = numbered(graph)
    ranges, pairs = factors.ranges(graph, numbers)
    assert pairs == [(0, 1)]
    assert ranges.pair.tolist() == [0, 0]
    assert numbers.n[ranges.i].tolist() == [20, 1015]
    assert numbers.n[ranges.j].tolist() == [1035, 10]
    assert ranges.measured.tolist() == [4.5, 4.0]
    assert ranges.sigma.tolist() == [0.07, 0.1]
    assert ranges.q_i.tolist() == [[0.1, 0.2], [0, 0]]
    assert ranges.q_j.tolist() == [[0.3, 0.4], [0, 0]]
    assert ranges.robots.tolist() == [[0, 1], [1, 0]]
    assert ranges.turned.tolist() == [[0.25, -0.5], [0, 0]]
    assert not ranges.is_carried.any()


def test_items_wait_for_their_keyframes() -> None:
    graph = two_robots()
    one = GraphEntry(
        1, None, (), (range_item(33, B, 1035, 4.5),), (closure(0, 33, B, 1035, (1, 0, 0)),)
    )
    graph.insert(A, one)
    assert len(factors.ranges(graph, numbered(graph))[0]) == 0
    assert len(factors.closures(graph, numbered(graph))) == 0
    graph.insert(A, GraphEntry(2, keyframes=(Keyframe(33, 0, 1, 2, 3),)))
    numbers = numbered(graph)
    assert numbers.n[factors.ranges(graph, numbers)[0].i].tolist() == [33]
    assert numbers.n[factors.closures(graph, numbers).i].tolist() == [33]


def test_two_closures_between_the_same_two_poses_both_count() -> None:
    """DPGO drops the second one in silence (performance.md 1.5 a)."""
    graph = two_robots()
    twice = (closure(0, 20, B, 1025, (1, 0, 0.1)), closure(1, 20, B, 1025, (1.2, 0, 0.2)))
    graph.insert(A, GraphEntry(1, closures=twice))
    edges = factors.closures(graph, numbered(graph))
    assert edges.i.tolist() == [edges.i[0]] * 2
    assert edges.measured.tolist() == [[1, 0, 0.1], [1.2, 0, 0.2]]
    assert np.allclose(edges.covariance, np.diag([0.01, 0.01, 0.0025]))


def test_withdrawn_closures_and_those_of_other_groups_are_no_edges() -> None:
    graph = two_robots()
    graph.insert(C, GraphEntry(0, keyframes=(Keyframe(7, 0, 0, 0, 0),)))
    entries = (
        closure(0, 20, B, 1025, (1, 0, 0)),
        closure(0, 20, B, 1025, (1, 0, 0), kept=False),
        closure(1, 20, C, 7, (1, 0, 0)),
    )
    graph.insert(A, GraphEntry(1, None, (), (range_item(20, C, 7, 1.0),), entries))
    assert len(factors.closures(graph, numbered(graph))) == 0
    assert factors.ranges(graph, numbered(graph))[1] == []


def test_no_items_are_no_edges() -> None:
    nothing = BetweenFactors.joined([BetweenFactors.none(), BetweenFactors.none()])
    assert nothing.covariance.shape == (0, 3, 3)


# mountings that are not as configured


FOUND = (0.1, 0.4, -0.06, -0.2), (0.1, 0.5, -0.08, -0.3), (0.12, 0.9, 0.0, 0.0)
"""With which scale and turn of a and of b three closures were found."""


def found_with(*corrected: tuple[float, float, float, float]) -> PoseGraph:
    graph = two_robots(told=False)
    items = [
        replace(closure(k, 10 * k, B, 1005 + 10 * k, (1, 0, 0)), corrected=each)
        for k, each in enumerate(corrected)
    ]
    graph.insert(A, GraphEntry(1, closures=tuple(items)))
    return graph


def solved_for(robots: tuple[int, ...], turn: dict[int, Learned]) -> TeamEstimate:
    nowhere = np.zeros(0, dtype=int), np.zeros((0, 3))
    chains = {0: A, 1: B}
    return TeamEstimate(
        Segment(*A, 0),
        {robot: Trajectory(chains[robot], *nowhere) for robot in robots},
        scale={0: Learned(0.03, 0.01), 1: Learned(0.02, 0.01)},
        yaw={0: Learned(0.001, 0.01), 1: Learned(0.002, 0.01)},
        turn=turn,
    )


def test_closures_tell_with_which_mountings_they_were_found() -> None:
    """The middle of what they say of a robot, of each number by itself."""
    known = corrections(found_with(*FOUND), [0, 1], None)
    assert known == {0: Correction(0.1, 0.0, 0.5), 1: Correction(-0.06, 0.0, -0.2)}
    assert corrections(found_with(*FOUND), [1], None).keys() == {1}


def test_where_all_are_mounted_as_configured_there_is_nothing_to_correct() -> None:
    assert corrections(found_with(*[(0.0,) * 4] * 3), [0, 1], None) == {}
    assert corrections(two_robots(), [0, 1], None) == {}
    one_sided = found_with((0.0, 0.0, 0.1, 0.2))
    assert corrections(one_sided, [0, 1], None) == {1: Correction(0.1, 0.0, 0.2)}


def test_of_who_was_in_the_last_solution_that_is_believed_and_not_the_closures() -> None:
    graph = found_with(*FOUND)
    both = solved_for((0, 1), {1: Learned(0.35, 0.02)})
    assert corrections(graph, [0, 1], both) == {1: Correction(0.02, 0.002, 0.35)}
    one = solved_for((0,), {0: Learned(0.35, 0.02)})
    assert corrections(graph, [0, 1], one) == {
        0: Correction(0.03, 0.001, 0.35),
        1: Correction(-0.06, 0.0, -0.2),
    }


def test_who_turns_the_other_way_is_said_and_closures_do_not_tell_of_which_of_two_it_is() -> None:
    odd = (0.0, 0.0, 0.0, -2.0)
    graph = found_with((0.0, 0.0, 0.1, 0.2), odd, odd)
    known = corrections(graph, [0, 1], None, {0})
    assert known == {0: Correction(turn=-2.0), 1: Correction(0.1, 0.0, 0.2)}
    # what was learned since is kept, for as long as it is so
    solved = solved_for((0, 1), {0: Learned(-2.1, 0.1)})
    learned = Correction(0.03, 0.001, -2.1)
    assert corrections(graph, [0, 1], solved, {0}) == {0: learned}
    assert corrections(graph, [0, 1], solved) == {}
    assert corrections(graph, [0, 1], solved, {1}) == {1: Correction(turn=-2.0)}


# edges that reach far


def test_a_robot_that_stands_may_be_ranged_for_hours() -> None:
    j = np.arange(0, 3000)
    assert sensible(np.full(3000, 5), j).all()


def test_edges_all_over_the_time_are_nonsense() -> None:
    rng = np.random.default_rng(6)
    i, j = rng.integers(0, 10_000, (2, 2000))
    near = np.abs(i - j) <= factors.FAR
    kept = sensible(i, j)
    assert kept[near].all()
    assert kept[~near].sum() < 0.15 * (~near).sum()


@pytest.mark.parametrize(("reach", "kept"), [(factors.FAR, 65), (factors.FAR + 1, 64)])
def test_far_begins_beyond_its_bound_and_so_many_may_stand(reach: int, kept: int) -> None:
    i = 10 * np.arange(factors.STANDING + 1) + 10_000 * np.arange(factors.STANDING + 1)
    assert sensible(i, i + reach).sum() == kept


@pytest.mark.parametrize(("scale", "times"), [(-1.0, 2.0), (0.34, 0.5**0.5), (0.1, 1.0)])
def test_links_are_as_noisy_as_the_way_that_was_driven(scale: float, times: float) -> None:
    """In steps of half an octave: what differs by a rounding is the same noise."""
    team = small_team(1, robots=2, count=12)
    numbers = numbering(team.graph, members(*team.chains.values()))
    links = factors.odometry(team.graph, numbers, [0, 1])
    assert factors.as_driven(links, {}, [0, 1]) is links
    found = factors.as_driven(links, {1: Correction(scale, 0.0, 0.5)}, [0, 1])
    noisier = np.where(links.robot == 1, times, 1.0)[:, None, None]
    assert found.covariance == pytest.approx(noisier * links.covariance)
    near = factors.as_driven(links, {1: Correction(scale + 1e-6, 0.0, 0.5)}, [0, 1])
    assert np.array_equal(near.covariance, found.covariance)
