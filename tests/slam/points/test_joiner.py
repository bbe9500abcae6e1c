"""When it is asked how others lie, and what is told of the answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joining_scene import COUNT, NODES, A, B, graph_of
from lab.play import virtual_team
from lab.recordings import world
from passing_scene import SENSORS
from slam_scenes import angle_between, inverted, product
from teams import EASY

from drslamd.conventions import Segment
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.points.joiner import AGREE_M, EVERY_US, FIRST_NUMBER, JoinAnswer, Joiner

SEED = 5
NOBODY: list[int] = []


def asked(joiner: Joiner, utime: int, known: TeamEstimate | None = None) -> JoinAnswer | None:
    graph = graph_of(SEED, list(NODES), COUNT)
    run = joiner.look(graph, known, NOBODY, utime)
    return None if run is None else run()


def test_two_answers_that_agree_are_told_once() -> None:
    joiner = Joiner(A, SENSORS)
    for k, is_told in enumerate((False, True)):
        answer = asked(joiner, (k + 1) * EVERY_US)
        assert answer is not None
        assert joiner.on_found(answer, 0) is is_told
    (closure,) = joiner.tell()
    assert (closure.number, closure.peer, closure.kept) == (FIRST_NUMBER + 1, B, True)
    assert asked(joiner, 3 * EVERY_US) is None
    assert joiner.tell() == []


@pytest.mark.parametrize(("off", "is_told"), [(AGREE_M - 0.01, True), (AGREE_M + 0.01, False)])
def test_answers_that_differ_are_not_told(off: float, is_told: bool) -> None:
    joiner = Joiner(A, SENSORS)
    answer = asked(joiner, EVERY_US)
    assert answer is not None
    assert not isinstance(answer.found, str)
    other = answer.found._replace(a_T_b=answer.found.a_T_b + [off, 0.0, 0.0])
    joiner.on_found(answer, 0)
    assert joiner.on_found(JoinAnswer(B, other), 0) is is_told


def test_an_answer_between_that_names_nothing_counts() -> None:
    joiner = Joiner(A, SENSORS)
    answer = asked(joiner, EVERY_US)
    assert answer is not None
    joiner.on_found(answer, 0)
    assert not joiner.on_found(JoinAnswer(B, "ambiguous"), 0)
    assert not joiner.on_found(answer, 0)


def test_once_module_2_has_closures_it_is_withdrawn() -> None:
    joiner = Joiner(A, SENSORS)
    for k in range(2):
        answer = asked(joiner, (k + 1) * EVERY_US)
        assert answer is not None
        joiner.on_found(answer, 0)
    joiner.tell()
    joiner.look(graph_of(SEED, [], 0), None, [B.robot], 0)
    (withdrawn,) = joiner.tell()
    assert (withdrawn.number, withdrawn.kept) == (FIRST_NUMBER + 1, False)


def test_nobody_is_asked_about_who_is_in_the_group_or_has_a_lower_id() -> None:
    path = Trajectory(B, np.zeros(1), np.zeros((1, 3)))
    known = TeamEstimate(Segment(A.robot, A.epoch, 0), {B.robot: path})
    assert asked(Joiner(A, SENSORS), EVERY_US, known) is None
    assert asked(Joiner(B, SENSORS), EVERY_US) is None
    assert asked(Joiner(A, SENSORS), EVERY_US - 1) is None
    assert asked(Joiner(A, SENSORS), EVERY_US) is not None


@pytest.mark.slow
def test_two_out_of_each_others_reach_are_one_team_once_they_have_passed_two_modules() -> None:
    rng = np.random.default_rng(3)
    scene = world.Scene(**{**EASY.__dict__, "robots": 4, "seconds": 46.0})
    drives = [world.drive(rng, scene) for _ in range(2)]
    stand = [np.tile(at, (len(drives[0]), 1)) for at in ((2.0, 9.0, 0.0), (8.0, 3.0, 0.0))]
    whole = world.recorded("two modules", rng, scene, [*drives, *stand])
    trails = {robot: whole.trails[robot] for robot in range(2)}
    heard = (whole.ranges[:, 1] < 2) & (whole.ranges[:, 2] >= 2)
    simulator = virtual_team.play(replace(whole, trails=trails, ranges=whole.ranges[heard]), 3)
    first, second = (simulator.members[robot].robot.back.estimate for robot in range(2))
    assert first is not None
    assert second is not None
    assert first.frame == second.frame
    found = first.relative(0, 1)
    assert found is not None
    true = [trails[robot].truth[-1] for robot in range(2)]
    off = found[0] - product(inverted(true[0]), true[1])
    assert np.hypot(*off[:2]) < 0.5
    assert abs(angle_between(off[2], 0.0)) < 0.15
