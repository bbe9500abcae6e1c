"""What a placing is asked, and what is told of its answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from resumed_scene import BEGAN, UNTIL, W_T_O, ResumedScene, driven, last, solved

from drslamd.conventions import SECOND_US
from drslamd.slam import se2
from drslamd.slam.relocation.placing import Placed
from drslamd.slam.relocation.question import (
    LATE_US,
    Found,
    closure,
    is_vague,
    known_until,
    last_keyframe,
    localised_peers,
)
from drslamd.slam.relocation.sightings import NONE

END_US = (UNTIL - 1) * 100_000
"""Of everybody's odometry."""


def test_only_peers_in_this_frame_with_a_clock_a_log_and_ranges_are_asked() -> None:
    scene = ResumedScene(last())

    def asked() -> list[int]:
        found = localised_peers(scene.neighbours, scene.ranges, scene.graph, solved())
        return [beacon.end.data.chain.robot for beacon in found]

    assert asked() == [0, 2]
    one, other = scene.neighbours
    for changed in (
        replace(one, frame=2),
        replace(one, frame=None),
        replace(one, ahead_us=None),
        replace(one, uwb_id=77),
        replace(one, chain=one.chain._replace(epoch=8)),
    ):
        scene.neighbours = [changed, other]
        assert asked() == [2]


@pytest.mark.parametrize(("late_us", "is_waited_for"), [(LATE_US - 1, True), (LATE_US, False)])
def test_odometry_of_peers_is_waited_for_and_not_for_long(
    late_us: int, is_waited_for: bool
) -> None:
    scene = ResumedScene(last())
    beacons = localised_peers(scene.neighbours, scene.ranges, scene.graph, solved())
    until = known_until(beacons, END_US + late_us)
    assert until == (END_US if is_waited_for else END_US + late_us - LATE_US)
    assert known_until([], 10 * SECOND_US) == 10 * SECOND_US - LATE_US


def test_a_closure_says_of_our_keyframe_what_was_found_of_the_odometry() -> None:
    """The peer's last keyframe stands at the origin; a turn moves it, seen from ours, by as much as
    it is away from where the place is known best."""
    scene, at = ResumedScene(last()), np.array([1.0, 0.5])
    placed = Placed(W_T_O, np.diag([0.01, 0.01, 0.1**2]), at, np.zeros((3, 0, 2)))
    found = Found(solved(), BEGAN, (0, 2), placed, NONE)
    n = last_keyframe(found, scene.own)
    assert n == 170
    told = closure(found, placed, scene.own, n, 5)
    assert (told.number, told.kept, told.b_n) == (5, True, 20)
    w_T_k = se2.compose(W_T_O, driven(170))
    apart = se2.between(w_T_k, np.zeros(3))
    assert told.a_T_b[:2] == pytest.approx(apart[:2], abs=2e-3)
    assert se2.wrap(told.a_T_b[2] - apart[2]) == pytest.approx(0.0, abs=2e-3)
    away = float(np.hypot(*se2.transform(W_T_O, at)))
    xx, _, _, yy, _, tt = told.covariance
    assert xx + yy == pytest.approx(0.02 + (0.1 * away) ** 2, rel=1e-6)
    assert tt == pytest.approx(0.1**2)


def test_a_segment_that_ended_has_no_keyframe_to_tell() -> None:
    scene = ResumedScene(last())
    found = Found(solved(), BEGAN - 1, (0,), "ambiguous", NONE)
    assert last_keyframe(found, scene.own) is None


@pytest.mark.parametrize(("degrees", "expected"), [(39.9, False), (40.1, True)])
def test_a_heading_is_known_to_forty_degrees_or_it_is_none(degrees: float, expected: bool) -> None:
    assert is_vague(np.diag([9.0, 9.0, np.radians(degrees) ** 2])) is expected
    assert not is_vague(None)
