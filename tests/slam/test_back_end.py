"""Module 3 as one robot runs it: when there is something to compute, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from slam_scenes import SmallTeam, closure, config, keyframes, same_pose, small_team, wander

from drslamd.conventions import Chain, Segment
from drslamd.slam.back_end import BackEnd
from drslamd.slam.graph.estimate import Lifted, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.optimizer.contract import Job

EVERYBODY = {0, 1, 2}
FIRST = {Segment(robot, 10 + robot, 0) for robot in EVERYBODY}
"""Of `small_team`: everybody's first segment."""


@dataclass
class Asked:
    """An optimiser that notes what it is given, and answers with a frame and nothing in it."""

    groups: list[Group] = field(default_factory=list)
    previous: TeamEstimate | None = None
    public: Mapping[int, PublicPoses] = field(default_factory=dict)

    def job(
        self,
        graph: PoseGraph,
        group: Group,
        previous: TeamEstimate | None,
        public: Mapping[int, PublicPoses],
    ) -> Job:
        self.groups.append(group)
        self.previous, self.public = previous, public
        return lambda: TeamEstimate(group.frame, {})


@pytest.fixture(scope="module")
def team() -> SmallTeam:
    return small_team(0, count=20)


def back_end(team: SmallTeam, robot: int = 0, extra: str = "") -> tuple[BackEnd, Asked]:
    """A back end that holds all that the team has said, with an optimiser that takes notes."""
    back = BackEnd(config(robot, extra), team.chains[robot])
    for origin, entry in team.entries:
        back.insert(origin, entry)
    asked = Asked()
    back._optimizer = asked
    return back, asked


def begin(back: BackEnd, present: set[int] = EVERYBODY, utime: int = 0) -> Job | None:
    """With the graph looked at to the end."""
    job = begin_slice(back, present, utime)
    while back.is_looking:
        job = begin_slice(back, present, utime)
    return job


def begin_slice(back: BackEnd, present: set[int] = EVERYBODY, utime: int = 0) -> Job | None:
    return back.begin(present, present, utime)


def settled(team: SmallTeam, robot: int = 0) -> tuple[BackEnd, Asked]:
    """The same after one solution."""
    back, asked = back_end(team, robot)
    run = begin(back)
    assert run is not None
    back.on_solution(run())
    return back, asked


RBCD = '[optimizer]\nalgorithm = "rbcd"\n'


def public_poses(frame: int = 0, epoch: int = 10, move: int = 1) -> PublicPoses:
    values = np.ones((2, 4), dtype=complex)
    return PublicPoses(frame, epoch, 2, (10,), values, round=move)


def moved(own: int, carriers: tuple[int, ...] = (10, 30)) -> TeamEstimate:
    """An answer of the relaxation in the frame of robot 1."""
    rows = np.arange(12).reshape(3, 4) * (1 + 2j)
    lifted = Lifted(
        n=np.array([10, 20, 30]),
        rows=rows,
        anchor=np.array([1, 0, 5, 6j]),
        origin=np.zeros(3),
        carriers=np.array(carriers, dtype=np.int64),
        weights=np.ones((len(carriers), 2)),
        ends=0,
        quiet=0,
        gain=0.0,
    )
    return TeamEstimate(Segment(1, 11, 0), {}, lifted=lifted)


# news


def test_before_anything_was_said_there_is_nothing_to_compute() -> None:
    back = BackEnd(config(), Chain(0, 10))
    assert begin(back) is None
    back.insert(Chain(0, 10), GraphEntry(0))
    assert begin(back) is None


def test_what_was_solved_is_not_solved_again_without_news(team: SmallTeam) -> None:
    back, asked = settled(team)
    assert begin(back) is None
    assert len(asked.groups) == 1


def test_a_log_entry_is_news(team: SmallTeam) -> None:
    back, _ = settled(team)
    back.insert(team.chains[1], GraphEntry(7, keyframes=(Keyframe(2_000, 0, 1, 2, 3),)))
    assert begin(back) is not None
    assert begin(back) is None


@pytest.mark.parametrize("present", [{0, 1}, {0, 1, 2, 3}])
def test_who_lives_is_news(team: SmallTeam, present: set[int]) -> None:
    back, _ = settled(team)
    assert begin(back, present) is not None
    assert begin(back, present) is None


def test_a_move_of_a_peer_is_news_and_a_turn_that_it_passes_on_is_none(team: SmallTeam) -> None:
    back, _ = back_end(team, 1, RBCD)
    back.hear(team.chains[0], public_poses())
    assert begin(back) is not None
    assert begin(back) is None
    back.hear(team.chains[0], public_poses(move=2))
    assert begin(back) is not None
    back.hear(team.chains[0], replace(public_poses(move=3).chosen(()), since=2))
    assert begin(back) is None


def test_other_algorithms_do_not_listen_to_public_poses(team: SmallTeam) -> None:
    back, _ = settled(team)
    back.hear(team.chains[1], public_poses())
    assert begin(back) is None
    assert back.exchange.held() == {}


def test_with_turns_a_neighbour_that_lives_is_waited_for(team: SmallTeam) -> None:
    back, asked = back_end(team, 1, RBCD)
    assert begin(back) is not None
    back.on_solution(moved(1), 0)
    back.hear(team.chains[0], public_poses(move=2))
    assert begin(back) is None
    assert back.exchange.is_waiting
    back.hear(team.chains[2], public_poses(move=2))
    assert begin(back) is not None
    back.on_solution(replace(moved(1, (10, 20)), converged=False), 0)
    # whoever is not there is not waited for
    assert begin(back, {1}) is not None
    assert len(asked.groups) == 3


@pytest.mark.parametrize(
    ("converged", "settled_too", "goes_on"),
    [(True, True, False), (True, False, True), (False, True, True)],
)
def test_what_is_not_final_goes_on_without_news(
    team: SmallTeam, converged: bool, settled_too: bool, goes_on: bool
) -> None:
    back, asked = settled(team)
    assert back.estimate is not None
    result = replace(back.estimate, converged=converged, settled=settled_too)
    back.on_solution(result)
    assert (begin(back) is not None) is goes_on
    if goes_on:
        assert asked.previous is back.estimate


# who is connected, and in whose frame


@pytest.mark.parametrize("times", range(1, 8))
def test_every_third_time_that_nothing_converges_it_should_begin_as_a_newcomer_does_as_well(
    team: SmallTeam, times: int
) -> None:
    back, asked = back_end(team)
    nowhere = TeamEstimate(Segment(0, 10, 0), {}, converged=False, settled=False)
    for _ in range(times):
        back.on_solution(nowhere)
    begin(back)
    assert asked.previous is not None
    assert asked.previous.leads_nowhere is (times in (3, 6))
    back.on_solution(TeamEstimate(Segment(0, 10, 0), {}, settled=False))
    begin(back)
    assert not asked.previous.leads_nowhere


def test_with_turns_a_move_goes_on_from_the_last_one_always(team: SmallTeam) -> None:
    back, asked = back_end(team, extra=RBCD)
    for _ in range(3):
        back.on_solution(TeamEstimate(Segment(0, 10, 0), {}, converged=False))
    begin(back)
    assert asked.groups
    assert asked.previous is not None


def test_a_job_is_of_the_group_of_our_current_segment(team: SmallTeam) -> None:
    back, asked = back_end(team, robot=1)
    assert begin(back) is not None
    assert back.group == asked.groups[0].members == FIRST


@pytest.mark.parametrize(("present", "frame"), [({0, 1, 2}, 0), ({1, 2}, 1)])
def test_the_frame_is_that_of_the_lowest_robot_that_lives(
    team: SmallTeam, present: set[int], frame: int
) -> None:
    back, asked = back_end(team, robot=1)
    assert begin(back, present) is not None
    assert asked.groups[0].frame == Segment(frame, 10 + frame, 0)


def test_after_a_break_in_our_odometry_the_team_goes_on_without_what_follows_it(
    team: SmallTeam,
) -> None:
    back, asked = settled(team)
    back.insert(team.chains[0], GraphEntry(7, keyframes=(Keyframe(500, 1, 0, 0, 0),)))
    assert begin(back) is not None
    assert Segment(0, 10, 0) in asked.groups[-1].members
    assert Segment(0, 10, 1) not in asked.groups[-1].members
    again = closure(900, 500, team.chains[1], int(team.n[1][19]), (1.0, 0.0, 0.0))
    back.insert(team.chains[0], GraphEntry(8, closures=(again,)))
    assert begin(back) is not None
    assert Segment(0, 10, 1) in asked.groups[-1].members


def test_without_closures_a_robot_is_in_no_group(team: SmallTeam) -> None:
    back = BackEnd(config(), team.chains[0])
    back.insert(*team.entries[0])
    assert begin(back) is None
    assert (back.group, back.estimate) == (set(), None)


def test_public_poses_of_other_frames_are_of_no_use(team: SmallTeam) -> None:
    back, asked = back_end(team, 0, RBCD)
    ours = public_poses()
    back.hear(team.chains[1], ours)
    back.hear(team.chains[2], public_poses(frame=1, epoch=11))
    assert begin(back) is not None
    assert dict(asked.public) == {1: ours}


# what follows from an answer


def test_the_answer_of_the_default_optimiser_says_where_everybody_was(team: SmallTeam) -> None:
    back = BackEnd(config(), team.chains[0])
    for origin, entry in team.entries:
        back.insert(origin, entry)
    run = begin(back)
    assert run is not None
    back.on_solution(run())
    own = back.trajectory(0)
    assert own is not None
    assert own.n.tolist() == team.n[0].tolist()
    assert same_pose(own.poses[0], np.zeros(3), 1e-3)
    assert back.trajectory(2) is not None
    assert back.trajectory(7) is None


def test_our_part_of_the_answer_becomes_our_history(team: SmallTeam) -> None:
    back, _ = back_end(team)
    frame = Segment(0, 10, 0)
    own, other = (
        Trajectory(team.chains[robot], team.n[robot], team.truth[robot]) for robot in (0, 1)
    )
    back.on_solution(TeamEstimate(frame, {0: own, 1: other}))
    assert back.history.latest is own
    back.on_solution(TeamEstimate(frame, {1: other}))
    assert back.history.latest is own
    assert back.trajectory(0) is None


def test_two_robots_of_a_group_that_hold_the_same_say_the_same_of_it(team: SmallTeam) -> None:
    one, other = (settled(team, robot)[0] for robot in (0, 1))
    assert one.digest() == other.digest()
    # whoever is in no group of theirs does not count
    stranger = GraphEntry(0, keyframes=(Keyframe(5, 0, 0, 0, 0),))
    one.insert(Chain(9, 1), stranger)
    assert one.digest() == other.digest()
    one.insert(team.chains[2], GraphEntry(7, keyframes=(Keyframe(9_000, 0, 1, 2, 3),)))
    assert one.digest() != other.digest()


def test_a_robot_that_began_again_is_news_and_one_that_goes_on_is_none(team: SmallTeam) -> None:
    back, _ = settled(team, 0)
    chain = team.chains[2]
    back.on_start(chain)
    assert begin(back) is None
    back.on_start(Chain(chain.robot, chain.epoch + 1))
    assert chain.robot not in back.graph.chains
    assert begin(back) is not None


def test_what_is_said_of_a_graph_is_of_when_module_3_looked_at_it(team: SmallTeam) -> None:
    back, _ = settled(team, 0)
    assert back.said_digest() == back.digest()
    back.insert(team.chains[2], GraphEntry(7, keyframes=(Keyframe(9_000, 0, 1, 2, 3),)))
    before = back.said_digest()
    # somebody asks for the status
    assert back.digest() != before
    assert back.said_digest() == before
    assert back.begin({0, 1, 2}) is not None
    assert back.said_digest() == back.digest() != before


def test_what_is_told_of_a_relaxation_are_our_poses_that_carry_closures(team: SmallTeam) -> None:
    back, _ = back_end(team)
    result = moved(0)
    (public,) = back.on_solution(result)
    assert (public.frame, public.frame_epoch, public.round) == (1, 11, 1)
    assert public.keyframes == (10, 30)
    assert result.lifted is not None
    assert np.array_equal(
        public.of_rank(2).values, [result.lifted.anchor, *result.lifted.rows[::2]]
    )


def test_without_a_relaxation_or_without_carriers_nothing_is_told(team: SmallTeam) -> None:
    back, _ = back_end(team)
    assert back.on_solution(TeamEstimate(Segment(0, 10, 0), {})) == []
    assert back.on_solution(moved(0, ())) == []


@pytest.mark.parametrize(("gain", "is_urgent"), [(1.1e-4, True), (0.9e-4, False)])
def test_a_move_that_brought_much_is_followed_at_once(
    team: SmallTeam, gain: float, is_urgent: bool
) -> None:
    back, _ = back_end(team)
    assert not back.is_urgent
    result = moved(0)
    assert result.lifted is not None
    back.on_solution(replace(result, lifted=replace(result.lifted, gain=gain)))
    assert back.is_urgent is is_urgent


def test_what_is_solved_is_thinned_and_what_was_said_is_held() -> None:
    back = BackEnd(config(), Chain(0, 10))
    path = wander(np.random.default_rng(1), 900)
    back.insert(Chain(0, 10), GraphEntry(0, keyframes=keyframes(range(0, 9000, 10), path)))
    assert len(back.graph.chains[0].keyframes) == 900
    assert len(back.graph.view.chains[0].keyframes) < 600


# a graph that is too large to be looked at in one go


def test_a_large_graph_is_looked_at_slice_by_slice_and_a_small_one_at_once(
    team: SmallTeam, monkeypatch: pytest.MonkeyPatch
) -> None:
    (whole, of_whole), (sliced, of_slices) = back_end(team), back_end(team)
    assert begin_slice(whole) is not None
    assert not whole.is_looking
    monkeypatch.setattr("drslamd.slam.back_end.AT_ONCE", 1)
    run, slices = begin_slice(sliced), 1
    while run is None:
        assert sliced.is_looking
        assert sliced.looked_at.chains == {}
        run, slices = begin_slice(sliced), slices + 1
    assert not sliced.is_looking
    assert slices > 3
    assert of_slices.groups == of_whole.groups
    assert sliced.looked_at.digest(EVERYBODY) == whole.looked_at.digest(EVERYBODY)
    sliced.on_solution(run())
    assert begin(sliced) is None


def test_what_came_while_it_was_looked_at_is_news_for_the_next_job(
    team: SmallTeam, monkeypatch: pytest.MonkeyPatch
) -> None:
    back, _ = settled(team)
    back.insert(team.chains[0], GraphEntry(900, keyframes=keyframes([990], np.zeros((1, 3)))))
    monkeypatch.setattr("drslamd.slam.back_end.AT_ONCE", 1)
    assert begin_slice(back) is None
    back.insert(team.chains[0], GraphEntry(901, keyframes=keyframes([999], np.zeros((1, 3)))))
    while (run := begin_slice(back)) is None:
        assert back.is_looking
    assert back.looked_at.chains[0].keyframes.n[-1] == 990
    back.on_solution(run())
    while (run := begin_slice(back)) is None:
        assert back.is_looking
    assert back.looked_at.chains[0].keyframes.n[-1] == 999


# a robot that was in a group before this start


def newcomer(team: SmallTeam) -> BackEnd:
    """One that nothing joins to the team, and that holds what the team said."""
    back, _ = back_end(team, 0)
    back._own = Chain(7, 1)
    back.insert(back._own, GraphEntry(0, keyframes=(Keyframe(0, 0, 0, 0, 0),)))
    return back


def test_who_knew_a_group_solves_it_and_is_in_none(team: SmallTeam) -> None:
    back = newcomer(team)
    assert begin(back) is None
    back.beside = {team.chains[1]}
    run = begin(back, EVERYBODY | {7})
    assert run is not None
    back.on_solution(run())
    assert back.estimate is None
    assert back.onlooked is not None
    assert back.onlooked.frame == min(FIRST)
    assert back.group == set()
    assert begin(back, EVERYBODY | {7}) is None


def test_once_it_is_in_a_group_that_is_its_own(team: SmallTeam) -> None:
    back = newcomer(team)
    back.beside = {team.chains[1]}
    run = begin(back)
    assert run is not None
    back.on_solution(run())
    item = closure(0, 0, team.chains[0], 0, (1.0, 2.0, 0.3))
    back.insert(Chain(7, 1), GraphEntry(1, closures=(item,)))
    run = begin(back)
    assert run is not None
    assert back._optimizer.previous is back.onlooked  # type: ignore[attr-defined]
    back.on_solution(run())
    assert back.estimate is not None
    assert back.onlooked is None
    assert Segment(7, 1, 0) in back.group


def test_without_its_peers_there_is_nothing_beside_it(team: SmallTeam) -> None:
    back = newcomer(team)
    back.beside = {team.chains[1]}
    run = begin(back)
    assert run is not None
    back.on_solution(run())
    back.beside = set()
    assert begin(back, {7}) is None
    assert back.onlooked is None


@pytest.mark.parametrize("held", [{(0, 1): 0.7}, {}])
def test_what_claims_are_narrowed_by_is_held_against_what_solutions_moved(
    team: SmallTeam, held: dict[tuple[int, ...], float], monkeypatch: pytest.MonkeyPatch
) -> None:
    back, _ = settled(team)
    asked: list[dict[tuple[int, ...], float]] = []

    def no_narrower(narrower: dict[tuple[int, ...], float]) -> dict[tuple[int, ...], float]:
        asked.append(narrower)
        return held

    monkeypatch.setattr(back.revisions, "no_narrower", no_narrower)
    assert back.estimate is not None
    back.on_solution(replace(back.estimate, narrower={(0, 1): 0.5}))
    assert asked == [{(0, 1): 0.5}]
    assert back.estimate.narrower == held


@pytest.mark.parametrize("robot", [0, 1, 2])
@pytest.mark.parametrize("algorithm", ["banded", "closures"])
def test_whose_way_is_a_mirror_image_is_in_the_group_where_module_3_solves_by_ranges(
    robot: int, algorithm: str
) -> None:
    """Robot 0 is, so the frame is that of robot 1."""
    team = small_team(0, count=20)
    odd = (0.0, 0.0, 0.0, -2.0)
    for k, (chain, entry) in enumerate(team.entries):
        if chain.robot == 0:
            said = tuple(replace(c, corrected=odd) for c in entry.closures)
            team.entries[k] = chain, replace(entry, closures=said)
    back, asked = back_end(team, robot, f'[optimizer]\nalgorithm = "{algorithm}"\n')
    begin(back)
    first, others = Segment(0, 10, 0), FIRST - {Segment(0, 10, 0)}
    if algorithm == "banded":
        assert asked.groups == [Group(others, min(others), mirrored=frozenset({first}))]
        assert back.group == FIRST
    else:
        assert asked.groups == ([] if robot == 0 else [Group(others, min(others))])
        assert back.group == (set() if robot == 0 else others)
