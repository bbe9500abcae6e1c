"""What a tape says, worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from wheel_sections import SPEEDS, TWIST, wheels

from drslamd.config_wheels import WheelSection
from drslamd.sensors.samples import RangeSample
from drslamd.setup.taped_steps import (
    LEAST_RANGES,
    Mistake,
    bias_of_distance,
    scale_of_push,
    turn_implied,
    turn_of_turns,
)
from drslamd.setup.way import Way
from drslamd.slam.graph.estimate import Learned
from drslamd.slam.range_model import LINKTRACK

FINE = wheels("roboteq", counts_per_metre=1e6)
COARSE = wheels("ascii")  # a count is a centimetre


def way(left: float, right: float, track: float = 0.5) -> Way:
    turn = (right - left) / track
    distance = (left + right) / 2
    chord = distance * (math.sin(turn / 2) / (turn / 2) if turn else 1.0)
    return Way(distance, turn, chord, track)


def learned(outcome: object) -> Learned:
    assert isinstance(outcome, Learned), outcome
    return outcome


def sentence(outcome: object) -> str:
    assert isinstance(outcome, Mistake), outcome
    return outcome.sentence


# push


def test_wheels_that_say_a_metre_and_a_quarter_for_a_metre_are_a_fifth_too_long() -> None:
    scale = learned(scale_of_push(way(1.25, 1.25), 1.0, FINE))
    assert scale.value == pytest.approx(0.2)
    assert scale.sigma == pytest.approx(0.005 / 1.25, rel=1e-3)  # the tape alone


def test_a_longer_push_is_surer() -> None:
    assert learned(scale_of_push(way(4.0, 4.0), 4.0, FINE)).sigma == pytest.approx(
        0.00125, rel=1e-3
    )


def test_coarse_counts_and_a_bend_make_it_less_sure() -> None:
    # two counters of 1 cm, read twice each: the mean of both is off by 1 cm / sqrt(12)
    counts = learned(scale_of_push(way(1.0, 1.0), 1.0, COARSE)).sigma
    assert counts == pytest.approx(math.hypot(0.005, 0.01 / math.sqrt(12)))
    bend = learned(scale_of_push(way(0.97, 1.03), 1.0, FINE)).sigma
    assert bend == pytest.approx(math.hypot(0.005, 0.06 / math.sqrt(12)), rel=0.01)
    speeds = learned(scale_of_push(way(1.0, 1.0), 1.0, SPEEDS)).sigma
    assert speeds == pytest.approx(math.hypot(0.005, 0.01 / math.sqrt(2)))


def test_sigmas_are_those_of_drawn_errors() -> None:
    """Tape, counts and the place of the tape, drawn 20 000 times for a push of a metre."""
    draw, n = np.random.default_rng(5), 20_000
    true_left, true_right = 1.02, 0.98
    offset = draw.uniform(0, 0.01, (2, n))  # of the counters when it begins
    said = [
        np.floor((np.array(true) + o) / 0.01) * 0.01 - np.floor(o / 0.01) * 0.01
        for true, o in zip((true_left, true_right), offset, strict=True)
    ]
    side = draw.uniform(-0.02, 0.02, n)
    tape = 1.0 + side + draw.normal(0, 0.005, n)
    spread = np.std(1 - tape / ((said[0] + said[1]) / 2))
    sigma = learned(scale_of_push(way(true_left, true_right), 1.0, COARSE)).sigma
    assert sigma == pytest.approx(spread, rel=0.1)


@pytest.mark.parametrize(
    ("left", "right", "says"),
    [
        (0.04, 0.04, "it ended where it began (left 0.040 m, right 0.040 m)"),
        (0.98, 0.01, "the right wheel stood"),
        (-0.02, 0.98, "the left wheel stood"),
        (-0.98, 1.0, "the left wheel counts backwards"),
        (0.98, -1.0, "set wheels.reverse_right = true"),
        (-0.98, -1.0, "set wheels.reverse_left = true and wheels.reverse_right = true"),
        (0.9, 1.1, "as if it had turned 23 degrees to the left: push along a line"),
        (0.5, 0.5, "the wheels say 0.50 m: push it 1 m; if you did, set wheels.counts_per_metre"),
        (2.0, 2.0, "set wheels.counts_per_metre = 2000000.0"),
    ],
)
def test_a_push_that_can_only_be_a_mistake_is_told_which(
    left: float, right: float, says: str
) -> None:
    assert says in sentence(scale_of_push(way(left, right), 1.0, FINE))


@pytest.mark.parametrize(
    ("left", "right"),
    [(0.6, 0.6), (1.74, 1.74), (0.94, 1.06), (1.06, 0.94)],
)
def test_what_lies_within_the_bounds_is_measured(left: float, right: float) -> None:
    learned(scale_of_push(way(left, right), 1.0, FINE))


def test_a_base_without_sides_is_told_without_them() -> None:
    assert "went back" in sentence(scale_of_push(Way(-1.0, 0.0, -1.0, 0.5), 1.0, TWIST))
    assert "ended where it began" in sentence(scale_of_push(Way(0.0, 0.2, 0.0, 0.5), 1.0, TWIST))
    learned(scale_of_push(Way(1.0, 0.0, 1.0, 0.5), 1.0, TWIST))


# turn


def spin(degrees: float, track: float = 0.5) -> Way:
    arc = math.radians(degrees) * track / 2
    return way(-arc, arc, track)


def test_wheels_that_say_300_degrees_for_a_turn_stand_nearer_than_configured() -> None:
    turn = learned(turn_of_turns(spin(300), 1.0, FINE))
    assert turn.value == pytest.approx(0.2)
    # 5 mm at a quarter of a metre, of 300 degrees
    assert turn.sigma == pytest.approx(0.02 / math.radians(300), rel=1e-3)
    assert learned(turn_of_turns(spin(1080), 3.0, FINE)).sigma == pytest.approx(
        0.02 / (6 * math.pi), rel=1e-3
    )


def test_coarse_counts_make_a_turn_less_sure() -> None:
    # the difference of two counters, read twice each: 1 cm / sqrt(3), over the track
    turn = learned(turn_of_turns(spin(360), 1.0, COARSE))
    counts = 0.01 / math.sqrt(3) / 0.5
    assert turn.sigma == pytest.approx(math.hypot(0.02, counts) / (2 * math.pi))


@pytest.mark.parametrize(
    ("turned", "says"),
    [
        (way(-0.01, 0.01), "it hardly turned"),
        (way(-0.02, 1.5), "the left wheel stood"),
        (way(1.5, 1.6), "both wheels ran the same way"),
        (spin(-355), "it turned right by 355 degrees"),
        (spin(-355), "left and right are swapped: set wheels.swap_channels = true"),
        (
            spin(180),
            "the wheels say 180 degrees: turn it by 360 degrees; if you did, set wheels",
        ),
        (spin(720), "set wheels.track_m = 1.0"),
    ],
)
def test_a_turn_that_can_only_be_a_mistake_is_told_which(turned: Way, says: str) -> None:
    assert says in sentence(turn_of_turns(turned, 1.0, FINE))


@pytest.mark.parametrize("base", [TWIST, FINE], ids=["twist", "sides"])
def test_no_way_at_all_divides_nothing_by_nothing(base: WheelSection) -> None:
    nothing = Way(0.0, 0.0, 0.0, 0.5)
    assert sentence(scale_of_push(nothing, 1.0, base))
    assert sentence(turn_of_turns(nothing, 1.0, base))
    assert sentence(turn_of_turns(Way(3.0, 0.0, 3.0, 0.5), 1.0, TWIST))


def test_counts_that_say_too_much_say_it_in_turns_too_but_less_surely() -> None:
    assert turn_implied(Learned(0.02, 0.006)) == Learned(-0.02, math.hypot(0.006, 0.05))


# apart


def ranges(values: list[float], gap_db: float = 3.0) -> list[RangeSample]:
    return [RangeSample(20_000 * k, 4, r, gap_db) for k, r in enumerate(values)]


def test_ranges_that_are_longer_than_the_tape_are_biased() -> None:
    bias = learned(bias_of_distance(ranges([3.1, 3.2] * 50 + [3.15]), 3.0, 10.0, LINKTRACK))
    assert bias.value == pytest.approx(0.15)
    # bearing 7 cm, near range of the pair 0.2 exp(-2) and of the team 0.05 exp(-1), tape 5 mm,
    # 101 ranges that are worth ten and scatter by 1.4826 * 0.05
    noise = 1.4826 * 0.05 / math.sqrt(10.1)
    assert bias.sigma == pytest.approx(
        math.hypot(0.07, 0.2 * math.exp(-2), 0.05 * math.exp(-1), 0.005, noise), rel=1e-6
    )


def test_one_range_that_went_astray_moves_nothing() -> None:
    straight = learned(bias_of_distance(ranges([3.1] * 60), 3.0, 10.0, LINKTRACK))
    astray = learned(bias_of_distance(ranges([3.1] * 60 + [90.0]), 3.0, 10.0, LINKTRACK))
    assert astray.value == pytest.approx(straight.value)


@pytest.mark.parametrize(
    ("values", "gap_db", "says"),
    [
        ([3.0] * (LEAST_RANGES - 1), 3.0, "only 29 ranges came"),
        ([3.0] * 60, 10.1, "the direct path is blocked"),
        ([2.8, 3.0, 3.2] * 20, 3.0, "the ranges scatter by 0.30 m"),
        ([4.2] * 60, 3.0, "the modules say 4.20 m where the tape says 3.00 m"),
    ],
)
def test_ranges_that_say_nothing_of_a_bias_are_told_why(
    values: list[float], gap_db: float, says: str
) -> None:
    assert says in sentence(bias_of_distance(ranges(values, gap_db), 3.0, 10.0, LINKTRACK))


def test_what_is_just_good_enough_is_measured() -> None:
    learned(bias_of_distance(ranges([3.0] * LEAST_RANGES, 10.0), 3.0, 10.0, LINKTRACK))
    learned(bias_of_distance(ranges([3.99] * 60, 30.0), 3.0, 0.0, LINKTRACK))
    learned(bias_of_distance(ranges([2.9, 3.0, 3.1] * 20), 3.0, 10.0, LINKTRACK))
