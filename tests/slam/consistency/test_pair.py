"""One pair as its owner sees it: what module 1 found, and when it is believed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pair_scenes import BESIDE, FIT, MIRRORED, OwnedPair, asked_at, estimate_of
from slam_scenes import NOISE, config, inverted, product, same_pose

from drslamd.conventions import Chain
from drslamd.slam.chi_squared import LEVEL_FREEDOM
from drslamd.slam.closure_method import AGREEMENT
from drslamd.slam.consistency import pair as pair_module
from drslamd.slam.consistency.pair import PENDING, Agreement
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.relative_pose.mistakes.what_if import CASES
from drslamd.slam.settings import closure_method

TWO = Agreement(least=2, outnumber=2, confirms=False)
DECISIVE = (LEVEL_FREEDOM + FIT) * np.expm1(AGREEMENT.decides / (LEVEL_FREEDOM - 3))
"""Chi-squared by which another hypothesis must be worse, in the empty windows of these scenes."""


def chosen(algorithm: str) -> Agreement:
    """What a configured algorithm asks for."""
    section = config(extra=f'[relative_pose]\nalgorithm = "{algorithm}"\n').relative_pose
    return closure_method(section).agreement


def rivalled(agreement: Agreement, agreeing: int, contradicting: int) -> OwnedPair:
    """Windows that agree with each other, after others that agree on something else."""
    pair = OwnedPair(agreement)
    pair.confirm()
    poses = [MIRRORED] * contradicting + [BESIDE] * agreeing
    for k, pose in enumerate(poses, start=1):
        pair.answer(10 * k, pose)
        # as many at once as may wait, so that the smaller sets are not believed on the way
        if k % PENDING == 0 or k == len(poses):
            pair.check()
    return pair


@pytest.mark.parametrize(
    ("algorithm", "agreeing", "contradicting", "is_connected"),
    [
        ("drslamd", 4, 0, False),
        ("drslamd", 5, 0, True),
        ("drslamd", 5, 2, True),
        ("drslamd", 5, 3, False),
        ("drslamd", 6, 3, True),
        ("paper", 1, 0, False),
        ("paper", 2, 0, True),
        ("paper", 3, 2, True),
    ],
)
def test_a_pair_is_connected_by_enough_closures_that_outnumber_all_others(
    algorithm: str, agreeing: int, contradicting: int, is_connected: bool
) -> None:
    """Five and twice as many in ours; two, whatever contradicts them, in the paper."""
    pair = rivalled(chosen(algorithm), agreeing, contradicting)
    assert len(pair.kept()) == agreeing
    assert pair.tracker.connected is is_connected


@pytest.mark.parametrize(
    ("worse", "is_known", "is_connected"),
    [
        (DECISIVE + 0.1, True, True),
        (DECISIVE - 0.1, True, False),
        (DECISIVE + 0.1, False, False),
    ],
)
def test_a_window_that_decides_overrules_earlier_ones_that_had_not(
    worse: float, is_known: bool, is_connected: bool
) -> None:
    """Nine windows that allow two poses, then one that excludes the other, if it is the newest."""
    pair = OwnedPair(chosen("drslamd"))
    pair.confirm()
    for k in range(1, 10):
        pair.answer(10 * k, BESIDE, MIRRORED)
        pair.check()
    assert not pair.tracker.connected
    pair.answer(100, BESIDE, MIRRORED, worse=worse)
    if not is_known:
        pair.answer(110, BESIDE, MIRRORED)
    pair.check()
    assert pair.tracker.connected is is_connected


def test_a_window_that_decides_for_what_is_not_kept_overrules_nothing() -> None:
    pair = OwnedPair(chosen("drslamd"))
    pair.confirm()
    for k in range(1, 8):
        pair.answer(10 * k, BESIDE, MIRRORED)
        pair.check()
    pair.answer(80, BESIDE)
    pair.answer(90, MIRRORED, (9.0, 9.0, 0.0), worse=DECISIVE + 0.1)
    pair.check()
    assert pair.kept() == [0, 1, 2, 3, 4, 5, 6, 7]
    assert not pair.tracker.connected


def test_a_pair_is_connected_as_soon_as_it_is_confirmed_and_told_once() -> None:
    pair = OwnedPair(chosen("drslamd"))
    pair.see(BESIDE, 5)
    assert not pair.tracker.connected
    pair.confirm()
    pair.tracker.on_costs(asked_at(50), np.zeros(len(CASES)), 0.0)
    assert pair.tracker.connected
    assert not pair.tracker.is_told
    pair.told()
    assert pair.tracker.is_told


@pytest.mark.parametrize(("agreeing", "is_connected"), [(2, False), (3, True)])
def test_any_agreement_counts_as_it_is_stated(agreeing: int, is_connected: bool) -> None:
    assert rivalled(Agreement(3, 3, confirms=False), agreeing, 1).tracker.connected is is_connected
    assert not rivalled(Agreement(3, 3, confirms=False), 5, 2).tracker.connected


def test_a_pair_that_was_connected_stays_so_while_enough_agree() -> None:
    """Rivals that come later do not part it: they would have to be the larger set."""
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 3)
    assert pair.tracker.connected
    pair.see(MIRRORED, 2, first=50)
    assert pair.tracker.connected
    assert pair.kept() == [0, 1, 2]


def test_two_poses_of_one_window_do_not_agree_with_each_other() -> None:
    pair = OwnedPair(TWO)
    pair.answer(10, BESIDE, BESIDE)
    pair.check()
    assert pair.kept() == [0]
    pair.answer(20, BESIDE, MIRRORED)
    pair.check()
    assert pair.kept() == [0, 1]


@pytest.mark.parametrize(("epsilon", "is_connected"), [(0.5, False), (0.001, True)])
def test_the_significance_of_the_test_is_the_configured_one(
    epsilon: float, is_connected: bool
) -> None:
    """Two closures 1.5 sigmas apart in x and in y: 4.5, between the quantiles of 2.4 and 16.3."""
    pair = OwnedPair(TWO, epsilon)
    off = 1.5 * 0.05 * np.sqrt(2)
    pair.answer(10, BESIDE)
    pair.answer(10, (BESIDE[0] + off, BESIDE[1] + off, 0.0))
    pair.check()
    assert pair.tracker.connected is is_connected


# what module 1 found


def test_every_window_is_counted_by_its_verdict() -> None:
    pair = OwnedPair(TWO)
    pair.answer(10)
    pair.answer(20, BESIDE)
    pair.answer(30, BESIDE, MIRRORED)
    pair.tracker.count("too few ranges")
    assert pair.tracker.verdicts == {
        "not enough motion": 1,
        "unique": 1,
        "ambiguous": 1,
        "too few ranges": 1,
    }
    assert pair.tracker.last_verdict == "too few ranges"
    assert pair.tracker.closures_seen == 2


def test_the_history_has_every_answer_with_the_number_of_its_closure() -> None:
    pair = OwnedPair(TWO)
    pair.answer(10)
    pair.answer(20, BESIDE)
    pair.answer(30, BESIDE)
    answers = [(a.number, a.utime, len(a.estimate.hypotheses)) for a in pair.tracker.history]
    assert answers == [(0, 1_000_000, 0), (0, 2_000_000, 1), (1, 3_000_000, 1)]


@pytest.mark.parametrize(("most", "accepted"), [(4, {0, 1, 2, 3}), (3, {1, 2, 3})])
def test_the_history_is_bounded_and_with_it_what_is_said_to_be_accepted(
    most: int, accepted: set[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pair_module, "HISTORY", most)
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 4)
    assert len(pair.tracker.history) == most
    assert pair.tracker.accepted() == accepted


@pytest.mark.parametrize(("waiting", "lost"), [(PENDING, 0), (PENDING + 1, 1)])
def test_so_many_answers_wait_for_module_2_and_the_oldest_is_lost(waiting: int, lost: int) -> None:
    pair = OwnedPair(TWO)
    for n in range(waiting):
        pair.answer(10 * (n + 1), BESIDE)
    pair.check()
    assert pair.kept() == list(range(lost, waiting))


# module 2 at work


def test_without_anything_new_there_is_nothing_to_check() -> None:
    pair = OwnedPair(TWO)
    assert pair.tracker.begin_check(pair.own, pair.peer, NOISE) is None
    pair.answer(10)
    assert pair.tracker.begin_check(pair.own, pair.peer, NOISE) is None


def test_what_is_kept_stays_visible_while_module_2_computes_and_nothing_is_said() -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 3)
    assert pair.told() == [(0, True), (1, True), (2, True)]
    pair.answer(40, BESIDE)
    run = pair.tracker.begin_check(pair.own, pair.peer, NOISE)
    assert run is not None
    done = run()
    assert pair.kept() == [0, 1, 2]
    assert pair.tracker.connected
    assert pair.tracker.accepted() == {0, 1, 2}
    assert pair.told() == []
    pair.tracker.on_check(done)
    assert pair.kept() == [0, 1, 2, 3]
    assert pair.told() == [(3, True)]


def test_one_check_of_a_pair_runs_at_a_time_and_what_comes_meanwhile_waits() -> None:
    pair = OwnedPair(TWO)
    pair.answer(10, BESIDE)
    run = pair.tracker.begin_check(pair.own, pair.peer, NOISE)
    assert run is not None
    pair.answer(20, BESIDE)
    assert pair.tracker.begin_check(pair.own, pair.peer, NOISE) is None
    pair.tracker.on_check(run())
    assert pair.kept() == [0]
    pair.check()
    assert pair.kept() == [0, 1]


def test_a_closure_is_left_out_when_either_keyframe_is_not_held() -> None:
    pair = OwnedPair(TWO)
    here, elsewhere = asked_at(10), asked_at(13)
    for request in (here, replace(here, a=elsewhere.a), replace(here, b=elsewhere.b)):
        pair.tracker.on_estimate(request, estimate_of(BESIDE))
    run = pair.tracker.begin_check(pair.own, pair.peer, NOISE)
    assert run is not None
    assert [m.number for m in run().measurements] == [0]


def test_a_closure_is_of_the_keyframes_and_not_of_the_bodies() -> None:
    pair = OwnedPair(Agreement(1, 0, confirms=False))
    bodies = ((0.3, 0.1, 0.2), (-0.2, 0.4, -0.1))
    pair.tracker.on_estimate(asked_at(20, bodies=bodies), estimate_of((1.0, 3.0, 3.0)))
    pair.check()
    (said,) = pair.measurements()
    assert (said.a_n, said.peer, said.b_n, said.kept) == (20, Chain(1, 1), 20, True)
    assert same_pose(np.array(said.a_T_b), product(bodies[0], (1, 3, 3), inverted(bodies[1])))


def test_what_came_late_of_a_peers_way_counts_for_closures_that_were_there_before() -> None:
    """a stood, b went out 30 m and came back; two closures disagree by 0.7 m on where b is."""
    ends, between = {10: 0.0, 200: 0.5}, {n: 30.0 - abs(n - 105) / 3.5 for n in range(20, 200, 10)}
    for way, agreeing in (({}, 1), (between, 2)):
        pair = OwnedPair(TWO)
        pair.own, pair.peer = ChainData(Chain(0, 1)), ChainData(Chain(1, 1))
        for n, x in ends.items():
            pair.own.add(Keyframe(n, 0, 0, 0, 0))
            pair.peer.add(Keyframe(n, 0, round(1e4 * x), 0, 0))
        pair.answer(200, (BESIDE[0] + 0.5, BESIDE[1], 0.0))
        pair.check()
        for n, x in way.items():
            pair.peer.add(Keyframe(n, 0, round(1e4 * x), 0, 0))
        pair.answer(10, (BESIDE[0], BESIDE[1] + 0.7, 0.0))
        pair.check()
        assert len(pair.kept()) == agreeing


# another piece of odometry


@pytest.mark.parametrize("segments", [(1, 0), (0, 1)])
def test_when_odometry_broke_a_new_set_begins_and_the_old_one_stays_believed(
    segments: tuple[int, int],
) -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 3)
    assert pair.told() == [(0, True), (1, True), (2, True)]
    pair.answer(40, BESIDE, segments=segments)
    pair.check()
    assert pair.kept() == [3]
    assert not pair.tracker.connected
    assert pair.tracker.accepted() == {0, 1, 2, 3}
    assert pair.told() == []
    pair.answer(50, BESIDE, segments=segments)
    pair.check()
    assert pair.tracker.connected
    assert pair.told() == [(3, True), (4, True)]


def test_a_new_set_is_believed_for_its_own_merits() -> None:
    """Two that agree and two that contradict them, all in the first check after the break."""
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 3)
    for n, pose in ((40, BESIDE), (50, BESIDE), (60, MIRRORED), (70, MIRRORED)):
        pair.answer(n, pose, segments=(1, 0))
    pair.check()
    assert len(pair.kept()) == 2
    assert not pair.tracker.connected


def test_of_a_piece_that_was_never_believed_nothing_is_accepted_later() -> None:
    pair = OwnedPair(Agreement(3, 2, confirms=False))
    pair.see(BESIDE, 2)
    pair.answer(40, BESIDE, segments=(1, 0))
    pair.check()
    assert pair.tracker.accepted() == {2}


def test_answers_of_the_old_piece_that_still_wait_are_dropped_with_it() -> None:
    pair = OwnedPair(TWO)
    pair.answer(10, BESIDE)
    pair.answer(20, BESIDE, segments=(1, 0))
    pair.check()
    assert pair.kept() == [1]
