"""One pair whose robots may not be mounted as configured: what is believed of it, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pair_scenes import BESIDE, OwnedPair, asked_at
from slam_scenes import Array, config, curved_window, inverted, product

from drslamd.slam.closure_method import AGREEMENT
from drslamd.slam.consistency.pair import Agreement
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import Keyframe
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.mounting import CURVES, SIDES, TRACKS, Repair
from drslamd.slam.relative_pose.estimate import RelativePoseEstimate, Verdict
from drslamd.slam.relative_pose.mistakes.mounting_search import FEWEST_ASKED, MOST, MOVED_M
from drslamd.slam.relative_pose.mistakes.what_if import CASES, MIRROR, Case, variants
from drslamd.slam.settings import closure_method

TWO = Agreement(least=2, outnumber=2, confirms=False)


def chosen(algorithm: str) -> Agreement:
    """What a configured algorithm asks for."""
    section = config(extra=f'[relative_pose]\nalgorithm = "{algorithm}"\n').relative_pose
    return closure_method(section).agreement


# believed as configured


@pytest.mark.parametrize("algorithm", ["drslamd", "paper"])
def test_in_ours_windows_must_also_have_excluded_that_wheels_run_backwards(algorithm: str) -> None:
    pair = OwnedPair(chosen(algorithm))
    pair.see(BESIDE, 6)
    assert pair.tracker.connected is (algorithm == "paper")
    assert pair.tracker.awaits_confirmation is (algorithm == "drslamd")
    pair.confirm()
    # what is known of the mountings counts from the next closure on
    pair.see(BESIDE, 1, first=80)
    assert pair.tracker.connected
    assert not pair.tracker.awaits_confirmation
    assert len(pair.told()) == 7


@pytest.mark.parametrize(("agreeing", "awaits"), [(1, False), (2, True)])
def test_it_is_asked_whether_a_pair_is_mounted_as_configured_once_two_closures_agree(
    agreeing: int, awaits: bool
) -> None:
    pair = OwnedPair(AGREEMENT)
    assert not pair.tracker.awaits_confirmation
    pair.see(BESIDE, agreeing)
    assert pair.tracker.awaits_confirmation is awaits


@pytest.mark.parametrize(("disagree", "is_connected"), [(MOST - 1, True), (MOST, False)])
def test_while_windows_disagree_again_and_again_no_pair_is_connected(
    disagree: int, is_connected: bool
) -> None:
    """One that was is so still: what was believed of its past stays true."""
    pair, other = OwnedPair(TWO), OwnedPair(TWO)
    other.see(BESIDE, 3)
    for tracker in (pair.tracker, other.tracker):
        for _ in range(disagree):
            tracker.on_estimate(asked_at(10), RelativePoseEstimate(Verdict.POOR_FIT, ()))
    pair.see(BESIDE, 2)
    other.see(BESIDE, 2, first=60)
    assert pair.tracker.connected is is_connected
    assert other.tracker.connected


def test_of_a_pair_whose_wheels_run_backwards_nothing_more_is_told_and_what_was_is_taken_back() -> (
    None
):
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert pair.told() == [(0, True), (1, True)]
    assert not pair.tracker.is_refused
    pair.tracker.search.found = Case(b=TRACKS[0])
    assert not pair.tracker.is_refused
    assert pair.told() == []
    pair.tracker.search.found = Case(b=SIDES[0])
    assert pair.tracker.is_refused
    assert not pair.tracker.is_mirrored
    assert pair.told() == [(0, False), (1, False)]


@pytest.mark.parametrize("has_ranges", [True, False])
def test_the_mirror_image_of_a_way_is_told_where_module_3_solves_by_ranges(
    has_ranges: bool,
) -> None:
    pair = OwnedPair(TWO)
    search(pair, MIRROR)
    assert (pair.tracker.is_mirrored, pair.tracker.is_refused) == (True, False)
    pair.see(BESIDE, 2)
    assert pair.tracker.connected
    assert bool(pair.tracker.tell(every=not has_ranges)) is has_ranges


def test_a_closure_says_with_which_scales_and_turns_it_was_found() -> None:
    known = Correction(0.1, 0.02, 0.4), Correction(-0.06, 0.01, -0.2)
    pair = OwnedPair(Agreement(1, 0, confirms=False))
    pair.answer(10, BESIDE)
    pair.check()
    pair.answer(20, BESIDE)
    run = pair.tracker.begin_check(pair.own, pair.peer, pair.own.model.noise, known)
    assert run is not None
    pair.tracker.on_check(run())
    told = {m.number: m.corrected for m in pair.measurements()}
    assert told == {1: (0.1, 0.4, -0.06, -0.2)}


# a mistake is found


def best(case: Case) -> Array:
    """Chi-squared of each case, of which one fits."""
    return np.array([20.0 if each == case else 1e4 for each in CASES])


def search(pair: OwnedPair, case: Case, windows: int = FEWEST_ASKED) -> None:
    for n in range(windows):
        pair.tracker.on_costs(asked_at(10 * n), best(case), 10.0)


def test_what_was_found_before_a_mistake_was_known_is_worth_nothing() -> None:
    """Closures that agreed, and those that wait for module 2."""
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 3)
    pair.answer(50, BESIDE)
    search(pair, Case(b=SIDES[0]), FEWEST_ASKED - 1)
    assert len(pair.kept()) == 3
    search(pair, Case(b=SIDES[0]), 1)
    assert pair.tracker.search.found == Case(b=SIDES[0])
    assert (pair.kept(), pair.tracker.connected) == ([], False)
    assert pair.tracker.begin_check(pair.own, pair.peer, pair.own.model.noise) is None


def test_a_check_that_ran_meanwhile_is_worth_nothing_too_and_the_next_one_counts() -> None:
    pair = OwnedPair(TWO)
    pair.answer(10, BESIDE)
    run = pair.tracker.begin_check(pair.own, pair.peer, pair.own.model.noise)
    assert run is not None
    search(pair, Case(b=TRACKS[0]))
    pair.tracker.on_check(run())
    assert pair.kept() == []
    pair.see(BESIDE, 2, first=20)
    assert pair.kept() == [1, 2]
    assert pair.tracker.connected


@pytest.mark.parametrize("every", [True, False])
def test_what_was_told_before_a_mistake_was_known_is_taken_back_once(every: bool) -> None:
    """Though nothing was checked since; a withdrawal says the same closure again."""
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 3)
    first = pair.measurements(every)
    assert len(first) == (3 if every else 1)
    search(pair, Case(b=TRACKS[0]), FEWEST_ASKED - 1)
    assert pair.told(every) == []
    search(pair, Case(b=TRACKS[0]), 1)
    assert pair.measurements(every) == [replace(m, kept=False) for m in first]
    assert pair.told(every) == []
    pair.see(BESIDE, 2, first=100)
    assert pair.told(every)[0] == (3 if every else 4, True)


def test_what_was_told_is_taken_back_before_what_was_checked_since_is_told() -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert pair.told() == [(0, True), (1, True)]
    search(pair, Case(b=TRACKS[0]))
    pair.see(BESIDE, 2, first=30)
    assert pair.told() == [(0, False), (1, False), (2, True), (3, True)]
    assert pair.told() == []


def begin_anew(pair: OwnedPair, learned: Correction) -> None:
    """Module 2 does, because a correction of our odometry was learned."""
    pair.answer(30, BESIDE)
    known = learned, Correction()
    run = pair.tracker.begin_check(pair.own, pair.peer, pair.own.model.noise, known)
    assert run is not None
    pair.tracker.on_check(run())


def test_what_module_2_has_forgotten_is_taken_back_as_well() -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert pair.told() == [(0, True), (1, True)]
    begin_anew(pair, Correction(0.1, 0.02, 0.4))
    assert pair.told() == []
    search(pair, Case(b=TRACKS[0]))
    assert pair.told() == [(0, False), (1, False)]


@pytest.mark.parametrize(("yaw", "stays"), [(0.02, True), (0.0, False)])
def test_what_module_3_has_learned_a_curve_from_stays_but_for_what_module_2_remembers(
    yaw: float, stays: bool
) -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert len(pair.told()) == 2
    begin_anew(pair, Correction(0.1, yaw, 0.4))
    search(pair, Case(b=CURVES[0]))
    assert pair.tracker.is_refused
    assert pair.told() == ([] if stays else [(0, False), (1, False)])


@pytest.mark.parametrize(("repair", "stays"), [(CURVES[0], True), (TRACKS[0], False)])
def test_so_does_it_where_a_later_window_would_have_that_curve_and_not_where_a_track(
    repair: Repair, stays: bool
) -> None:
    """One window had confirmed the pair, and the next contradicts it."""
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert len(pair.told()) == 2
    begin_anew(pair, Correction(0.0, 0.02, 0.0))
    pair.tracker.search.is_confirmed = pair.tracker.search.is_provisional = True
    costs = np.array([5.0 if case == Case(b=repair) else 1e3 for case in CASES])
    pair.tracker.on_costs(asked_at(10), costs, 10.0)
    assert pair.tracker.search.found is None
    assert not pair.tracker.search.is_confirmed
    assert pair.told() == ([] if stays else [(0, False), (1, False)])


def test_what_was_told_is_taken_back_while_a_check_runs() -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert len(pair.told()) == 2
    pair.answer(30, BESIDE)
    run = pair.tracker.begin_check(pair.own, pair.peer, pair.own.model.noise)
    assert run is not None
    search(pair, Case(b=TRACKS[0]))
    assert pair.told() == [(0, False), (1, False)]
    pair.tracker.on_check(run())
    assert pair.told() == []


def test_a_mistake_that_was_none_takes_back_what_was_told_with_it() -> None:
    """No window fits anything that is like it."""
    pair = OwnedPair(TWO)
    search(pair, Case(b=TRACKS[0]))
    pair.see(BESIDE, 2)
    assert pair.told() == [(0, True), (1, True)]
    for _ in range(FEWEST_ASKED):
        assert pair.told() == []
        pair.tracker.on_costs(asked_at(10), np.full(3, 1e4), 10.0)
    assert pair.tracker.search.found is None
    assert pair.told() == [(0, False), (1, False)]
    assert pair.told() == []


@pytest.mark.parametrize(("place", "is_taken_back"), [(4, False), (-1, True)])
def test_a_track_that_is_a_scale_after_all_takes_back_what_was_told_and_a_better_one_does_not(
    place: int, is_taken_back: bool
) -> None:
    pair, found = OwnedPair(TWO), Case(b=TRACKS[0])
    search(pair, found)
    pair.see(BESIDE, 2)
    assert len(pair.told()) == 2
    better = variants(found)[place]
    window, _ = curved_window(np.random.default_rng(1))
    request = replace(asked_at(10), window=window)
    for _ in range(FEWEST_ASKED):
        costs = np.array([5.0 if case == better else 1e3 for case in variants(found)])
        pair.tracker.on_costs(request, costs, 10.0)
    assert pair.tracker.search.found == better
    assert pair.told() == ([(0, False), (1, False)] if is_taken_back else [])


@pytest.mark.parametrize(("way_m", "confirms"), [(MOVED_M - 0.01, True), (MOVED_M + 0.01, False)])
def test_who_hardly_drove_is_not_asked_about_its_mirror_image(way_m: float, confirms: bool) -> None:
    pair = OwnedPair(TWO)
    same = np.array([20.0 if case in (Case(), MIRROR) else 1e4 for case in CASES])
    pair.tracker.on_costs(asked_at(10), same, way_m)
    assert pair.tracker.search.is_confirmed is confirms


# ways as they should have been


class Circling(OwnedPair):
    """Both drive on circles, with tracks that are wider than their wheels say: a third of each turn
    is missing in what odometry tells."""

    KNOWN = Correction(turn=0.5), Correction(turn=0.5)

    def __init__(self) -> None:
        super().__init__(TWO)
        self.own, self.peer = (ChainData(data.chain) for data in (self.own, self.peer))
        self.true = []
        step, told = (0.5, 0.0, 0.3), (0.5, 0.0, 0.2)
        here, said = np.zeros(3), np.zeros(3)
        for n in range(10, 200, 10):
            self.true.append((here, product((4.0, 3.0, 1.0), here)))
            for data in (self.own, self.peer):
                x, y, theta = (round(1e4 * float(v)) for v in said)
                data.add(Keyframe(n, 0, x, y, theta))
            here, said = product(here, step), product(said, told)

    def see_all(self, known: tuple[Correction, Correction], count: int = 19) -> None:
        for k, (a, b) in enumerate(self.true[:count]):
            self.answer(10 * k + 10, tuple(product(inverted(a), b)))
            self.check_with(known)

    def check_with(self, known: tuple[Correction, Correction]) -> None:
        run = self.tracker.begin_check(self.own, self.peer, self.own.model.noise, known)
        assert run is not None
        self.tracker.on_check(run())


def test_closures_agree_along_ways_as_they_should_have_been() -> None:
    pair = Circling()
    pair.see_all(Circling.KNOWN)
    assert len(pair.kept()) == 19
    for known in ((Correction(), Correction()), (Circling.KNOWN[0], Correction())):
        other = Circling()
        other.see_all(known)
        assert len(other.kept()) < 10


@pytest.mark.parametrize("is_peer", [False, True])
@pytest.mark.parametrize(
    ("changed", "begins_anew"),
    [
        (Correction(turn=0.529), False),
        (Correction(turn=0.531), True),
        (Correction(turn=0.469), True),
        (Correction(scale=0.029, turn=0.5), False),
        (Correction(scale=-0.031, turn=0.5), True),
    ],
)
def test_a_correction_that_changes_the_way_begins_a_new_set(
    changed: Correction, begins_anew: bool, is_peer: bool
) -> None:
    """Beyond three percent; what is kept until then stays in the graph."""
    pair = Circling()
    pair.see_all(Circling.KNOWN, 5)
    assert pair.tracker.connected
    assert pair.told() == [(k, True) for k in range(5)]
    known = (Circling.KNOWN[0], changed) if is_peer else (changed, Circling.KNOWN[1])
    a, b = pair.true[5]
    pair.answer(60, tuple(product(inverted(a), b)))
    pair.check_with(known)
    assert pair.kept() == ([5] if begins_anew else [0, 1, 2, 3, 4, 5])
    assert pair.tracker.connected is not begins_anew
    assert pair.tracker.accepted() >= {0, 1, 2, 3, 4}
    # nothing that was told is taken back
    assert all(kept for _, kept in pair.told())


def test_where_nothing_is_said_of_odometry_it_is_as_it_was_before() -> None:
    pair = Circling()
    pair.see_all(Circling.KNOWN, 5)
    a, b = pair.true[5]
    pair.answer(60, tuple(product(inverted(a), b)))
    pair.check()
    assert pair.kept() == [0, 1, 2, 3, 4, 5]


def test_while_a_check_runs_a_correction_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = Circling()
    a, b = pair.true[0]
    pair.answer(10, tuple(product(inverted(a), b)))
    run = pair.tracker.begin_check(pair.own, pair.peer, pair.own.model.noise)
    assert run is not None
    other = pair.tracker.begin_check(pair.own, pair.peer, pair.own.model.noise, Circling.KNOWN)
    assert other is None
    pair.tracker.on_check(run())
    assert pair.kept() == [0]


def test_a_mistake_that_is_a_little_more_or_less_takes_nothing_back() -> None:
    """What was found nearly right still says where the peer is, and the pair stays in the graph."""
    pair = OwnedPair(TWO)
    search(pair, Case(b=TRACKS[0]))
    pair.see(BESIDE, 2)
    assert pair.told() == [(0, True), (1, True)]
    finer = pair.tracker.search.cases
    # (windows of these scenes are empty: they have fewer than no degrees of freedom)
    costs = np.array([-10.0 if each == finer[1] else 1e4 for each in finer])
    for n in range(FEWEST_ASKED):
        pair.tracker.on_costs(asked_at(100 + 10 * n), costs, 10.0)
    assert pair.tracker.search.found == finer[1]
    assert pair.told() == []
