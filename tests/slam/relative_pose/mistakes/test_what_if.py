"""One window under each mistake: wheels are counted one by one, some of them wrongly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from slam_scenes import EXACT, NOISE, Array, product

from drslamd.conventions import GRID_US, SECOND_US, Chain
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry import mounting
from drslamd.slam.odometry.mounting import (
    AS_CONFIGURED,
    COARSE_SCALES,
    CURVES,
    FINER,
    MIRRORED,
    SCALES,
    SIDES,
    TRACKS,
    Fault,
    Repair,
)
from drslamd.slam.odometry.track import Track
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.mistakes import what_if
from drslamd.slam.relative_pose.mistakes.evidence import CLEAR
from drslamd.slam.relative_pose.mistakes.what_if import (
    CASES,
    MIRROR,
    OUTPOSTS,
    Case,
    Question,
    WindowTrack,
    ask,
    variants,
)
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.window_request import WindowRequest, WindowRule, request
from drslamd.slam.robot_model import RobotModel

HALF_M = 0.15
SAMPLES = 400
RULE = WindowRule(60 * SECOND_US, SECOND_US, 2 * SECOND_US, drops_blocked=False)
PAIR_NOISE = PairNoise(RangeNoise(0.1, 0.1), NOISE, NOISE)
DELTA = 0.2
AHEAD_US = 7 * GRID_US + 40_000
"""The clock of b is ahead, and its samples are made between those of a."""


def wheels(seed: int) -> tuple[Array, Array]:
    """How far each wheel really goes in each tenth of a second, m, in curves to both sides."""
    rng = np.random.default_rng(seed)
    turn = np.convolve(rng.normal(0, 0.15, SAMPLES + 20), np.ones(20) / 20, "valid")[:SAMPLES]
    turn += 0.04 * np.sin(np.arange(SAMPLES) / 30 + seed)
    return 0.05 - HALF_M * turn, 0.05 + HALF_M * turn


def driven(left: Array, right: Array, start: tuple[float, float, float], half_m: float) -> Array:
    poses = [np.array(start)]
    for d_left, d_right in zip(left, right, strict=True):
        way, turn = (d_left + d_right) / 2, (d_right - d_left) / (2 * half_m)
        chord = way * (math.sin(turn / 2) / (turn / 2) if turn else 1.0)
        moved = product(poses[-1], (0.0, 0.0, turn / 2), (chord, 0.0, 0.0))
        poses.append(np.append(moved[:2], poses[-1][2] + turn))
    return np.array(poses)


def counted(repair: Repair, left: Array, right: Array) -> Array:
    """(k, 3) odometry of wheels that have the fault which a repair is for."""
    if repair.cross:
        left, right = (-left, right) if repair.cross > 0 else (left, -right)
    elif repair.turn < 0:
        left, right = right, left
    elif repair.bend:
        turned = repair.bend * np.abs(left + right) / 2 * HALF_M
        left, right = left + turned, right - turned
    else:
        left, right = left / repair.way, right / repair.way
    track = repair.turn / repair.way if repair.turn > 0 and not repair.cross else 1.0
    return driven(left, right, (0.0, 0.0, 0.0), HALF_M * track)


@dataclass
class Pair:
    """Two robots whose ends a window is cut from."""

    request: WindowRequest
    a: PairEnd
    b: PairEnd

    @property
    def question(self) -> Question:
        return ask(self.request, self.a, self.b)


def end_of(robot: int, odometry: Array, half_track_m: float, ahead_us: int) -> PairEnd:
    track, data = Track(1_000), ChainData(Chain(robot, 1))
    data.take_model(0, RobotModel(EXACT, 0.1 * robot, 0.0, 0.0, half_track_m))
    for n, pose in enumerate(odometry):
        x, y, theta = (round(1e4 * float(v)) for v in pose)
        track.append(n, np.array([x, y, theta], dtype=float))
        if n % 10 == 0:
            data.add(Keyframe(n, 0, x, y, theta))
    return PairEnd(track, data, ahead_us)


@cache
def seen(
    a: Repair = AS_CONFIGURED, b: Repair = AS_CONFIGURED, half_track_m: float = HALF_M
) -> Pair:
    """Exact ranges between robots that have these faults."""
    of_a, of_b = wheels(1), wheels(2)
    truth = (
        driven(*of_a, start=(0.0, 0.0, 0.0), half_m=HALF_M),
        driven(*of_b, start=(5.0, 2.0, 1.0), half_m=HALF_M),
    )
    ranges = RangeBuffer()
    for n in range(10, SAMPLES - 10):
        tips = []
        for robot, path in enumerate(truth):
            at = n + robot * AHEAD_US / GRID_US
            pose = [np.interp(at, np.arange(len(path)), column) for column in path.T]
            tips.append(product(pose, (0.1 * robot, 0.0, 0.0))[:2])
        ranges.add(n * GRID_US, math.hypot(*(tips[1] - tips[0])))
    ends = (
        end_of(0, counted(a, *of_a), half_track_m, 0),
        end_of(1, counted(b, *of_b), half_track_m, AHEAD_US),
    )
    found = request(ranges, *ends, RULE)
    assert isinstance(found, WindowRequest)
    return Pair(found, *ends)


def best(pair: Pair, cases: tuple[Case, ...]) -> tuple[Case, Array]:
    costs = pair.question.costs(cases, PAIR_NOISE, DELTA)
    return cases[int(np.argmin(costs))], costs


@pytest.mark.parametrize(
    "true",
    [
        Case(),
        Case(a=SIDES[0]),
        Case(b=SIDES[1]),
        Case(a=TRACKS[0]),
        Case(b=TRACKS[-1]),
        Case(b=SCALES[0]),
        Case(SCALES[-1], SCALES[-1]),
        Case(a=CURVES[0]),
        Case(b=CURVES[-1]),
    ],
    ids=lambda case: "-".join(case.kind),
)
def test_a_window_fits_under_the_mistake_that_was_made_and_under_no_other_kind(true: Case) -> None:
    others = [case for case in CASES if case.kind != true.kind and case != true][::5]
    found, costs = best(seen(*true), (*others, true))
    assert found == true
    # ranges are exact, and have a sigma of 0.1 m; odometry is whole steps
    assert costs[-1] < 1.0
    assert costs[:-1].min() > costs[-1] + 20


@pytest.mark.parametrize("larger", [0.05, 0.1, 0.15])
def test_a_wheel_that_is_larger_than_the_other_is_one_and_none_that_runs_backwards(
    larger: float,
) -> None:
    """Of a base as narrow as any, 0.23 m: up to 37 degrees a metre."""
    unlike = Repair(Fault.CURVE, bend=larger / 0.23)
    costs = seen(b=unlike).question.costs(CASES, PAIR_NOISE, DELTA)
    assert CASES[int(costs.argmin())].b.fault is Fault.CURVE
    backwards = [place for place in what_if.BACKWARDS if np.isfinite(costs[place])]
    assert costs[backwards].min() > costs.min() + CLEAR


@pytest.mark.parametrize("whose", [0, 1])
def test_ranges_do_not_tell_which_of_two_robots_is_seen_in_a_mirror(whose: int) -> None:
    true = Case(a=MIRRORED) if whose == 0 else MIRROR
    found, costs = best(seen(*true), (Case(), MIRROR, Case(a=MIRRORED)))
    assert found.kind in (MIRROR.kind, Case(a=MIRRORED).kind)
    assert costs[1] == pytest.approx(costs[2], abs=0.2)
    assert costs[0] > costs[1] + 20


def test_of_all_that_is_tried_the_truth_is_best() -> None:
    found, costs = best(seen(b=SIDES[0]), CASES)
    assert found == Case(b=SIDES[0])
    assert costs.shape == (len(CASES),)
    assert np.sort(costs)[1] > 20


def test_who_is_as_configured_is_asked_a_part_of_the_cases_only() -> None:
    costs = seen().question.costs(CASES, PAIR_NOISE, DELTA, first=OUTPOSTS)
    asked = np.isfinite(costs)
    assert np.flatnonzero(asked).tolist() == list(OUTPOSTS)
    assert costs[asked] == pytest.approx(seen().question.costs(CASES, PAIR_NOISE, DELTA)[asked])


@pytest.mark.parametrize(("chance", "is_part"), [(-0.1, False), (0.1, True)])
def test_so_is_who_is_otherwise_by_chance_only(chance: float, is_part: bool) -> None:
    """And what is not asked then speaks neither for what is configured nor against it."""
    question = seen(b=TRACKS[1]).question
    costs = question.costs(CASES, PAIR_NOISE, DELTA)
    gain = costs[0] - costs[list(OUTPOSTS)].min()
    assert gain > 20
    told = question.costs(CASES, PAIR_NOISE, DELTA, OUTPOSTS, gain + chance)
    others = [place for place in range(len(CASES)) if place not in OUTPOSTS]
    assert told[list(OUTPOSTS)] == pytest.approx(costs[list(OUTPOSTS)])
    assert told[others] == pytest.approx(costs[0] if is_part else costs[others])


@pytest.mark.parametrize("true", [Case(b=SCALES[0]), Case(b=SCALES[-1]), Case(a=TRACKS[1])])
def test_where_one_of_these_is_better_all_cases_are_asked(true: Case) -> None:
    costs = seen(*true).question.costs(CASES, PAIR_NOISE, DELTA, first=OUTPOSTS)
    assert np.isfinite(costs).all()
    assert CASES[int(costs.argmin())] == true


@pytest.mark.parametrize("repair", SIDES)
def test_wheels_without_sides_have_none_that_run_backwards(repair: Repair) -> None:
    question = seen(half_track_m=0.0).question
    costs = question.costs((Case(), Case(a=repair), Case(b=repair), MIRROR), PAIR_NOISE, DELTA)
    assert np.isinf(costs).tolist() == [False, True, True, False]


def test_where_a_track_has_a_hole_nothing_fits() -> None:
    pair = seen()
    question = pair.question
    question.b.poses[100] = np.nan
    assert np.isinf(question.costs((Case(), MIRROR), PAIR_NOISE, DELTA)).all()
    # the pair itself is as it was
    assert np.isfinite(pair.question.costs((Case(),), PAIR_NOISE, DELTA)).all()


def test_a_hole_beside_a_measurement_is_no_hole_of_its_own() -> None:
    """Where a measurement falls on a pose, what follows that may be unknown."""
    poses = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [np.nan] * 3])
    ends = (WindowTrack(poses, np.array([0.5, last]), 1.0, HALF_M) for last in (2.0, 2.001))
    known, unknown = (end.repaired([AS_CONFIGURED]) for end in ends)
    assert known[AS_CONFIGURED] == pytest.approx(np.array([[-0.05, 0, 0], [0.1, 0, 0]]))
    assert not unknown


def test_as_configured_a_window_is_what_it_was() -> None:
    pair = seen()
    question, window = pair.question, pair.request.window
    for stretch, poses in ((question.a, window.a_poses), (question.b, window.b_poses)):
        repaired = stretch.repaired([AS_CONFIGURED])
        assert np.allclose(repaired[AS_CONFIGURED], poses, atol=1e-9)
        assert len(stretch.at) == len(window.t)
    assert question.window is window
    assert question.b.half_track_m == HALF_M


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_the_whole_track_is_repaired_and_not_only_its_places_in_the_window(scale: float) -> None:
    """Where turns are longer, chords between measurements a second apart are not."""
    repair = Repair(TRACKS[0].fault, turn=scale)
    question = seen().question
    poses = question.a.poses
    (path,) = mounting.paths([repair], poses, HALF_M)
    repaired = question.a.repaired([MIRRORED, repair])[repair]
    at, reference = question.a.at, question.a.reference
    for k in (0, len(at) // 2, len(at) - 1):
        there = [np.interp(at[k], np.arange(len(path)), column) for column in path.T]
        origin = [np.interp(reference, np.arange(len(path)), column) for column in path.T]
        cos, sin = math.cos(origin[2]), math.sin(origin[2])
        dx, dy = there[0] - origin[0], there[1] - origin[1]
        expected = [cos * dx + sin * dy, cos * dy - sin * dx, there[2] - origin[2]]
        assert repaired[k] == pytest.approx(expected, abs=1e-9)


def test_a_question_counts_the_way_of_who_drove_less() -> None:
    pair = seen(b=SCALES[-1])
    question = pair.question
    ways = [
        float(np.hypot(*np.diff(stretch.poses[:, :2], axis=0).T).sum())
        for stretch in (question.a, question.b)
    ]
    # counts of b are half of what they should be
    assert ways[1] == pytest.approx(ways[0] / 2, rel=0.05)
    assert question.way_m == pytest.approx(ways[1])
    assert 15 < ways[0] < 20
    question.b.poses[100] = np.nan
    assert question.way_m == pytest.approx(ways[1], rel=0.01)


def test_a_question_is_of_the_tracks_as_they_were_asked() -> None:
    pair = seen()
    question = pair.question
    before = question.a.poses.copy()
    for track in (pair.a.track, pair.b.track):
        track.append(track.end, np.array([9e6, 9e6, 0.0]))
    assert np.array_equal(question.a.poses, before)
    assert np.array_equal(pair.question.a.poses, before)


def test_cases_begin_with_the_configuration_and_its_mirror_image_and_name_each_only_once() -> None:
    assert CASES[:2] == (Case(), MIRROR)
    assert len(set(CASES)) == len(CASES)
    each = (*SIDES, *TRACKS, *SCALES, *CURVES)
    for repair in each:
        assert Case(a=repair) in CASES
        assert Case(b=repair) in CASES
    both = {case for case in CASES if AS_CONFIGURED not in case}
    assert both == {Case(repair, repair) for repair in COARSE_SCALES}


def test_the_cases_that_are_asked_first_lie_around_the_configuration() -> None:
    outposts = [CASES[place] for place in OUTPOSTS]
    assert outposts[0] == Case()
    for repair in (*SIDES, *TRACKS):
        assert Case(a=repair) in outposts
        assert Case(b=repair) in outposts
    scales = {case.b.way for case in outposts if case.b.fault is Fault.SCALE}
    assert scales == {0.67, 0.8, 1.25, 1.5}
    bends = {case.b.bend for case in outposts if case.b.fault is Fault.CURVE}
    assert bends == {-math.radians(4), math.radians(4)}
    assert not any(AS_CONFIGURED not in case for case in outposts)


def test_cases_of_one_kind_differ_in_a_factor_only() -> None:
    assert Case(a=TRACKS[0]).kind == Case(a=TRACKS[1]).kind
    assert Case(a=TRACKS[0]).kind != Case(b=TRACKS[0]).kind
    assert Case(a=TRACKS[0]).kind != Case(a=SCALES[0]).kind
    assert Case(a=SIDES[0]).kind != Case(a=SIDES[1]).kind


def test_a_mistake_is_tried_a_little_smaller_and_larger_itself_first() -> None:
    found = variants(Case(b=TRACKS[0]))
    assert found[0] == Case(b=TRACKS[0])
    assert {case.a for case in found} == {AS_CONFIGURED}
    assert [case.b for case in found[:9]] == list(TRACKS[0].variants())
    assert len(variants(Case(SCALES[0], SCALES[0]))) == 81
    assert variants(MIRROR) == (MIRROR,)
    assert what_if.variants(Case()) == (Case(),)


def test_a_track_is_tried_as_a_scale_that_turns_as_much_and_a_scale_as_a_track() -> None:
    """Once each: the tracks are among what is a little smaller and larger already."""
    turns = [TRACKS[0].turn * factor for factor in (1.0, 1 / FINER, FINER)]
    scales = [Repair(Fault.SCALE, turn, turn) for turn in turns]
    assert [case.b for case in variants(Case(b=TRACKS[0]))[9:]] == scales
    turns = [SCALES[0].turn * factor for factor in (1.0, 1 / FINER, FINER)]
    of_scale = [case.a for case in variants(Case(a=SCALES[0]))]
    assert of_scale[9:] == [Repair(Fault.TRACK, turn=turn) for turn in turns]
