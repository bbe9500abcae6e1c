"""Modules 1 and 2 as one robot runs them: keyframes, pairs, windows, and what goes into its log."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from front_scenes import SECONDS, FrontScene
from pair_scenes import BESIDE, asked_at, estimate_of
from slam_scenes import NOISE, angle_between, config, model_of

from drslamd.conventions import GRID_US, SECOND_US, Chain, Segment
from drslamd.sensors.samples import Motion, RangeSample
from drslamd.slam.calibration.sensor_calibration import CHANGED_BIAS_M, SensorCalibration
from drslamd.slam.closure_method import AGREEMENT, CONFIRM_US
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.graph.estimate import Lapse, Learned, TeamEstimate
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.range_buffer import MAX_UWB_IDS, RANGES_FRESH_US

UNKNOWN_CLOCK = "clock of the peer not known well enough"
KNOWN = SensorCalibration(Learned(0.1, 0.005), Learned(0.02, 0.001), {1: Learned(0.4, 0.01)})


def a_front_end(robot: int = 0) -> FrontEnd:
    return FrontEnd(config(robot), Chain(robot, 1))


def moved(front: FrontEnd, n: int, distance_m: float, turn_rad: float, gap: bool = False) -> None:
    front.on_motion(Motion(n * GRID_US, distance_m, turn_rad, gap))


# keyframes


def test_without_odometry_there_is_no_keyframe() -> None:
    assert a_front_end().make_keyframes() == []


def test_the_first_sample_is_a_keyframe_and_the_next_one_only_after_some_way() -> None:
    front = a_front_end()
    moved(front, 10, 0.0, 0.0)
    (first,) = front.make_keyframes()
    assert (first.n, first.segment, first.x, first.y, first.theta) == (10, 0, 0, 0, 0)
    assert front.make_keyframes() == []


@pytest.mark.parametrize(
    ("distance_m", "turn_rad", "is_made"),
    [
        (0.0498, 0.0, False),
        (0.0502, 0.0, True),
        (-0.0502, 0.0, True),
        (0.0, 0.0498, False),
        (0.0, 0.0502, True),
        (0.0, -0.0502, True),
        (0.0498, 0.0498, False),
    ],
)
def test_a_robot_that_moved_or_turned_enough_makes_a_keyframe(
    distance_m: float, turn_rad: float, is_made: bool
) -> None:
    front = a_front_end()
    moved(front, 10, 0.0, 0.0)
    front.make_keyframes()
    moved(front, 11, distance_m, turn_rad)
    assert bool(front.make_keyframes()) is is_made


def test_small_steps_add_up() -> None:
    front = a_front_end()
    moved(front, 10, 0.0, 0.0)
    front.make_keyframes()
    for n in (11, 12):
        moved(front, n, 0.03, 0.0)
        found = front.make_keyframes()
    (made,) = found
    assert (made.n, made.x) == (12, 600)


def test_after_a_hole_a_new_segment_begins_though_nobody_moved() -> None:
    front = a_front_end()
    for n in (10, 11):
        moved(front, n, 0.0, 0.0)
    front.make_keyframes()
    moved(front, 20, 0.0, 0.0, gap=True)
    (made,) = front.make_keyframes()
    assert (made.n, made.segment) == (20, 1)
    assert front.make_keyframes() == []


# who owns a pair, and to whom ranges come in


@pytest.mark.parametrize(
    ("robot", "peer", "ranges_to_us", "is_ours"),
    [(0, 1, True, True), (0, 1, False, True), (2, 1, True, False), (2, 1, False, True)],
)
def test_the_lower_robot_owns_a_pair_and_the_other_one_when_only_it_measures(
    robot: int, peer: int, ranges_to_us: bool, is_ours: bool
) -> None:
    scene = FrontScene(robot, peer, ranges_to_us=ranges_to_us)
    scene.drive(3)
    assert scene.front.needed([scene.neighbour()], scene.utime) == ({peer} if is_ours else set())
    scene.module1()
    assert set(scene.front.pairs) == ({peer} if is_ours else set())


def test_a_peer_to_which_no_ranges_come_in_is_not_needed() -> None:
    scene = FrontScene()
    scene.drive(3)
    stranger = scene.neighbour(uwb_id=9)
    assert scene.front.needed([stranger], scene.utime) == set()


@pytest.mark.parametrize(
    ("silent_us", "is_ranged"), [(3 * SECOND_US - 1, True), (3 * SECOND_US, False)]
)
def test_a_module_that_was_silent_for_long_is_not_in_range(silent_us: int, is_ranged: bool) -> None:
    scene = FrontScene()
    scene.drive(5)
    now = scene.last_range + silent_us
    assert scene.front.ranged(now) == ([1] if is_ranged else [])
    scene.front.update_pairs([scene.neighbour()], scene.graph, now)
    assert bool(scene.front.pairs) is is_ranged


@pytest.mark.parametrize(
    ("later_us", "remembered"),
    [(RANGES_FRESH_US - 1, range(MAX_UWB_IDS)), (RANGES_FRESH_US, range(1, MAX_UWB_IDS + 1))],
)
@pytest.mark.row("O7")
def test_so_many_modules_are_remembered_and_only_a_silent_one_makes_room(
    later_us: int, remembered: range
) -> None:
    front = a_front_end()
    for uwb_id in range(MAX_UWB_IDS):
        front.on_range(RangeSample(uwb_id, uwb_id, 5.0, 0.0))
    front.on_range(RangeSample(later_us, MAX_UWB_IDS, 5.0, 0.0))
    assert sorted(front.ranges) == list(remembered)


def test_questions_change_nothing() -> None:
    scene = FrontScene(clock_is_known=False)
    scene.drive(5)
    front, near = scene.front, [scene.neighbour()]
    for _ in range(2):
        assert front.needed(near, scene.utime) == {1}
        assert front.ranged(scene.utime) == [1]
    assert front.pairs == {}
    front.update_pairs(near, scene.graph, scene.utime)
    tracked = front.pairs[1]
    for _ in range(2):
        assert front.needed(near, scene.utime) == {1}
        front.update_pairs(near, scene.graph, scene.utime)
    assert front.pairs[1] is tracked
    assert tracked.verdicts == {}


@pytest.mark.parametrize(("said", "tracked"), [((0,), False), ((1,), False), ((0, 1), True)])
def test_a_pair_is_tracked_when_both_logs_have_begun(said: tuple[int, ...], tracked: bool) -> None:
    scene = FrontScene(logs=said)
    scene.drive(3)
    scene.module1()
    assert bool(scene.front.pairs) is tracked


def test_a_peer_that_started_again_is_another_pair() -> None:
    scene = FrontScene()
    scene.drive(3)
    scene.module1()
    before = scene.front.pairs[1]
    scene.restart_peer()
    scene.module1()
    assert scene.front.pairs[1] is before
    scene.drive(2)
    scene.module1()
    assert scene.front.pairs[1] is not before
    assert scene.front.pairs[1].peer == Chain(1, 2)


def test_a_peer_that_carries_another_module_now_is_the_same_pair() -> None:
    scene = FrontScene()
    scene.drive(3)
    scene.module1()
    pair = scene.front.pairs[1]
    scene.front.on_range(RangeSample(scene.utime, 9, 5.0, 0.0))
    scene.front.update_pairs([scene.neighbour(uwb_id=9)], scene.graph, scene.utime)
    assert scene.front.pairs[1] is pair
    assert pair.ranges is scene.front.ranges[9]


# module 1


def test_a_window_ends_two_seconds_ago_and_holds_what_was_measured() -> None:
    scene = FrontScene()
    scene.drive(SECONDS)
    (job,) = scene.module1()
    assert job.pair is scene.front.pairs[1]
    assert job.request.utime == scene.last_range - CONFIRM_US
    window = job.request.window
    when = (job.request.utime + window.t * SECOND_US) / GRID_US
    # medians of half a second or so
    assert window.ranges == pytest.approx(scene.distances(when), abs=0.02)
    (found,) = scene.front.solve([job.given])
    (hypothesis,) = found.hypotheses
    expected = scene.seen(round(job.request.utime / GRID_US))
    assert hypothesis.a_T_b[:2] == pytest.approx(expected[:2], abs=0.05)
    assert abs(angle_between(hypothesis.a_T_b[2], expected[2])) < 0.03


def noise_of(scene: FrontScene) -> PairNoise:
    """What module 1 is told of the sensors."""
    (job,) = scene.module1()
    return job.given.noise


def test_module_1_is_told_how_wrong_both_robots_say_that_they_are() -> None:
    extra = "[relative_pose]\nrange_sigma_m = 0.2\nrange_bias_sigma_m = 0.7\n"
    scene = FrontScene(extra=extra + "[odometry]\nscale_sigma = 0.07\n")
    scene.drive(10)
    scene.graph.insert(scene.peer, GraphEntry(99, model_of(NOISE)))
    told = noise_of(scene)
    assert told.ranges.sigma == 0.2
    assert told.ranges.bias_sigma == pytest.approx(0.7)
    assert told.a.scale == pytest.approx(0.07)
    assert told.b == NOISE


@pytest.mark.parametrize(("is_used", "extra"), [(True, ""), (False, "self_calibration = false\n")])
def test_what_module_3_has_learned_of_a_bias_serves_module_1(is_used: bool, extra: str) -> None:
    scene = FrontScene(extra="[relative_pose]\n" + extra)
    scene.drive(SECONDS)
    learned = TeamEstimate(Segment(0, 1, 0), {}, bias_m={(0, 1): Learned(1.5, 0.01)})
    (plain,), (told,) = scene.module1(), scene.module1(learned)
    answers = [found.hypotheses for found in scene.front.solve([plain.given, told.given])]
    same = len(answers[0]) == len(answers[1]) and all(
        np.array_equal(a.a_T_b, b.a_T_b) for a, b in zip(*answers, strict=True)
    )
    assert same is not is_used


@pytest.mark.parametrize("robot", [0, 1])
def test_no_window_spans_a_time_in_which_wheels_stood_or_spun(robot: int) -> None:
    """The stretch of one of them ended ten seconds ago, by its own clock."""
    scene = FrontScene()
    scene.drive(SECONDS)
    (plain,) = scene.module1()
    last = (scene.utime - 10 * SECOND_US + (scene.neighbour().ahead_us or 0) * robot) // GRID_US
    lapses = (Lapse(robot, last - 50, last, stood=True), Lapse(2, last, last + 90, stood=True))
    scene.front.pairs[1].history.clear()
    (job,) = scene.module1(TeamEstimate(Segment(0, 1, 0), {}, lapses=lapses))
    seconds = np.ptp(plain.request.window.t), np.ptp(job.request.window.t)
    assert seconds[0] > 15
    assert 8 < seconds[1] < 10.2


@pytest.mark.parametrize("calls", [1, 3])
def test_a_window_is_counted_once_a_call_while_the_clock_is_unknown(calls: int) -> None:
    scene = FrontScene(clock_is_known=False)
    scene.drive(SECONDS)
    for _ in range(calls):
        assert scene.module1() == []
        assert scene.sample_ranges() == []
        assert scene.front.needed([scene.neighbour()], scene.utime) == {1}
    assert scene.front.pairs[1].verdicts == {UNKNOWN_CLOCK: calls}


def test_a_window_that_is_none_is_counted_by_its_reason_once_a_call() -> None:
    scene = FrontScene()
    scene.drive(0.4)
    for calls in (1, 2):
        assert scene.module1() == []
        scene.sample_ranges()
        assert scene.front.pairs[1].verdicts == {"too few ranges": calls}


def test_what_was_learned_before_this_start_is_taken_out_of_motions_and_ranges() -> None:
    plain, known = FrontScene(), FrontScene(known=KNOWN)
    for scene in (plain, known):
        scene.drive(10)
    ways = [scene.front.reckoning.path_m for scene in (plain, known)]
    assert ways[1] == pytest.approx(0.9 * ways[0])
    turns = [scene.front.reckoning.track.poses[-1, 2] for scene in (plain, known)]
    assert turns[1] == pytest.approx(turns[0] - 0.02 * ways[0], abs=1e-3)
    windows = [scene.module1()[0].request.window.ranges for scene in (plain, known)]
    assert windows[1] == pytest.approx(windows[0] - 0.4)
    assert known.front.model.noise.scale < plain.front.model.noise.scale
    assert (
        CHANGED_BIAS_M
        < noise_of(known).ranges.bias_sigma + 0.02
        < noise_of(plain).ranges.bias_sigma
    )


# module 2, and what goes into our log


def believed(scene: FrontScene, windows: int) -> None:
    """So many closures that agree, through module 2."""
    pair = scene.front.pairs[1]
    pair.search.is_confirmed = True
    for n in range(10, 10 + 10 * windows, 10):
        pair.on_estimate(asked_at(n), estimate_of(scene.seen(n)))
        ((same, run),) = scene.front.module2(scene.graph, None)
        assert same is pair
        pair.on_check(run())


@pytest.mark.parametrize(
    ("algorithm", "said"), [("banded", 1), ("closures", AGREEMENT.least), ("rbcd", AGREEMENT.least)]
)
def test_where_ranges_are_the_edges_few_closures_are_said_and_elsewhere_all(
    algorithm: str, said: int
) -> None:
    scene = FrontScene(extra=f'[optimizer]\nalgorithm = "{algorithm}"\n')
    scene.drive(8)
    scene.module1()
    believed(scene, AGREEMENT.least)
    told = scene.front.tell_closures()
    assert len(told) == said
    assert all(closure.peer == Chain(1, 1) for closure in told)
    assert scene.front.tell_closures() == []


def test_module_2_checks_what_waits_and_only_of_the_start_that_the_graph_knows() -> None:
    scene = FrontScene()
    scene.drive(5)
    scene.module1()
    assert scene.front.module2(scene.graph, None) == []
    scene.front.pairs[1].on_estimate(asked_at(10), estimate_of(BESIDE))
    later = GraphEntry(0, keyframes=(Keyframe(10, 0, 0, 0, 0),))
    scene.graph.insert(Chain(1, 2), later)
    assert scene.front.module2(scene.graph, None) == []


@pytest.mark.parametrize("converged", [True, False])
@pytest.mark.parametrize("algorithm", ["drslamd", "paper"])
def test_module_2_goes_along_tracks_as_they_should_have_been(
    algorithm: str, converged: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As module 3 learned it of both robots, where it came to an end; the paper has none of it."""
    scene = FrontScene(extra=f'[relative_pose]\nalgorithm = "{algorithm}"\n')
    scene.drive(5)
    scene.module1()
    scene.front.pairs[1].on_estimate(asked_at(10), estimate_of(scene.seen(10)))
    estimate = TeamEstimate(
        Segment(0, 1, 0),
        {},
        scale={0: Learned(0.1, 0.01)},
        turn={0: Learned(0.4, 0.02)},
        converged=converged,
    )
    seen: list[tuple[Correction, Correction] | None] = []
    begin = PairTracker.begin_check

    def watched(self: PairTracker, *args: Any) -> Any:
        seen.append(args[3])
        return begin(self, *args)

    monkeypatch.setattr(PairTracker, "begin_check", watched)
    assert len(scene.front.module2(scene.graph, estimate)) == 1
    learned = Correction(scale=0.1, turn=0.4), Correction()
    assert seen == [learned if algorithm == "drslamd" and converged else None]


def test_a_range_is_sampled_each_second_between_keyframes_of_both() -> None:
    scene = FrontScene()
    scene.drive(5)
    (sample,) = scene.sample_ranges()
    assert sample.peer == Chain(1, 1)
    at = {scene.last_keyframe, scene.last_keyframe - 10}
    assert {sample.a_n, sample.b_n} <= at
    # the median of the ten ranges of the last second
    middle = scene.last_range / GRID_US - 4.5
    assert sample.range_m == pytest.approx(scene.distances(middle), abs=0.002)
    assert scene.sample_ranges() == []
    scene.drive(1)
    assert len(scene.sample_ranges()) == 1
