"""Keys that a tape tells better."""

from __future__ import annotations

import pytest
from wheel_sections import COUNTS, SPEEDS, TWIST, wheels

from drslamd.config_wheels import WheelSection
from drslamd.setup.wheel_scales import (
    as_configured,
    has_two_sides,
    keys_instead,
    path_variance,
    reverse_key,
    scale_key,
    step_m,
    swap_remedy,
    track_key,
)


@pytest.mark.parametrize(
    ("section", "step"),
    [
        (wheels("kobuki"), 1 / 11_724.4),
        (wheels("roboteq"), 0.0005),
        (wheels("ascii"), 0.01),
        (wheels("odrive"), 0.0),
        (wheels("agilex"), 0.001),
        (wheels("wheeltec"), None),
        (COUNTS, 0.0025),
        (SPEEDS, None),
        (TWIST, None),
    ],
)
def test_a_count_is_as_long_as_it_is_configured(section: WheelSection, step: float | None) -> None:
    assert step_m(section) == (None if step is None else pytest.approx(step))


def test_two_readings_of_a_counter_are_each_off_by_up_to_half_a_count() -> None:
    # variance of an even spread over a count of 1 cm, twice
    assert path_variance(wheels("ascii"), 3.0) == pytest.approx(2 * 0.01**2 / 12)
    assert path_variance(SPEEDS, 3.0) == pytest.approx(0.03**2)


@pytest.mark.parametrize(
    ("section", "key"),
    [
        (wheels("roboteq"), "wheels.counts_per_metre = 2500.0"),
        (wheels("odrive"), "wheels.wheel_radius_m = 0.08"),
        (COUNTS, "wheels.counts_per_metre = 500.0"),
        (SPEEDS, "wheels.unit = 0.0008"),
        (wheels("agilex"), ""),
    ],
)
def test_ways_of_four_fifths_have_a_key(section: WheelSection, key: str) -> None:
    assert scale_key(section, 0.8) == key


def test_longer_turns_are_those_of_a_narrower_track() -> None:
    assert track_key(wheels("roboteq"), 1.25) == "wheels.track_m = 0.4"


def test_keys_that_say_the_same_count_what_mends_the_counts_once() -> None:
    # counts say 1 m for 0.8 m; turns are right all the same, so the track is 0.8 of what it was
    assert keys_instead(wheels("roboteq"), 0.2, 0.0) == [
        "wheels.counts_per_metre = 2500.0",
        "wheels.track_m = 0.4",
    ]
    assert keys_instead(wheels("roboteq"), None, 0.25) == ["wheels.track_m = 0.4"]
    assert keys_instead(wheels("agilex"), 0.2, None) == []
    assert keys_instead(wheels("agilex"), 0.2, 0.25) == ["wheels.track_m = 0.48"]


def test_a_side_that_counts_the_wrong_way_is_turned_round_from_what_it_is() -> None:
    assert reverse_key(wheels("kobuki"), "left") == "wheels.reverse_left = true"
    turned = wheels("kobuki", reverse_right=True)
    assert reverse_key(turned, "right") == "wheels.reverse_right = false"


@pytest.mark.parametrize(
    ("section", "remedy"),
    [
        (wheels("roboteq"), "set wheels.swap_channels = true"),
        (wheels("roboteq", swap_channels=True), "set wheels.swap_channels = false"),
        (wheels("odrive"), "set wheels.left_axis = 5 and wheels.right_axis = 3"),
        (COUNTS, "exchange wheels.left and wheels.right"),
        (TWIST, "turn the sign of wheels.angular in the DBC file"),
        (wheels("ascii"), "exchange both counters in the line that the base prints"),
        (wheels("kobuki"), "exchange the plugs of both wheels"),
    ],
)
def test_swapped_sides_have_a_remedy(section: WheelSection, remedy: str) -> None:
    assert swap_remedy(section) == remedy


def test_only_what_says_a_twist_has_no_sides() -> None:
    assert not has_two_sides(TWIST)
    assert not has_two_sides(wheels("wheeltec"))
    assert scale_key(wheels("wheeltec"), 1.25) == ""
    assert all(has_two_sides(w) for w in (COUNTS, SPEEDS, wheels("agilex"), wheels("kobuki")))


def test_a_port_is_nothing_that_a_measurement_belongs_to() -> None:
    assert as_configured(wheels("roboteq", baud=9600, poll_hz=5.0)) == as_configured(
        wheels("roboteq", port="/q")
    )
    assert as_configured(wheels("roboteq"))["counts_per_metre"] == 2000.0
