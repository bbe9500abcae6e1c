"""The figures of hand-made runs."""

from __future__ import annotations

import math
from collections.abc import Iterable

import pytest
from lab.score.claims import Claim
from lab.trust import figures
from lab.trust.figures import Figures
from lab.trust.naming import NO_CAUSE, Cause, Said
from lab.trust.watch import DOUBTFUL, LOCALISED, Run, Stated

ODOMETRY = Cause("odometry", "slip")
GOOD, LIE = Claim(0.1, 0.2, 3.0, 1.0), Claim(2.0, 0.2, 90.0, 60.0)
WIDE = Claim(0.1, 0.51, 1.5, 0.2)


def pose(claim: Claim, called: str = LOCALISED, of_frame: bool = False) -> Stated:
    return Stated(30.0, (1,), called, claim, of_frame)


def of(*runs: Run, twins: Iterable[Run] = (), cause: Cause = NO_CAUSE) -> Figures:
    return figures.figures(dict(enumerate(runs)), dict(enumerate(twins)), {0: 0.5, 7: 9.0}, cause)


def test_nees_and_ellipse_are_of_localised_poses_of_robots_other_than_that_of_the_frame() -> None:
    stated = [pose(GOOD), pose(GOOD), pose(LIE), pose(LIE, DOUBTFUL), pose(LIE, of_frame=True)]
    found = of(Run(poses=stated))
    assert found.nees == pytest.approx((1 + 1 + 30) / 3)
    assert found.inside == pytest.approx(2 / 3)


def test_liars_are_called_localised_and_may_be_in_their_own_frame() -> None:
    stated = [pose(GOOD), pose(LIE), pose(LIE, DOUBTFUL), pose(LIE, of_frame=True)]
    found = of(Run(poses=stated, pairs=[pose(LIE), pose(GOOD), pose(GOOD), pose(GOOD)]))
    assert found.liars == pytest.approx(2 / 3)
    assert found.doubtful == pytest.approx(1 / 4)
    assert found.pair_liars == pytest.approx(1 / 4)
    assert found.pair_inside == pytest.approx(3 / 4)


def test_wide_are_poses_with_a_sigma_above_half_a_metre() -> None:
    just = Claim(0.1, 0.49, 1.5, 0.2)
    assert of(Run(poses=[pose(WIDE), pose(just), pose(GOOD), pose(GOOD)])).wide == 0.25


def test_windows_are_wrong_that_lie_or_are_beyond_all_bounds() -> None:
    closures = [GOOD, LIE, Claim(0.5, 0.2, 50.1, 4.0), Claim(0.5, 0.2, 49.9, 4.0)]
    found = of(Run(closures=closures), Run(closures=[Claim(1.1, 0.32, 12.0, 5.0)]))
    assert found.wrong_unique == 3
    assert found.closure_nees == pytest.approx((3 + 90 + 50.1 + 49.9 + 12) / 15)


def test_of_nothing_there_is_no_figure() -> None:
    found = of(Run())
    for name in ("nees", "inside", "liars", "doubtful", "ate_m", "ate_x_clean", "said_s", "named"):
        assert math.isnan(getattr(found, name)), name


def test_ate_is_of_runs_that_connect_and_compared_seed_by_seed() -> None:
    runs = [Run(ate_m={None: 1.0}, connected=True), Run(ate_m={None: math.inf})]
    runs.append(Run(ate_m={None: 3.0}, connected=True))
    twins = [Run(ate_m={None: ate}) for ate in (0.5, 0.1, math.inf)]
    found = of(*runs, twins=twins)
    assert found.connected == pytest.approx(2 / 3)
    assert found.ate_m == pytest.approx(2.0)
    assert found.ate_x_clean == pytest.approx(2.0)
    assert found.ate_x_today == pytest.approx(2.0)


def test_the_healthy_are_compared_with_themselves() -> None:
    ill = Run(ate_m={None: math.inf, 0: 0.9, 1: 0.3}, at_fault=frozenset({1}))
    clean = Run(ate_m={None: 0.1, 0: 0.1, 1: 0.2})
    assert of(ill, twins=[clean]).healthy_x_clean == pytest.approx(1.5)
    everybody = Run(ate_m=ill.ate_m, at_fault=frozenset({0, 1}))
    assert math.isnan(of(everybody, twins=[clean]).healthy_x_clean)


def heard(*sentences: tuple[float, str], evident_s: float = 50.0) -> Run:
    said = [Said(t, 0, sentence) for t, sentence in sentences]
    return Run(said=said, at_fault=frozenset({0}), evident_s=evident_s, localised_s=10.0)


def test_time_counts_from_the_evidence_to_the_first_sentence_and_the_longest_is_told() -> None:
    soon = heard((20.0, "odometry"), (52.0, "odometry"), (58.0, "odometry: slip"))
    late = heard((54.0, "odometry is doubted: slip"))
    found = of(soon, late, cause=ODOMETRY)
    assert found.said_s == pytest.approx(4.0)
    assert found.cause_s == pytest.approx(8.0)
    assert found.named == 1.0


def test_what_stands_when_the_evidence_comes_is_said_at_once() -> None:
    run = heard(*((float(t), "odometry: slip") for t in range(40, 60)))
    assert of(run, cause=ODOMETRY).said_s == 0.0


def test_a_run_that_says_nothing_is_never_in_time() -> None:
    found = of(heard((55.0, "odometry: slip")), heard((55.0, "ranges")), cause=ODOMETRY)
    assert found.said_s == found.cause_s == math.inf
    assert found.named == pytest.approx(0.5)


def test_a_fault_that_cannot_be_seen_counts_for_nothing() -> None:
    found = of(heard((55.0, "odometry")), heard(evident_s=math.inf), cause=ODOMETRY)
    assert found.said_s == pytest.approx(5.0)


def test_a_broken_world_can_be_known_from_the_first_pose_on() -> None:
    run = Run(said=[Said(25.0, 0, "odometry: slip")], localised_s=18.0)
    assert of(run, cause=ODOMETRY).cause_s == pytest.approx(7.0)
    # and what is broken now and then once it was
    run.evident_s = 21.0
    assert of(run, cause=ODOMETRY).cause_s == pytest.approx(4.0)


def test_wrong_names_are_counted_by_run() -> None:
    wrong = [Said(60.0, 0, "robot 1: wheels.track_m"), Said(61.0, 0, "robot 1: wheels.track_m")]
    assert of(Run(said=wrong), Run(), Run(said=wrong[:1])).wrong_names == 2
