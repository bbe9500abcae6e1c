"""The robot by itself: its three modules, their answers, and its log."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from message_builders import a_status
from pair_scenes import BESIDE, asked_at, estimate_of
from robot_scenes import RobotScene, sends, solves
from slam_scenes import NOISE, closure

from drslamd.conventions import GRID_US, Chain, Segment
from drslamd.events import Effect, JobDone, Solve, Tick
from drslamd.gossip import messages
from drslamd.jobs import CONSISTENCY, OPTIMIZER, RELATIVE_POSE, RELOCATION, Job
from drslamd.slam.calibration.window_calibration import PairCalibration
from drslamd.slam.closure_method import PairWindow
from drslamd.slam.front_end import WindowJob
from drslamd.slam.graph.estimate import Learned, Lifted, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate

RBCD = '[optimizer]\nalgorithm = "rbcd"\n'


def answered(scene: RobotScene, job: Job, result: object) -> list[Effect]:
    solve = scene.robot.jobs.begin(job, lambda: None)
    return scene.robot.handle(JobDone(scene.utime, solve.job_id, result, 1000))


def test_an_answer_of_module_1_goes_to_its_pair() -> None:
    scene = RobotScene()
    one, other = scene.own_pair(1), scene.own_pair(2)
    assert (
        answered(scene, Job(RELATIVE_POSE, (other,), (asked_at(10),)), [estimate_of(BESIDE)]) == []
    )
    assert (one.closures_seen, other.closures_seen) == (0, 1)
    assert other.history[0].utime == 10 * GRID_US


def test_an_answer_of_module_2_goes_to_its_pair() -> None:
    scene = RobotScene()
    one, other = scene.own_pair(1), scene.own_pair(2)
    for robot in (0, 2):
        frames = (Keyframe(10, 0, 0, 0, 0),)
        scene.robot.back.insert(Chain(robot, 1), GraphEntry(0, keyframes=frames))
    other.on_estimate(asked_at(10), estimate_of(BESIDE))
    (solve,) = solves(scene.tick(), CONSISTENCY)
    assert scene.robot.handle(JobDone(scene.utime, solve.job_id, solve.run(), 1000)) == []
    assert [len(pair.kept) for pair in (one, other)] == [0, 1]


def test_an_answer_of_module_3_is_our_estimate_and_our_pose_goes_out() -> None:
    scene = RobotScene()
    scene.drive(1)
    n = scene.robot.front.reckoning.track.end - 1
    own = Trajectory(scene.robot.own, np.array([n]), np.zeros((1, 3)))
    estimate = TeamEstimate(
        Segment(0, 1, 0), {0: own}, joint=np.eye(3), scale={0: Learned(0.03, 0.01)}
    )
    effects = answered(scene, Job(OPTIMIZER), estimate)
    assert scene.robot.back.estimate is estimate
    assert scene.robot.calibration.latest.scale == pytest.approx(Learned(0.03, 0.01))
    assert len(sends(effects, "POSE")) == len(effects) == 1


def relaxed(reach: float = 1.0) -> TeamEstimate:
    """Module 3 with `rbcd` has moved one pose that carries closures."""
    rows, n = reach * np.ones((1, 4), dtype=complex), np.array([10])
    lifted = Lifted(n, rows, rows[0], np.zeros(3), n, np.ones((1, 2)), ends=1, quiet=0, gain=0.0)
    return TeamEstimate(Segment(0, 1, 0), {}, lifted=lifted)


def test_public_poses_go_out_where_there_is_a_relaxation() -> None:
    scene = RobotScene()
    assert len(sends(answered(scene, Job(OPTIMIZER), relaxed()), "PUBLIC")) == 1
    # what did not move is not said again
    assert sends(answered(scene, Job(OPTIMIZER), relaxed()), "PUBLIC") == []


def test_poses_that_nobody_would_believe_are_left_unsaid() -> None:
    scene = RobotScene()
    assert sends(answered(scene, Job(OPTIMIZER), relaxed(1e7)), "PUBLIC") == []


def a_question(move: int, held: int) -> PublicPoses:
    """Robot 4 waits for us."""
    values, asked = np.zeros((1, 2), dtype=complex), ((0, held),)
    return PublicPoses(4, 1, 1, (), values, round=move, since=move, asks=True, held=asked)


def test_what_a_neighbour_missed_is_said_again_when_it_asks() -> None:
    scene = RobotScene(extra=RBCD)
    scene.meet(4)
    answered(scene, Job(OPTIMIZER), relaxed())
    (again,) = sends(scene.hear(4, a_question(0, held=0)), "PUBLIC")
    message = messages.decode("PUBLIC", again.payload)
    assert isinstance(message, PublicPoses)
    assert (message.keyframes, message.round, message.since) == ((10,), 1, 0)


def test_who_waits_for_its_turn_begins_as_soon_as_a_neighbour_has_moved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene, begun = RobotScene(extra=RBCD), list[int]()
    scene.tick()
    monkeypatch.setattr(scene.robot.back, "begin", lambda *_: begun.append(1))
    public = PublicPoses(0, 1, 2, (10,), np.ones((2, 4), dtype=complex))
    scene.hear(4, public)
    assert begun == []
    scene.robot.back.exchange.wait(scene.utime)
    scene.hear(4, replace(public, round=2))
    assert begun == [1]


def test_what_a_peer_said_before_it_began_again_is_gone_with_its_first_word() -> None:
    """Logs begin anew with it, and nobody can learn any more what he lacks of the old one."""
    scene, said = RobotScene(), GraphEntry(0, keyframes=(Keyframe(10, 0, 0, 0, 0),))
    scene.meet(4)
    scene.hear(4, said)
    scene.meet(4)
    assert scene.robot.back.graph.chains[4].chain == Chain(4, 1)
    # (only a robot that was silent for a while may begin again)
    scene.later(10)
    scene.hear(4, a_status((), uwb_id=4), epoch=2)
    assert scene.robot.team.peers[4].chain == Chain(4, 2)
    assert 4 not in scene.robot.back.graph.chains


# our log


def connected(scene: RobotScene, peer: int = 4) -> None:
    """A peer in range, and some odometry of ours."""
    scene.meet(peer)
    scene.drive(1)
    scene.range_to(peer)


def test_our_log_grows_by_what_we_drove_and_is_sent_to_who_is_in_range() -> None:
    scene = RobotScene()
    connected(scene)
    assert len(sends(scene.tick(), "GRAPH")) == 1
    # where it began, then where it is
    assert len(scene.robot.back.graph.chains[0].keyframes) == 1
    assert len(sends(scene.tick(1), "GRAPH")) == 1
    assert len(scene.robot.back.graph.chains[0].keyframes) == 2
    # who stands still adds nothing
    assert sends(scene.tick(1), "GRAPH") == []


def test_with_nobody_in_range_our_log_grows_in_silence() -> None:
    scene = RobotScene()
    scene.drive(1)
    effects = scene.tick()
    assert sends(effects, "GRAPH") == []
    assert len(scene.robot.back.graph.chains[0].keyframes) == 1
    (state,) = scene.robot.team.logs.next_states()
    assert state.newest == 1


@pytest.mark.parametrize("ranges_to_us", [True, False])
@pytest.mark.parametrize("we_range", [True, False])
def test_a_living_peer_is_in_range_when_either_side_measures(
    ranges_to_us: bool, we_range: bool
) -> None:
    scene = RobotScene()
    scene.meet(4, ranges_to_us=ranges_to_us)
    if we_range:
        scene.range_to(4)
    near = scene.robot.neighbours(scene.utime)
    assert [peer.chain for peer in near] == ([Chain(4, 1)] if ranges_to_us or we_range else [])
    scene.later(10)
    assert scene.robot.neighbours(scene.utime) == []


def test_log_entries_are_repeated_to_whom_we_share_a_graph_with_and_not_otherwise() -> None:
    """Peer 4 lacks what we said before it came."""
    for is_near in (True, False):
        scene = RobotScene()
        scene.drive(1)
        scene.tick()
        scene.later(5)
        scene.meet(4)
        if is_near:
            scene.range_to(4)
        repeated = sends(scene.tick(0.2), "GRAPH")
        assert bool(repeated) is is_near


# the modules, as timers call them


def with_windows(monkeypatch: pytest.MonkeyPatch, *peers: int) -> RobotScene:
    """A robot that finds a window of each pair whenever it looks."""
    scene = RobotScene()
    noise = PairNoise(RangeNoise(0.1, 0.3), NOISE, NOISE)
    seen = PairWindow(asked_at(10).window, noise, PairCalibration())
    for peer in peers:
        scene.own_pair(peer)

    def found(*_: object) -> list[WindowJob]:
        return [WindowJob(p, asked_at(10), seen) for p in scene.robot.front.pairs.values()]

    def answers(windows: Sequence[PairWindow]) -> list[RelativePoseEstimate]:
        return [estimate_of(BESIDE)] * len(windows)

    monkeypatch.setattr(scene.robot.front, "module1", found)
    monkeypatch.setattr(scene.robot.front, "solve", answers)
    return scene


def ended(scene: RobotScene, solve: Solve, took_us: int) -> None:
    scene.robot.handle(JobDone(scene.utime, solve.job_id, solve.run(), took_us))


def test_windows_of_all_pairs_are_computed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = with_windows(monkeypatch, 1, 2)
    (solve,) = solves(scene.tick(), RELATIVE_POSE)
    ended(scene, solve, 1_000)
    assert {peer: p.closures_seen for peer, p in scene.robot.front.pairs.items()} == {1: 1, 2: 1}


def test_a_pair_whose_window_is_being_computed_gets_no_second_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = with_windows(monkeypatch, 1)
    (first,) = solves(scene.tick(), RELATIVE_POSE)
    assert solves(scene.tick(1), RELATIVE_POSE) == []
    scene.own_pair(2)
    (second,) = solves(scene.tick(1), RELATIVE_POSE)
    assert solves(scene.tick(1), RELATIVE_POSE) == []
    ended(scene, first, 1_000)
    ended(scene, second, 1_000)
    (again,) = solves(scene.tick(1), RELATIVE_POSE)
    ended(scene, again, 1_000)
    assert {peer: p.closures_seen for peer, p in scene.robot.front.pairs.items()} == {1: 2, 2: 2}


@pytest.mark.parametrize(("took_us", "goes_on"), [(240_000, True), (260_000, False)])
def test_module_1_rests_before_it_looks_at_windows_again(
    took_us: int, goes_on: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four times as long as it computed; it is asked once a second."""
    scene = with_windows(monkeypatch, 1)
    (solve,) = solves(scene.tick(), RELATIVE_POSE)
    ended(scene, solve, took_us)
    assert bool(solves(scene.tick(1), RELATIVE_POSE)) is goes_on


@pytest.mark.parametrize(("took_us", "goes_on"), [(333_333, True), (333_334, False)])
def test_module_3_runs_once_at_a_time_and_rests_too(
    took_us: int, goes_on: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = RobotScene()
    estimate = TeamEstimate(Segment(0, 1, 0), {})
    monkeypatch.setattr(scene.robot.back, "begin", lambda *_: lambda: estimate)
    (solve,) = solves(scene.tick(), OPTIMIZER)
    assert solves(scene.tick(1), OPTIMIZER) == []
    ended(scene, solve, took_us)
    assert scene.robot.back.estimate is estimate
    assert bool(solves(scene.tick(1), OPTIMIZER)) is goes_on


def test_while_the_graph_takes_more_than_one_look_the_robot_is_woken_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = RobotScene()
    for robot, closures in ((0, (closure(0, 10, Chain(1, 1), 10, BESIDE),)), (1, ()), (2, ())):
        frames = (Keyframe(10, 0, 0, 0, 0),)
        entry = GraphEntry(0, keyframes=frames, closures=closures)
        scene.robot.back.insert(Chain(robot, 1), entry)
    monkeypatch.setattr("drslamd.slam.back_end.AT_ONCE", 1)
    effects, woken = scene.robot.handle(Tick(scene.utime)), 0
    while not solves(effects, OPTIMIZER):
        assert scene.robot.next_tick == scene.utime
        scene.later(0.001)
        effects, woken = scene.robot.handle(Tick(scene.utime)), woken + 1
    assert woken > 2 + len(scene.robot.modules.pauses)
    scene.tick(0.001)
    assert scene.robot.next_tick > scene.utime + 50_000


def test_module_3_is_told_who_lives_and_whom_we_can_talk_to(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene, told = RobotScene(), list[tuple[object, ...]]()
    monkeypatch.setattr(scene.robot.back, "begin", lambda *known: told.append(known))
    scene.meet(4)
    scene.meet(5, hears_us=False)
    assert solves(scene.tick(), OPTIMIZER) == []
    assert told == [({0, 4}, {4}, scene.utime)]


def test_each_module_runs_at_its_configured_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    extra = (
        "[relative_pose]\nrate_hz = 2.0\n[consistency]\nrate_hz = 5.0\n[optimizer]\nrate_hz = 0.5\n"
    )
    scene = RobotScene(extra=extra)
    calls: Counter[str] = Counter()
    for part, name in (
        (scene.robot.front, "module1"),
        (scene.robot.front, "module2"),
        (scene.robot.back, "begin"),
    ):
        monkeypatch.setattr(part, name, lambda *_, name=name: calls.update([name]) or [])
    for _ in range(100):
        scene.tick(0.1)
    assert calls == {"module1": 20, "module2": 50, "begin": 5}


@pytest.mark.parametrize("is_news", [True, False])
def test_a_pose_that_a_computation_has_changed_is_said_at_once(is_news: bool) -> None:
    scene = RobotScene()
    scene.drive(2)
    scene.localise()
    scene.robot.jobs.begin(Job(OPTIMIZER), lambda: None)  # module 3 is not done yet
    effects = answered(scene, Job(RELOCATION, told=lambda result, utime: is_news), None)
    assert len(sends(effects, "POSE")) == is_news
