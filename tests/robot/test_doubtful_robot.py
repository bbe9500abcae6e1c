"""A robot whose measurements contradict each other: what it says, and what it does about it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pair_scenes import asked_at
from robot_scenes import RobotScene, notes, sends, solves, status_in

from drslamd import report
from drslamd.conditions.diagnosis import conditions, why_not_localised
from drslamd.events import JobDone
from drslamd.gossip import messages
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.jobs import WHAT_IF
from drslamd.slam.doubt import Reason
from drslamd.slam.front_end import WhatIfJob
from drslamd.slam.graph.estimate import MUCH_WORSE, Learned
from drslamd.slam.odometry.mounting import SIDES
from drslamd.slam.relative_pose.mistakes.mounting_search import FEWEST_ASKED
from drslamd.slam.relative_pose.mistakes.what_if import CASES, Case


def localised(level: float = 1.0, contradicted: bool = False) -> RobotScene:
    """Beside peer 4, with odometry so many times worse of late than configured."""
    scene = RobotScene()
    scene.meet(4)
    scene.drive(1)
    scene.range_to(4)
    estimate = replace(
        scene.localise(),
        late_level={0: level},
        bias_m={(0, 4): Learned(0.0, 0.1)},
        contradicted=frozenset({(0, 4)}) if contradicted else frozenset(),
    )
    scene.robot.back.on_solution(estimate)
    # and it stays so
    scene.robot.back.begin = lambda *_: None  # type: ignore[method-assign]
    return scene


@pytest.mark.parametrize(
    ("level", "state"),
    [(MUCH_WORSE - 0.1, PoseState.LOCALISED), (MUCH_WORSE, PoseState.DOUBTFUL)],
)
def test_doubt_is_a_state_of_its_own_in_status_and_pose(level: float, state: PoseState) -> None:
    scene = localised(level)
    effects = scene.tick()
    (status,) = sends(effects, "STATUS")
    assert status_in(status).state is state
    where = scene.robot.whereabouts(scene.utime)
    assert where.state is state
    poses = [messages.decode("POSE", send.payload) for send in sends(effects, "POSE")]
    # solutions come with news; that a pose is doubtful is said without any
    assert len(poses) == (state is PoseState.DOUBTFUL)
    for pose in poses:
        assert isinstance(pose, Pose)
        assert pose.state is state


def test_the_reason_is_said_with_what_to_do_and_partners_only_where_the_own_pose_is_good() -> None:
    scene = localised(5.0)
    said = [note for _ in range(3) for note in notes(scene.tick(0.3))]
    (doubt,) = (note for note in said if note.event.startswith("doubt"))
    assert "slip" in str(doubt.fields)
    assert not any(note.event.startswith("partners") for note in said)


@pytest.mark.parametrize(
    ("feared", "late", "keys"),
    [
        (MUCH_WORSE - 0.1, 1.0, []),
        (MUCH_WORSE, 1.0, ["odometry"]),
        # said once
        (MUCH_WORSE, MUCH_WORSE, ["doubt"]),
    ],
)
def test_odometry_that_was_worse_all_along_is_told_though_nobody_is_in_doubt(
    feared: float, late: float, keys: list[str]
) -> None:
    scene = localised(late)
    estimate = scene.robot.back.estimate
    assert estimate is not None
    scene.robot.back.on_solution(replace(estimate, odometry_level={0: feared}))
    said = {key for key, sentence in conditions(scene.robot, scene.utime) if sentence}
    assert sorted(said & {"odometry", "doubt"}) == keys


def test_who_is_contradicted_by_all_its_partners_names_them() -> None:
    scene = localised(contradicted=True)
    where = scene.robot.whereabouts(scene.utime)
    assert where.doubt is not None
    assert (where.doubt.reason, where.doubt.peers) == (Reason.RANGES, (4,))


@pytest.mark.parametrize(("level", "count"), [(1.0, 4), (MUCH_WORSE, 5)])
def test_in_doubt_a_robot_that_seems_to_stand_makes_a_keyframe_a_second(
    level: float, count: int
) -> None:
    """Two lie beside the moment in which it stopped, all at once."""
    scene = localised(level)
    scene.tick()
    for _ in range(2):
        scene.drive(1, metres=0.0)
        scene.range_to(4)
        scene.tick()
    assert len(scene.robot.back.graph.chains[0].keyframes) == count


# searches for mistakes


def searching(monkeypatch: pytest.MonkeyPatch) -> RobotScene:
    """A robot that asks a window of a pair whenever it looks; reversed wheels explain it."""
    scene = RobotScene()
    pair = scene.own_pair(1)
    costs = np.array([20.0 if case == Case(b=SIDES[0]) else 1e4 for case in CASES])

    def asked(*_: object) -> list[WhatIfJob]:
        return [WhatIfJob(pair, asked_at(10), lambda: (costs, 10.0))]

    monkeypatch.setattr(scene.robot.front, "what_if", asked)
    return scene


def test_what_a_search_finds_goes_to_its_pair_and_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = searching(monkeypatch)
    pair = scene.robot.front.pairs[1]
    said: list[str] = []
    for asked in range(FEWEST_ASKED):
        (solve,) = solves(scene.tick(1), WHAT_IF)
        assert pair.search.found is None
        # one search at a time
        assert solves(scene.tick(1), WHAT_IF) == []
        assert scene.robot.handle(JobDone(scene.utime, solve.job_id, solve.run(), 1_000)) == []
        assert (pair.search.found is None) is (asked + 1 < FEWEST_ASKED)
    for _ in range(2):
        said += [str(note.fields) for note in notes(scene.tick(1)) if "mounting" in note.event]
    assert any("robot 1 run backwards on the left (set wheels.reverse_left)" in s for s in said)
    # it is no answer of module 1
    assert pair.closures_seen == 0


@pytest.mark.parametrize(("took_us", "goes_on"), [(240_000, True), (260_000, False)])
def test_a_search_rests_four_times_as_long_as_it_computed(
    took_us: int, goes_on: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = searching(monkeypatch)
    (solve,) = solves(scene.tick(1), WHAT_IF)
    scene.robot.handle(JobDone(scene.utime, solve.job_id, solve.run(), took_us))
    assert bool(solves(scene.tick(1), WHAT_IF)) is goes_on


def test_a_robot_that_turns_the_other_way_says_where_it_is_and_which_keys_to_set() -> None:
    scene = localised()
    estimate = scene.robot.back.estimate
    assert estimate is not None
    odd = replace(estimate, points=frozenset({0}), mirrored={0: 0.01})
    scene.robot.back.on_solution(odd)
    status = report.status(scene.robot, scene.utime)
    assert (status["pose"]["state"], status["pose"]["theta_deg"]) == ("position", None)
    why = why_not_localised(scene.robot, scene.utime) or ""
    assert "wheels.reverse_left" in why
    assert "wheels.swap_channels" in why
    scene.robot.back.on_solution(replace(odd, mirrored={}))
    why = why_not_localised(scene.robot, scene.utime) or ""
    assert why.startswith("its place is known")
    assert "wheels." not in why


@pytest.mark.parametrize(("turn", "is_odd"), [(0.0, False), (0.09, False), (-0.11, True)])
def test_a_robot_whose_turns_are_others_than_its_wheels_say_tells_its_way_finer(
    turn: float, is_odd: bool
) -> None:
    scene = localised()
    estimate = scene.robot.back.estimate
    assert estimate is not None
    scene.robot.back.on_solution(replace(estimate, turn={0: Learned(turn, 0.01)}))
    assert scene.robot.standing.turns_otherwise is is_odd
    for _ in range(2):
        scene.tick()
        scene.drive(1)
        scene.range_to(4)
    scene.tick()
    steps = np.diff(scene.robot.back.graph.chains[0].keyframes.n)
    assert (steps == 5).any() == is_odd
    # a mirror image turns as its wheels say, the other way
    scene.robot.back.on_solution(replace(estimate, turn={0: Learned(-2.0, 0.01)}))
    assert not scene.robot.standing.turns_otherwise
