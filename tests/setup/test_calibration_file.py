"""The file of what a tape said."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drslamd.config import Config, parse
from drslamd.setup.calibration_file import Taped, UnusableCalibration, read, text
from drslamd.setup.wheel_scales import as_configured
from drslamd.slam.calibration.sensor_calibration import UNLEARNED
from drslamd.slam.graph.estimate import Learned

TOML = """
robot.id = 3
team.insecure = true
uwb.port = "/dev/uwb"
wheels.source = "roboteq"
wheels.port = "/dev/wheels"
wheels.counts_per_metre = 1000.0
wheels.track_m = 0.5
"""


def config(**changes: str) -> Config:
    changed = TOML
    for old, new in changes.items():
        changed += f"wheels.{old} = {new}\n"
    return parse(changed)


def taped() -> Taped:
    return Taped(
        3,
        as_configured(config().wheels),
        Learned(0.02, 0.006),
        Learned(-0.1, 0.01),
        {4: Learned(0.11, 0.08), 250: Learned(-0.2, 0.09)},
    )


def refused(file_text: str) -> str:
    with pytest.raises(UnusableCalibration) as error:
        read(file_text)
    return str(error.value)


def test_what_is_written_is_read() -> None:
    assert read(text(taped())) == taped()
    assert read(text(Taped(0))) == Taped(0)


def test_what_was_measured_is_what_a_robot_starts_with() -> None:
    known = taped().calibration(config())
    assert known.scale == Learned(0.02, 0.006)
    assert known.turn == Learned(-0.1, 0.01)
    assert known.bias == {4: Learned(0.11, 0.08), 250: Learned(-0.2, 0.09)}
    assert known.yaw == UNLEARNED.yaw


def test_a_push_alone_says_something_of_turns_too() -> None:
    known = replace(taped(), turn=None).calibration(config())
    assert known.turn == Learned(-0.02, math.hypot(0.006, 0.05))
    assert Taped(3, biases={4: Learned(0.1, 0.1)}).calibration(config()).scale == UNLEARNED.scale


def test_a_file_of_another_robot_is_refused() -> None:
    with pytest.raises(UnusableCalibration, match="it is of robot 5, not 3"):
        replace(taped(), robot=5).calibration(config())


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("swap_channels", "true", "wheels.swap_channels = false, which is now true"),
        ("reverse_left", "true", "wheels.reverse_left = false, which is now true"),
    ],
)
def test_a_file_of_other_wheels_is_refused_with_the_key(key: str, value: str, says: str) -> None:
    with pytest.raises(UnusableCalibration, match=says):
        taped().calibration(config(**{key: value}))
    without = replace(taped(), push=None, turn=None)
    assert without.calibration(config(**{key: value})).bias == taped().biases


def test_a_port_may_change_and_a_track_may_not() -> None:
    moved = parse(TOML.replace("/dev/wheels", "/dev/other") + "wheels.baud = 57600\n")
    assert taped().calibration(moved).scale.value == 0.02
    with pytest.raises(UnusableCalibration, match=r"track_m = 0\.5, which is now 0\.6"):
        taped().calibration(parse(TOML.replace("track_m = 0.5", "track_m = 0.6")))


def test_a_new_measurement_forgets_those_with_other_wheels_and_keeps_biases() -> None:
    assert taped().with_wheels(config()) == taped()
    anew = taped().with_wheels(config(reverse_left="true"))
    assert (anew.push, anew.turn, anew.biases) == (None, None, taped().biases)
    assert anew.wheels["reverse_left"] is True


GOOD = "[robot]\nid = 3\n"


@pytest.mark.parametrize(
    ("file_text", "says"),
    [
        ("", "robot.id: missing"),
        ("[robot]\nid = 255\n", "robot.id: missing, or no id of a robot"),
        ("[robot]\nid = true\n", "robot.id: missing, or no id of a robot"),
        ("[robot\n", "not valid TOML"),
        ("x = " + "9" * 5000, "not valid TOML: a number"),
        ("x = " + "[" * 2000, "not valid TOML"),
        (GOOD + "[pull]\n", "'pull': unknown section"),
        ("push = 3\n" + GOOD, "push: a section"),
        (GOOD + "[push]\nscale = 0.1\n", "push.sigma: a number, at least 0.0001 and at most 0.5"),
        (GOOD + "[push]\nscale = 0.1\nsigma = 0.00009\n", "push.sigma"),
        (GOOD + "[push]\nscale = 0.1\nsigma = 0.51\n", "push.sigma"),
        (GOOD + "[push]\nscale = -0.76\nsigma = 0.01\n", "push.scale: a number, at least -0.75"),
        (GOOD + "[push]\nscale = 0.43\nsigma = 0.01\n", "push.scale"),
        (GOOD + "[push]\nscale = nan\nsigma = 0.01\n", "push.scale"),
        (GOOD + "[push]\nscale = true\nsigma = 0.01\n", "push.scale"),
        (GOOD + "[turn]\nturn = 0.76\nsigma = 0.01\n", "turn.turn"),
        (GOOD + "[turn]\nturn = -0.43\nsigma = 0.01\n", "turn.turn"),
        (GOOD + "[bias.255]\nbias_m = 0.1\nsigma_m = 0.1\n", "bias: its sections are named"),
        (GOOD + "[bias.4]\nbias_m = 1.01\nsigma_m = 0.1\n", "4.bias_m: a number, at least -1"),
        (GOOD + "[bias.4]\nbias_m = 'x'\nsigma_m = 0.1\n", "4.bias_m"),
    ],
)
def test_what_no_measurement_wrote_is_refused_in_one_sentence(file_text: str, says: str) -> None:
    said = refused(file_text)
    assert says in said
    assert said.endswith("; remove it and measure anew: drslamd calibrate")
    assert "\n" not in said


def test_numbers_at_their_bounds_are_read() -> None:
    known = read(
        GOOD
        + "[push]\nscale = -0.75\nsigma = 0.0001\n[turn]\nturn = 0.75\nsigma = 0.5\n"
        + "[bias.0]\nbias_m = -1\nsigma_m = 0.5\n"
    )
    assert (known.push, known.turn) == (Learned(-0.75, 1e-4), Learned(0.75, 0.5))
    assert known.biases == {0: Learned(-1.0, 0.5)}


@settings(max_examples=50)
@given(st.text(max_size=200), st.sampled_from(["", GOOD]))
def test_any_text_is_read_or_refused(anything: str, before: str) -> None:
    said = ""
    try:
        read(before + anything)
    except UnusableCalibration as error:
        said = str(error)
    assert said.isprintable()
