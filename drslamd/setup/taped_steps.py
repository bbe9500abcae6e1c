"""What a measured way, turn or distance says of wheels and antennas, and how surely.

Beside a tape of length d the wheels said the chord c. Then, as in `sensor_calibration`,

    scale = 1 - d / c                 turn = 2 pi turns / said - 1                bias = range - d

and what is uncertain about it:

* the tape: `TAPE_M`, also at the wheels when a robot is turned back onto its marks, which are half
  a track from its middle;
* counts: each of two readings is off by up to half a count (variance q^2 / 12 each), and both sides
  count;
* how straight it was: where a push ended turned a little, the tape says another length on the left
  than on the right, and nobody knows where it was held: evenly spread over the difference of both
  sides (variance of a width w: w^2 / 12);
* where ranges were measured: a bias is not the same at each bearing and distance (`BEARING_M`).

A measurement that can only be a mistake is not used: a sentence says which, and names the key that
mends it. Nothing is mended silently.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import Final, NamedTuple, Union

from drslamd.config_wheels import WheelSection
from drslamd.sensors.samples import RangeSample
from drslamd.setup.way import Way
from drslamd.setup.wheel_scales import (
    has_two_sides,
    path_variance,
    reverse_key,
    scale_key,
    swap_remedy,
    track_key,
)
from drslamd.slam.graph.estimate import Learned
from drslamd.slam.range_model import RangeModel

TAPE_M: Final = 0.005
MOST_FACTOR: Final = 1.75
"""Beyond this factor a key is wrong, or another way was gone than was asked for (half a turn). The
effective track of skid steering is often 1.5 times wider than the wheels stand."""
STOOD: Final = 0.1
"""A wheel that rolled less than this share of the other one stood."""
LEAST_SHARE: Final = 0.05
"""Of the way that was asked for; whoever ends nearer to the start went back."""
MOST_BEND_RAD: Final = math.radians(15)
"""Whoever pushes along a line stays within a third of this."""
TURNS_COUNT_SIGMA: Final = 0.05
"""How far the track may be off where only a push was measured."""
LEAST_RANGES: Final = 30
MOST_SCATTER_M: Final = 0.15
"""Ranges in free sight scatter by less than a decimetre."""
MOST_BIAS_M: Final = 1.0
"""Modules are off by decimetres; the tape or its number is wrong beyond it."""
BEARING_M: Final = 0.07
"""Biases move with the bearing by 4 to 10 cm (`range_model`)."""
CORRELATED: Final = 10
"""So many ranges in a row, a fifth of a second, know no more than one."""
MAD_TO_SIGMA: Final = 1.4826


class Mistake(NamedTuple):
    """Why a measurement is not used: one sentence, with what to do."""

    sentence: str


Outcome = Union[Learned, Mistake]


def scale_of_push(way: Way, metres: float, wheels: WheelSection) -> Outcome:
    """From a push straight ahead over `metres`."""
    mistake = _push_mistake(way, metres, wheels)
    if mistake:
        return Mistake(mistake)
    said, sides = way.chord_m, way.right_m - way.left_m
    counted = path_variance(wheels, said) / 2
    variance = (TAPE_M / said) ** 2 + (metres / said**2) ** 2 * (counted + sides**2 / 12)
    return Learned(1 - metres / said, math.sqrt(variance))


def turn_of_turns(way: Way, turns: float, wheels: WheelSection) -> Outcome:
    """From turning left on the spot, `turns` times."""
    mistake = _turn_mistake(way, turns, wheels)
    if mistake:
        return Mistake(mistake)
    said, true = way.turn_rad, 2 * math.pi * turns
    aligned = TAPE_M / (wheels.track_m / 2)
    side_m = said * wheels.track_m / 2
    counted = 2 * path_variance(wheels, side_m) / wheels.track_m**2
    variance = (aligned / said) ** 2 + (true / said**2) ** 2 * counted
    return Learned(true / said - 1, math.sqrt(variance))


def turn_implied(scale: Learned) -> Learned:
    """From a push alone: counts that say too much say it in turns too."""
    return Learned(-scale.value, math.hypot(scale.sigma, TURNS_COUNT_SIGMA))


def bias_of_distance(
    samples: Sequence[RangeSample], metres: float, nlos_db: float, model: RangeModel
) -> Outcome:
    """From ranges of one pair whose antennas are `metres` apart."""
    if len(samples) < LEAST_RANGES:
        return Mistake(
            f"only {len(samples)} ranges came: {LEAST_RANGES} are needed; is the other module on?"
        )
    ranges = [sample.range_m for sample in samples]
    middle = median(ranges)
    scatter = MAD_TO_SIGMA * median(abs(r - middle) for r in ranges)
    if nlos_db and median(s.power_gap_db for s in samples) > nlos_db:
        return Mistake("the direct path is blocked: let both antennas see each other")
    if scatter > MOST_SCATTER_M:
        return Mistake(
            f"the ranges scatter by {scatter:.2f} m: let both robots stand still, in free sight"
        )
    if abs(middle - metres) > MOST_BIAS_M:
        return Mistake(
            f"the modules say {middle:.2f} m where the tape says {metres:.2f} m: measure from "
            "antenna to antenna, and give it with --metres"
        )
    near = float(model.near_range_sigma(metres))
    team = model.near_bias_sigma_m * math.exp(-metres / model.near_reach_m)
    noise = scatter / math.sqrt(max(len(ranges) / CORRELATED, 1.0))
    return Learned(middle - metres, math.hypot(TAPE_M, noise, near, team, BEARING_M))


def _push_mistake(way: Way, metres: float, wheels: WheelSection) -> str:
    """Empty without one."""
    said = _sides(way)
    little = f"it ended where it began ({said}): push it {metres:g} m and leave it there"
    if max(abs(way.left_m), abs(way.right_m)) < LEAST_SHARE * metres:
        return little
    if has_two_sides(wheels):
        sides = {"left": way.left_m, "right": way.right_m}
        if stood := _stood(way):
            return f"the {stood} wheel stood ({said}): is its encoder connected?"
        back = [side for side, path in sides.items() if path < 0]
        keys = " and ".join(reverse_key(wheels, side) for side in back)
        if len(back) == 1:
            return f"the {back[0]} wheel counts backwards ({said}): set {keys}"
        if back:
            return f"both wheels went backwards ({said}): push ahead; if you did, set {keys}"
    elif way.distance_m < 0:
        return "the base says that it went back: push ahead; if you did, its speed has a wrong sign"
    if abs(way.turn_rad) > MOST_BEND_RAD:
        bend = math.degrees(way.turn_rad)
        return (
            f"the sides differ ({said}), as if it had turned {abs(bend):.0f} degrees "
            f"{_side(bend)}: push along a line; if you did, the wheels are not alike"
        )
    if way.chord_m < LEAST_SHARE * metres:
        return little
    return _factor_mistake(
        metres / way.chord_m,
        f"the wheels say {way.chord_m:.2f} m",
        f"push it {metres:g} m",
        scale_key(wheels, metres / way.chord_m),
    )


def _turn_mistake(way: Way, turns: float, wheels: WheelSection) -> str:
    """Empty without one."""
    said, asked = _sides(way), 2 * math.pi * turns
    little = f"it hardly turned ({said}): turn it by {360 * turns:g} degrees and leave it there"
    if max(abs(way.left_m), abs(way.right_m)) < LEAST_SHARE * asked * wheels.track_m / 2:
        return little
    if has_two_sides(wheels):
        if stood := _stood(way):
            return f"the {stood} wheel stood ({said}): turn about the middle of the robot"
        if way.left_m * way.right_m > 0:
            return (
                f"both wheels ran the same way ({said}): turn on the spot; if you did, one counts "
                "backwards, which drslamd calibrate push names"
            )
    degrees = math.degrees(way.turn_rad)
    if abs(way.turn_rad) < LEAST_SHARE * asked:
        return little
    if degrees < 0:
        return (
            f"it turned right by {-degrees:.0f} degrees: turn left, against the clock; if you did, "
            f"left and right are swapped: {swap_remedy(wheels)}"
        )
    longer = asked / way.turn_rad
    return _factor_mistake(
        longer,
        f"the wheels say {degrees:.0f} degrees",
        f"turn it by {360 * turns:g} degrees",
        track_key(wheels, longer),
    )


def _factor_mistake(longer: float, said: str, do: str, key: str) -> str:
    if 1 / MOST_FACTOR <= longer <= MOST_FACTOR:
        return ""
    remedy = f"set {key}" if key else "something is wrong with the base"
    return f"{said}: {do}; if you did, {remedy}"


def _stood(way: Way) -> str:
    """The side that did, empty if none."""
    left, right = abs(way.left_m), abs(way.right_m)
    if min(left, right) >= STOOD * max(left, right):
        return ""
    return "left" if left < right else "right"


def _sides(way: Way) -> str:
    return f"left {way.left_m:.3f} m, right {way.right_m:.3f} m"


def _side(angle: float) -> str:
    return "to the left" if angle > 0 else "to the right"
