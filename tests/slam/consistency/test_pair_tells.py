"""What the team hears of one pair: closures that are kept now, and those that no longer are."""

from __future__ import annotations

import pytest
from pair_scenes import BESIDE, MIRRORED, OwnedPair

from drslamd.slam.consistency import pcm
from drslamd.slam.consistency.pair import TELL_EVERY, Agreement

TWO = Agreement(least=2, outnumber=2, confirms=False)


def test_nothing_is_said_of_a_pair_that_is_not_connected() -> None:
    pair = OwnedPair(TWO)
    assert pair.told() == []
    pair.see(BESIDE, 1)
    assert pair.told() == []


@pytest.mark.parametrize(("every", "first"), [(True, 0), (False, 2)])
def test_a_closure_is_said_once(every: bool, first: int) -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 3)
    assert pair.told(every)[0] == (first, True)
    for _ in range(3):
        assert pair.told(every) == []


def test_where_closures_are_the_edges_each_one_is_said() -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert pair.told() == [(0, True), (1, True)]
    pair.see(BESIDE, 2, first=30)
    assert pair.told() == [(2, True), (3, True)]


@pytest.mark.parametrize(("later", "said"), [(TELL_EVERY - 10, []), (TELL_EVERY, [(2, True)])])
def test_where_ranges_are_the_edges_one_in_a_while_is_said(
    later: int, said: list[tuple[int, bool]]
) -> None:
    pair = OwnedPair(TWO)
    pair.see(BESIDE, 2)
    assert pair.told(every=False) == [(1, True)]
    pair.see(BESIDE, 1, first=20 + later)
    assert pair.told(every=False) == said


def test_of_closures_that_are_believed_at_once_the_newest_is_said_first() -> None:
    """Module 3 begins there: the oldest knows least, and may lie in another valley of ranges."""
    pair = OwnedPair(Agreement(9, 2, confirms=False))
    pair.see(BESIDE, 9)
    assert pair.told(every=False) == [(8, True)]
    pair.see(BESIDE, TELL_EVERY // 10, first=100)
    assert pair.told(every=False) == [(8 + TELL_EVERY // 10, True)]


def test_after_all_was_withdrawn_the_newest_is_said_first_again() -> None:
    pair = OwnedPair(TWO)
    pair.see(MIRRORED, 2)
    assert pair.told(every=False) == [(1, True)]
    pair.see(BESIDE, 4, first=40)
    assert pair.told(every=False) == [(1, False), (5, True)]


def test_closures_that_no_longer_agree_are_withdrawn_before_the_others_are_said() -> None:
    pair = OwnedPair(TWO)
    pair.see(MIRRORED, 2)
    first = pair.measurements()
    pair.see(BESIDE, 3, first=40)
    later = pair.measurements()
    assert [(m.number, m.kept) for m in later] == [
        (0, False),
        (1, False),
        (2, True),
        (3, True),
        (4, True),
    ]
    # a withdrawal says the same closure again
    assert [(m.a_n, m.b_n, m.a_T_b) for m in later[:2]] == [(m.a_n, m.b_n, m.a_T_b) for m in first]
    assert pair.told() == []


def test_another_pose_of_the_same_window_takes_the_place_of_the_first() -> None:
    pair = OwnedPair(TWO)
    pair.answer(10, MIRRORED, BESIDE)
    pair.answer(20, MIRRORED)
    pair.check()
    assert pair.told() == [(0, True), (1, True)]
    pair.see(BESIDE, 2, first=30)
    later = pair.measurements()
    assert [(m.number, m.kept) for m in later[:3]] == [(0, False), (1, False), (0, True)]
    assert later[0].a_T_b == pytest.approx(MIRRORED)
    assert later[2].a_T_b == pytest.approx(BESIDE)


def test_closures_that_module_2_has_forgotten_stay_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pcm, "MAX_VERTICES", 8)
    monkeypatch.setattr(pcm, "FORGET", 4)
    said = []
    pair = OwnedPair(TWO)
    for n in range(10, 200, 10):
        pair.answer(n, BESIDE)
        pair.check()
        said += pair.told()
    assert said == [(number, True) for number in range(19)]


def test_of_what_was_told_as_much_is_remembered_as_module_1_can_be_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pcm, "MAX_VERTICES", 8)
    monkeypatch.setattr(pcm, "FORGET", 4)
    monkeypatch.setattr("drslamd.slam.consistency.pair.HISTORY", 10)
    pair = OwnedPair(TWO)
    for n in range(10, 200, 10):
        pair.answer(n, BESIDE)
        pair.check()
        pair.told()
    assert list(pair.tracker._told) == list(range(19 - 10, 19))


def test_one_in_a_while_is_said_also_when_the_last_one_was_forgotten(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pcm, "MAX_VERTICES", 8)
    monkeypatch.setattr(pcm, "FORGET", 4)
    said = []
    pair = OwnedPair(TWO)
    for n in range(10, 200, 10):
        pair.answer(n, BESIDE)
        pair.check()
        said += pair.told(every=False)
    assert said == [(1, True), (1 + TELL_EVERY // 10, True)]
