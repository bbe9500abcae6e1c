"""The places that are left of a peer, out of what module 1 answered last."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from pair_scenes import BESIDE, LAST, MIRRORED, OwnedPair, asked_at, estimate_of, moving_end
from slam_scenes import inverted

from drslamd.conventions import GRID_US
from drslamd.slam.closure_method import AGREEMENT
from drslamd.slam.consistency.pair import Agreement
from drslamd.slam.hypotheses.deciding_motion import deciding_motion
from drslamd.slam.hypotheses.places_left import PlacesLeft, places_left
from drslamd.slam.relative_pose.mistakes.what_if import MIRROR

SIGMA = 0.1
KNOWN = 0.05
"""Sigma of the poses of `estimate_of`, m and rad."""


def left_of(pair: OwnedPair) -> PlacesLeft | None:
    return places_left(pair.tracker, moving_end(0), moving_end(1), SIGMA)


def after(n: int, *poses: Sequence[float], worse: float = 0.0) -> PlacesLeft:
    """What is left when one window, which asked for sample n, named these poses."""
    pair = OwnedPair(AGREEMENT)
    pair.answer(n, *poses, worse=worse)
    found = left_of(pair)
    assert found is not None
    return found


def test_places_are_where_the_peer_has_come_since_in_the_frame_of_our_odometry() -> None:
    """Both drive along x by 0.1 m a sample; the window asked for sample 180, the last is 200."""
    turned = (0.0, 3.0, math.pi / 2)
    found = after(180, BESIDE, turned, worse=2.0)
    assert [place.pose for place in found.places] == [
        pytest.approx((20.0, 3.0, 0.0)),
        pytest.approx((18.0, 5.0, math.pi / 2)),
    ]
    assert {place.utime for place in found.places} == {LAST * GRID_US}
    assert {place.peer for place in found.places} == {1}


def test_shares_are_likelihoods() -> None:
    """exp(-chi2 / 2): what is worse by 2 ln 3 is a third as likely."""
    found = after(190, BESIDE, MIRRORED, worse=2 * math.log(3))
    assert [place.share for place in found.places] == pytest.approx([0.75, 0.25])


def test_what_the_way_adds_is_in_the_covariance() -> None:
    """2 m of way: the heading's sigma of 0.05 rad moves its end sideways, odometry adds more."""
    (place,) = after(180, BESIDE).places
    noise, way_m = moving_end(1).data.model.noise, 2.0
    xx, _, _, yy, _, tt = place.covariance
    drawn = noise.translation_per_sqrt_m**2 * way_m
    random, rate = noise.yaw_rad_per_sqrt_m**2, noise.yaw_rad_per_m
    assert xx == pytest.approx(KNOWN**2 + drawn + (noise.scale * way_m) ** 2)
    assert yy == pytest.approx(
        KNOWN**2 * (1 + way_m**2) + drawn + random * way_m**3 / 3 + (rate * way_m**2 / 2) ** 2,
        rel=1e-3,
    )
    assert tt == pytest.approx(KNOWN**2 + random * way_m + (rate * way_m) ** 2)


def test_of_our_heading_there_covariances_have_the_axes_of_odometry() -> None:
    pair, end = OwnedPair(AGREEMENT), moving_end(0)
    for n in range(LAST + 1, LAST + 40):
        end.track.append(n, np.array([1000.0 * LAST, 1000.0 * (n - LAST), 15708.0]))
    known = np.diag([0.3**2, 0.01**2, 0.01**2])
    request = asked_at(LAST)
    # the peer stands at its last sample, where the window asks
    pair.tracker.on_estimate(request, estimate_of(BESIDE, covariance=known))
    found = places_left(pair.tracker, end, moving_end(1), SIGMA)
    assert found is not None
    xx, _, _, yy, _, _ = found.places[0].covariance
    assert (xx, yy) == pytest.approx((0.09, 0.0001), rel=1e-6)


@pytest.mark.parametrize(("apart_m", "count"), [(0.23, 1), (0.25, 2)])
def test_two_that_are_the_same_within_what_is_known_are_one(apart_m: float, count: int) -> None:
    """99 % of chi-squared with three degrees of freedom, 11.34, of sigma 0.05 m each: 0.238 m."""
    near = (apart_m, 3.0, 0.0)
    found = after(LAST, BESIDE, near, MIRRORED)
    assert len(found.places) == count + 1
    assert sum(place.share for place in found.places) == pytest.approx(1.0)
    assert found.places[-1].pose == pytest.approx((20.0, -3.0, 0.0))


@pytest.mark.parametrize(("n", "is_left"), [(100, True), (90, False)])
def test_an_answer_of_more_than_ten_seconds_ago_is_none_of_now(n: int, is_left: bool) -> None:
    pair = OwnedPair(AGREEMENT)
    pair.answer(n, BESIDE, MIRRORED)
    assert (left_of(pair) is not None) is is_left


def test_a_window_that_says_nothing_takes_nothing_away() -> None:
    pair = OwnedPair(AGREEMENT)
    assert left_of(pair) is None
    pair.answer(180, BESIDE, MIRRORED)
    pair.answer(190)
    found = left_of(pair)
    assert found is not None
    assert len(found.places) == 2


def test_the_newest_window_counts() -> None:
    pair = OwnedPair(AGREEMENT)
    pair.answer(180, BESIDE, MIRRORED)
    pair.answer(190, MIRRORED)
    found = left_of(pair)
    assert found is not None
    assert [place.pose[1] for place in found.places] == [pytest.approx(-3.0)]
    assert found.motion is None


def test_of_a_pair_that_is_connected_no_places_are_left() -> None:
    pair = OwnedPair(Agreement(least=2, outnumber=2, confirms=False))
    pair.see(BESIDE, 1, first=190)
    assert left_of(pair) is not None
    pair.see(BESIDE, 1, first=200)
    assert pair.tracker.connected
    assert left_of(pair) is None


def test_what_was_found_before_odometry_broke_is_nothing() -> None:
    pair, end = OwnedPair(AGREEMENT), moving_end(1)
    pair.answer(190, BESIDE, MIRRORED)
    end.track.append(LAST + 5, np.zeros(3))
    assert places_left(pair.tracker, moving_end(0), end, SIGMA) is None


def test_a_place_and_its_mirror_image_are_decided_by_a_turn_of_ours() -> None:
    motion = after(LAST, BESIDE, MIRRORED).motion
    assert motion is not None
    assert (motion.peer, motion.mover, motion.leaves) == (1, 0, 1)
    assert motion.left == motion.right
    assert 0 < motion.left[0] < math.radians(90) < motion.left[1]


def test_where_we_can_decide_nothing_it_is_the_peer_that_drives() -> None:
    """One place, two headings: wherever we go, ranges are the same."""
    turned = (0.0, 3.0, 2.0)
    found = after(LAST, BESIDE, turned)
    assert found.motion is not None
    assert (found.motion.peer, found.motion.mover) == (1, 1)
    # by the other way round: we, seen from the peer, know about as well
    seen = np.array([inverted(pose)[:2] for pose in (BESIDE, turned)])
    lever = 3.0
    known = []
    for place in seen:
        along = place / np.hypot(*place)
        across = np.array([-along[1], along[0]])
        wide = KNOWN**2 * (1 + lever**2)
        known.append(KNOWN**2 * np.outer(along, along) + wide * np.outer(across, across))
    assert found.motion == deciding_motion(1, 1, seen, np.array(known), SIGMA)


def test_our_body_now_is_what_turns_count_from() -> None:
    """Ours has turned about since: left is right then."""
    straight = after(190, (3.0, 2.0, 0.0), (3.0, 4.0, 0.0)).motion
    pair, end = OwnedPair(AGREEMENT), moving_end(0)
    pair.answer(190, (3.0, 2.0, 0.0), (3.0, 4.0, 0.0))
    end.track.append(LAST + 1, np.array([1000.0 * LAST, 0.0, 31416.0]))
    about = places_left(pair.tracker, end, moving_end(1), SIGMA)
    assert straight is not None
    assert about is not None
    assert about.motion is not None
    assert straight.mover == about.motion.mover == 0
    ours, then = about.motion.right, straight.left
    assert (ours[0] + ours[1]) / 2 + (then[0] + then[1]) / 2 == pytest.approx(math.pi, abs=0.15)


def test_of_a_pair_of_which_one_turns_the_other_way_nothing_is_said() -> None:
    """Where it looks is not known."""
    pair = OwnedPair(Agreement(least=2, outnumber=2, confirms=False))
    pair.see(BESIDE, 1, first=190)
    pair.tracker.search.found = MIRROR
    assert left_of(pair) is None
