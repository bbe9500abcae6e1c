"""What module 2 gets of one window, and what one window says for its best pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pair_scenes import BESIDE, MIRRORED, OwnedPair, asked_at, estimate_of

from drslamd.slam import se2
from drslamd.slam.consistency.candidates import candidates, decided, sendable
from drslamd.slam.consistency.pair import Agreement
from drslamd.slam.odometry.correction import Correction

AS_THEY_ARE = Correction(), Correction()


def test_every_hypothesis_of_a_window_is_a_candidate_of_one_closure_best_first() -> None:
    pair = OwnedPair(Agreement(1, 0, confirms=False))
    request = asked_at(20)
    found = candidates(7, request, estimate_of(BESIDE, MIRRORED), pair.own, pair.peer, AS_THEY_ARE)
    assert [c.closure for c, _ in found] == [7, 7]
    assert [m.a_T_b for _, m in found] == [BESIDE, MIRRORED]
    assert [tuple(c.a_pose) for c, _ in found] == [(2.0, 0.0, 0.0)] * 2
    longer = Correction(scale=0.1), Correction()
    (first, _), _ = candidates(
        7, request, estimate_of(BESIDE, MIRRORED), pair.own, pair.peer, longer
    )
    assert first.a_pose == pytest.approx([1.8, 0.0, 0.0])
    elsewhere = replace(request, a=replace(request.a, n=23))
    assert not candidates(7, elsewhere, estimate_of(BESIDE), pair.own, pair.peer, AS_THEY_ARE)


def test_a_window_decides_by_the_nearest_of_its_other_poses() -> None:
    """10 degrees of freedom, the best pose at 5: what is worse by 10 doubles the likely noise."""
    three = estimate_of(BESIDE, MIRRORED, (5.0, 5.0, 0.0))
    chi2 = (5.0, 15.0, 95.0)
    hypotheses = tuple(replace(h, chi2=c) for h, c in zip(three.hypotheses, chi2, strict=True))
    assert decided(replace(three, hypotheses=hypotheses), 10) == pytest.approx(15 * np.log(2))
    assert decided(estimate_of(BESIDE), 10) == np.inf


def test_a_covariance_stays_one_when_it_is_rounded_to_be_sent() -> None:
    """One direction 10 m uncertain, the others 0.1 mm, all correlated."""
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    bad = turn @ np.diag([100.0, 1e-8, 1e-8]) @ turn.T
    assert least_when_rounded(se2.packed(bad)) <= 0
    pair = OwnedPair(Agreement(1, 0, confirms=False))
    pair.tracker.on_estimate(asked_at(20), estimate_of(BESIDE, covariance=bad))
    pair.check()
    (said,) = pair.measurements()
    assert least_when_rounded(said.covariance) > 0
    assert said.covariance == pytest.approx(se2.packed(bad), rel=1.1e-4)
    assert np.diag(sendable(bad)) == pytest.approx(np.diag(bad))


def least_when_rounded(covariance: tuple[float, ...]) -> float:
    """Smallest eigenvalue of six numbers that travel with 32 bits."""
    rounded = np.array(covariance, dtype=np.float32).astype(float)
    return float(np.linalg.eigvalsh(se2.unpacked(tuple(rounded)))[0])


def test_the_short_way_to_a_keyframe_is_corrected_as_the_long_one_is() -> None:
    """b is 1 m ahead of its keyframe and on its left, or on its right where it turns the other
    way: seen from there it is at the same place."""
    pair = OwnedPair(Agreement(1, 0, confirms=False))
    odd = asked_at(20, bodies=((0, 0, 0), (1.0, 0.5, 0.3)))
    right = asked_at(20, bodies=((0, 0, 0), (1.0, -0.5, -0.3)))
    known = Correction(), Correction(turn=-2.0)
    ((_, found),) = candidates(7, odd, estimate_of(BESIDE), pair.own, pair.peer, known)
    ((_, twin),) = candidates(7, right, estimate_of(BESIDE), pair.own, pair.peer, AS_THEY_ARE)
    assert found.a_T_b == pytest.approx(twin.a_T_b)
    assert found.covariance == pytest.approx(twin.covariance)
    assert found.corrected == (0.0, 0.0, 0.0, -2.0)
