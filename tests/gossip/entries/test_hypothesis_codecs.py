"""What no robot can have said of others is one phrase, and what it can have said is taken."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, cast

import pytest
from message_builders import COVARIANCE, HEADER, kinds

from drslamd.gossip import messages
from drslamd.gossip.message_types import MAX_MOTIONS, MAX_PLACES, Hypotheses
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, WAYS_M

SAID = cast(Hypotheses, kinds()["HYPOTHESES"])
(PLACE, _), (MOTION,) = SAID.places, SAID.motions


def answer(message: Hypotheses) -> Any:
    return messages.decode("HYPOTHESES", messages.encode(HEADER, message))


def placed(**other: Any) -> Hypotheses:
    return replace(SAID, places=(replace(PLACE, **other),))


def moved(**other: Any) -> Hypotheses:
    return replace(SAID, motions=(replace(MOTION, **other),))


@pytest.mark.parametrize(
    "said",
    [
        Hypotheses(0, (0.0, 0.0, 0.0)),
        replace(SAID, places=(PLACE,) * MAX_PLACES),
        replace(SAID, motions=(MOTION,) * MAX_MOTIONS),
        placed(share=0.0),
        placed(share=1.0),
        placed(peer=254),
        moved(left=NO_TURN, right=NO_TURN),
        moved(left=(0.0, math.pi)),
        moved(way_m=float(WAYS_M[-1])),
        moved(way_m=float(WAYS_M[0])),
        moved(leaves=1),
        moved(leaves=4),
    ],
    ids=repr,
)
def test_what_a_robot_can_have_said_is_taken(said: Hypotheses) -> None:
    assert isinstance(answer(said), Hypotheses)


@pytest.mark.parametrize(
    "lie",
    [
        replace(SAID, places=(PLACE,) * (MAX_PLACES + 1)),
        replace(SAID, motions=(MOTION,) * (MAX_MOTIONS + 1)),
        replace(SAID, odom_utime=-1),
        replace(SAID, odom=(math.nan, 0.0, 0.0)),
        replace(SAID, odom=(0.0, 2e6, 0.0)),
        placed(peer=255),
        placed(utime=-1),
        placed(share=-0.01),
        placed(share=1.01),
        placed(share=math.nan),
        placed(pose=(math.inf, 0.0, 0.0)),
        placed(pose=(0.0, 0.0, 4.0)),
        placed(covariance=(-1.0, *COVARIANCE[1:])),
        placed(covariance=(math.nan, *COVARIANCE[1:])),
        moved(peer=-1),
        moved(mover=255),
        moved(way_m=0.0),
        moved(way_m=8.1),
        moved(way_m=math.nan),
        moved(left=(1.0, 0.5)),
        moved(left=(-0.5, 0.5)),
        moved(right=(0.0, 3.2)),
        moved(right=(math.nan, 1.0)),
        moved(leaves=0),
        moved(leaves=5),
    ],
    ids=repr,
)
def test_what_no_robot_can_have_said_is_one_phrase(lie: Hypotheses) -> None:
    said = answer(lie)
    assert isinstance(said, str)
    assert said
