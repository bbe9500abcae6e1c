"""Where peers may be, in numbers and in a sentence."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given, settings
from message_strategies import hypotheses

from drslamd.gossip.message_types import Hypotheses
from drslamd.reports.hypothesis_report import rows
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, DecidingMotion
from drslamd.slam.hypotheses.places_left import PossiblePlace

KNOWN = (0.04, 0.0, 0.0, 0.01, 0.0, math.radians(5) ** 2)
HERE = (10.0, 0.0, math.pi / 2)
"""We look along y."""
BOTH = (math.radians(30), math.radians(150))


def place(x: float, y: float, share: float, peer: int = 2) -> PossiblePlace:
    """Ahead of us by x and to the left by y, heading as we do."""
    pose = (10.0 - y, x, math.pi / 2)
    return PossiblePlace(peer, 3_000_000, share, pose, KNOWN)


def of(*places: PossiblePlace, motion: DecidingMotion | None = None) -> list[dict[str, Any]]:
    motions = () if motion is None else (motion,)
    return rows(Hypotheses(3_500_000, HERE, places, motions), 1, 4_200_000)


def what(*places: PossiblePlace, motion: DecidingMotion | None = None) -> str:
    (row,) = of(*places, motion=motion)
    return str(row["what"])


def advice(
    left: tuple[float, float] = BOTH,
    right: tuple[float, float] = BOTH,
    mover: int = 1,
    leaves: int = 1,
) -> str:
    """What is said after the places."""
    motion = DecidingMotion(2, mover, 1.5, left, right, leaves)
    places = [place(3.0, y, 0.25) for y in (-3.0, 3.0)]
    return what(*places, motion=motion).partition("; ")[2]


def test_where_nothing_is_said_there_are_no_rows() -> None:
    assert rows(None, 1, 0) == []
    assert rows(Hypotheses(0, HERE), 1, 0) == []


@settings(derandomize=True, max_examples=50, deadline=None)
@given(hypotheses)
def test_whatever_can_be_said_without_a_key_is_sentences(said: Hypotheses) -> None:
    for row in rows(said, 1, 0):
        json.dumps(row, allow_nan=False)
        assert row["what"].startswith(f"robot {row['robot']} is ")


def test_numbers_are_seen_from_where_we_are_now() -> None:
    motion = DecidingMotion(2, 1, 1.5, BOTH, NO_TURN, 1)
    (row,) = of(place(3.0, 1.0, 0.75), place(-3.0, 0.0, 0.25), motion=motion)
    assert row["robot"] == 2
    assert row["age_s"] == 1.2
    assert row["places"] == [
        {
            "share": 0.75,
            "x_m": 3.0,
            "y_m": 1.0,
            "theta_deg": 0.0,
            "sigma_m": 0.2,
            "sigma_deg": 5.0,
        },
        {**row["places"][0], "share": 0.25, "x_m": -3.0, "y_m": 0.0},
    ]
    assert row["motion"] == {
        "robot": 1,
        "way_m": 1.5,
        "turn_left_deg": [30, 150],
        "turn_right_deg": None,
        "leaves": 1,
    }
    json.dumps(row, allow_nan=False)


def test_each_peer_has_a_row() -> None:
    both = of(place(1.0, 0.0, 1.0, peer=4), place(3.0, 1.0, 0.6), place(3.0, -1.0, 0.4))
    assert [(row["robot"], len(row["places"])) for row in both] == [(4, 1), (2, 2)]


def test_several_places_are_listed_with_what_they_are_worth() -> None:
    said = what(place(3.0, 0.0, 0.64), place(-3.0, 3.0, 0.357), place(0.0, -2.0, 0.003))
    assert said == (
        "robot 2 is at one of 3 places: 3.0 m ahead (64 %), 4.2 m behind on the left (36 %) or "
        "2.0 m on the right (hardly); no straight way of up to 8 m decides: both drive curves"
    )


def test_places_on_one_side_are_told_by_their_bearing() -> None:
    said = what(place(3.0, 0.3, 0.996), place(4.0, -0.4, 0.004))
    assert "3.0 m 6 degrees to the left (nearly sure) or 4.0 m 6 degrees to the right" in said


def test_a_single_place_waits_for_other_windows() -> None:
    assert what(place(2.0, 2.0, 1.0)) == (
        "robot 2 is 2.8 m ahead on the left, if the next windows agree"
    )


@pytest.mark.parametrize(
    ("left", "right", "turn"),
    [
        (BOTH, BOTH, "turn left or right by 30 to 150 degrees and drive 1.5 m"),
        (BOTH, NO_TURN, "turn left by 30 to 150 degrees and drive 1.5 m"),
        (NO_TURN, BOTH, "turn right by 30 to 150 degrees and drive 1.5 m"),
        (
            BOTH,
            (math.radians(90), math.pi),
            "turn left by 30 to 150 degrees or right by 90 degrees or more and drive 1.5 m",
        ),
        ((0.0, 1.0), (0.0, 0.6), "drive 1.5 m straight on"),
        ((0.0, 1.0), NO_TURN, "turn left by up to 57 degrees and drive 1.5 m"),
        (NO_TURN, (0.0, 1.0), "turn right by up to 57 degrees and drive 1.5 m"),
    ],
)
def test_the_advice_says_how_to_turn(
    left: tuple[float, float], right: tuple[float, float], turn: str
) -> None:
    assert advice(left, right) == f"to decide, {turn}"


def test_the_advice_says_who_is_to_drive_and_what_is_left_then() -> None:
    assert advice(mover=2, leaves=2) == (
        "to decide, let robot 2 turn left or right by 30 to 150 degrees and drive 1.5 m, "
        "that leaves two at most"
    )
