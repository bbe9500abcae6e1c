"""Sentences are read as people would: whom they are about, which key they name, is that right?"""

from __future__ import annotations

import pytest
from lab.trust import naming
from lab.trust.naming import Cause, Said

BOTH = frozenset({"wheels.reverse_left", "wheels.reverse_right"})
MIRRORED = Cause("wheel|odometr", keys=frozenset({BOTH}))
ENCODERS = Cause("wheel|odometr", "stand|stuck")


def said(sentence: str, robot: int = 2) -> Said:
    return Said(50.0, robot, sentence)


@pytest.mark.parametrize(
    ("sentence", "robots"),
    [
        ("the wheels say nothing", {2}),
        ("robot 1: its wheels run backwards", {1}),
        ("the odometry of robots 0 and 1 contradicts all ranges", {0, 1}),
        ("robots 0, 1 or 12 are mounted otherwise", {0, 1, 12}),
        ("this robot or robot 1 runs backwards", {1, 2}),
        ("2 of 3 closures of robot 0 agree", {0}),
    ],
)
def test_a_sentence_is_about_the_robots_that_it_names(sentence: str, robots: set[int]) -> None:
    assert naming.robots(said(sentence)) == robots


@pytest.mark.parametrize(
    ("sentence", "robot", "is_right"),
    [
        ("robot 1: set wheels.reverse_left = true and wheels.reverse_right = true", 2, True),
        ("set wheels.reverse_left = true and wheels.reverse_right = true", 1, True),
        ("robot 0 or robot 1: wheels.reverse_left and wheels.reverse_right", 0, True),
        ("robot 0: set wheels.reverse_left = true and wheels.reverse_right = true", 1, False),
        ("robot 1: set wheels.reverse_left = true", 2, False),
        ("robot 1: wheels.reverse_left, wheels.reverse_right, wheels.track_m", 2, False),
    ],
)
def test_a_name_is_right_with_all_its_keys_and_a_robot_at_fault(
    sentence: str, robot: int, is_right: bool
) -> None:
    heard, at_fault = said(sentence, robot), frozenset({1})
    assert naming.is_right(heard, MIRRORED, at_fault) is is_right
    assert MIRRORED.is_named(heard, at_fault) is is_right
    wrong = naming.wrong_names([heard], MIRRORED, at_fault)
    assert wrong == ([] if is_right else [heard])


def test_nothing_is_a_right_name_where_nobody_is_at_fault() -> None:
    heard = said("robot 1: wheels.track_m is wrong")
    assert naming.wrong_names([heard], naming.NO_CAUSE, frozenset()) == [heard]


@pytest.mark.parametrize(
    "sentence",
    [
        "not localised: no ranges to robots 1; are their modules on, and is uwb.id right?",
        "input, but no frame for 3 s: are wheels.source and wheels.baud right?",
        "the odometry of robot 1 contradicts all others",
    ],
)
def test_a_sentence_without_a_key_of_the_mounting_names_nothing(sentence: str) -> None:
    assert naming.keys(said(sentence)) == frozenset()
    assert naming.wrong_names([said(sentence)], naming.NO_CAUSE, frozenset()) == []


@pytest.mark.parametrize(
    ("sentence", "is_about", "is_named"),
    [
        ("the wheels of robot 1 are stuck", True, True),
        ("the odometry of robot 1 is doubted", True, False),
        ("ranges to robot 1 are blocked", False, False),
        ("not localised: no odometry yet", False, False),
        ("not localised: ranges and odometry disagree (with robot 1); drive curves", False, False),
        ("nothing from the wheels yet: check the power of the base and the cable", False, False),
    ],
)
def test_words_tell_whether_a_sentence_is_about_a_fault_and_names_it(
    sentence: str, is_about: bool, is_named: bool
) -> None:
    heard = said(sentence)
    assert ENCODERS.is_about(heard) is is_about
    assert ENCODERS.is_named(heard, frozenset({1})) is is_named


def test_where_nothing_may_be_said_nothing_is_about_it() -> None:
    assert not naming.NO_CAUSE.is_about(said("the wheels are stuck"))
    assert not naming.NO_CAUSE.is_named(said("the wheels are stuck"), frozenset())
