"""What of the three modules waits for the clock, and what does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from pair_scenes import BESIDE, asked_at, estimate_of
from robot_scenes import RobotScene, solves

from drslamd.conventions import Chain
from drslamd.events import Effect, JobDone
from drslamd.jobs import CONSISTENCY, OPTIMIZER, RELATIVE_POSE, Job, Jobs
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.graph.measurements import ClosureMeasurement, GraphEntry, Keyframe
from drslamd.slam.odometry.mounting import SIDES
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relative_pose.mistakes.what_if import Case


class Waiting(RobotScene):
    """A pair of which five windows agree; the last answer of module 1 is on its way."""

    def __init__(self, agreeing: int = 5) -> None:
        super().__init__()
        self.pair: PairTracker = self.own_pair(1)
        self.pair.search.is_confirmed = True
        for robot in (0, 1):
            frames = tuple(Keyframe(10 * k, 0, 0, 0, 0) for k in range(1, agreeing + 1))
            self.robot.back.insert(Chain(robot, 1), GraphEntry(0, keyframes=frames))
        for k in range(1, agreeing):
            self.pair.on_estimate(asked_at(10 * k), estimate_of(BESIDE))
        self.last = 10 * agreeing

    def answered(self, job: Job, result: object) -> list[Effect]:
        solve = self.robot.jobs.begin(job, lambda: None)
        return self.robot.handle(JobDone(self.utime, solve.job_id, result, 1000))

    def checked(self, effects: list[Effect]) -> list[Effect]:
        """Module 2 that was begun has run."""
        (solve,) = solves(effects, CONSISTENCY)
        return self.robot.handle(JobDone(self.utime, solve.job_id, solve.run(), 1000))


def last_answer(scene: Waiting) -> list[Effect]:
    request = asked_at(scene.last)
    return scene.answered(Job(RELATIVE_POSE, (scene.pair,), (request,)), [estimate_of(BESIDE)])


def test_until_a_pair_is_told_what_is_found_of_it_goes_on_at_once_up_to_module_3() -> None:
    scene = Waiting()
    effects = scene.checked(last_answer(scene))
    assert scene.pair.connected
    assert scene.pair.is_told
    assert len(solves(effects, OPTIMIZER)) == 1


@pytest.mark.parametrize("is_asked", [False, True])
def test_news_that_come_while_module_3_computes_are_solved_as_soon_as_it_has(
    is_asked: bool,
) -> None:
    """Not a second later, and not without news."""
    scene = Waiting()
    modules, standing = scene.robot.modules, scene.robot.standing
    under_way = scene.robot.jobs.begin(Job(OPTIMIZER), lambda: None)
    if is_asked:
        assert not solves(scene.checked(last_answer(scene)), OPTIMIZER)
        assert scene.pair.is_told
    assert not solves(modules.place(standing, [], scene.utime), OPTIMIZER)
    scene.robot.jobs.finish(JobDone(scene.utime, under_way.job_id, None, 1000))
    later = scene.utime + 10_000
    begun = solves(modules.place(standing, [], later), OPTIMIZER)
    assert len(begun) == is_asked
    assert not solves(modules.place(standing, [], later + 250_000), OPTIMIZER)


def test_a_pair_that_is_not_connected_yet_is_not_told() -> None:
    scene = Waiting(agreeing=4)
    assert scene.checked(last_answer(scene)) == []
    assert not scene.pair.is_told


def test_a_pair_that_is_told_waits_for_the_clock() -> None:
    scene = Waiting()
    scene.checked(last_answer(scene))
    assert last_answer(scene) == []


def test_of_a_pair_whose_wheels_run_backwards_nothing_is_hurried() -> None:
    scene = Waiting()
    scene.pair.search.found = Case(b=SIDES[0])
    assert scene.checked(last_answer(scene)) == []
    assert not scene.pair.is_told


def test_the_first_closure_that_is_heard_is_solved_at_once_and_later_ones_wait() -> None:
    scene = Waiting()
    variances = (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)
    closure = ClosureMeasurement(0, True, 10, scene.robot.own, 10, (0.0, 3.0, 0.0), variances)
    frames = (Keyframe(10, 0, 0, 0, 0),)
    effects = scene.hear(2, GraphEntry(0, keyframes=frames, closures=(closure,)))
    assert len(solves(effects, OPTIMIZER)) == 1
    scene.localise(n=10)
    scene.robot.jobs = Jobs()
    scene.robot.modules._jobs = scene.robot.jobs
    later = replace(closure, number=1)
    assert not solves(scene.hear(2, GraphEntry(1, closures=(later,))), OPTIMIZER)


@pytest.mark.parametrize("is_told", [False, True])
def test_odometry_of_a_peer_is_a_reason_to_look_at_its_window_until_the_pair_is_told(
    is_told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At that of the pair alone, and whether it is mounted as configured."""
    scene = Waiting()
    scene.own_pair(2)
    if is_told:
        scene.checked(last_answer(scene))
    asked: list[tuple[str, list[int]]] = []

    def note(module: str) -> Callable[..., list[object]]:
        def ask(neighbours: list[PeerInRange], *_: object) -> list[object]:
            asked.append((module, [peer.chain.robot for peer in neighbours]))
            return []

        return ask

    for robot in (1, 2):
        scene.meet(robot)
        scene.range_to(robot)
    monkeypatch.setattr(scene.robot.front, "module1", note("module 1"))
    monkeypatch.setattr(scene.robot.front, "what_if", note("what if"))
    scene.follow(1, [[0.0, 0.0, 0.0]] * 10)
    assert asked == ([] if is_told else [("module 1", [1]), ("what if", [1])])
    scene.follow(3, [[0.0, 0.0, 0.0]] * 10)
    assert len(asked) == (0 if is_told else 2)
