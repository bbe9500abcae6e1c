"""A robot began again beside two that know where they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from resumed_scene import UNTIL, W_T_O, ResumedScene, driven, last, solved

from drslamd.conventions import SECOND_US, Chain
from drslamd.slam import se2
from drslamd.slam.relocation.placing import Placed
from drslamd.slam.relocation.resumption import AGREE_M, CARRIED_MPS, FIRST_NUMBER, MOST_REACH_M


def test_ranges_say_where_it_is_and_the_memory_only_bounds_it() -> None:
    for x in (4.0, -3.0):
        found = ResumedScene(last(x=x)).found()
        assert isinstance(found.answer, Placed)
        assert found.answer.w_T_o == pytest.approx(W_T_O, abs=0.05)


def test_an_answer_that_stands_for_two_seconds_is_a_closure() -> None:
    scene = ResumedScene(last())
    found, t0 = scene.found(), UNTIL * 100_000
    told = [scene.resumption.on_found(found, scene.own, t0 + k * SECOND_US) for k in range(3)]
    assert told == [False, False, True]
    (closure,) = scene.resumption.tell()
    assert (closure.number, closure.a_n, closure.peer) == (FIRST_NUMBER + 1, 170, Chain(0, 9))
    w_T_k = se2.compose(W_T_O, driven(170))
    off = np.array(closure.a_T_b) - se2.between(w_T_k, np.zeros(3))
    assert np.array([*off[:2], se2.wrap(off[2])]) == pytest.approx(np.zeros(3), abs=0.05)
    assert scene.resumption.tell() == []
    # it waits for what comes of that, and not for ever
    assert scene.look(utime=t0 + 6 * SECOND_US - 1) is None
    assert scene.look(utime=t0 + 6 * SECOND_US) is not None
    assert scene.resumption.is_waiting


@pytest.mark.parametrize(("off_m", "is_told"), [(AGREE_M - 0.05, True), (AGREE_M + 0.05, False)])
def test_answers_that_differ_begin_anew(off_m: float, is_told: bool) -> None:
    scene, t0 = ResumedScene(last()), UNTIL * 100_000
    found = scene.found()
    assert isinstance(found.answer, Placed)
    moved = found.answer._replace(w_T_o=found.answer.w_T_o + [off_m, 0.0, 0.0])
    assert not scene.resumption.on_found(found, scene.own, t0)
    other = replace(found, answer=moved)
    assert scene.resumption.on_found(other, scene.own, t0 + 2 * SECOND_US) is is_told


def test_no_answer_in_between_begins_anew() -> None:
    scene, t0 = ResumedScene(last()), UNTIL * 100_000
    found = scene.found()
    scene.resumption.on_found(found, scene.own, t0)
    scene.resumption.on_found(replace(found, answer="ambiguous"), scene.own, t0 + SECOND_US)
    assert scene.resumption.verdict == "ambiguous"
    assert not scene.resumption.on_found(found, scene.own, t0 + 2 * SECOND_US)


@pytest.mark.parametrize(("more_m", "is_asked"), [(-1.0, True), (1.0, False)])
def test_who_may_be_out_of_reach_of_all_begins_from_nothing(more_m: float, is_asked: bool) -> None:
    scene = ResumedScene(last((MOST_REACH_M - 0.6 + more_m) / CARRIED_MPS))
    assert (scene.look() is not None) is is_asked
    assert scene.resumption.is_waiting is is_asked


@pytest.mark.parametrize(("seconds", "is_asked"), [(-0.4, True), (-0.6, False)])
def test_nobody_was_last_seen_in_the_future(seconds: float, is_asked: bool) -> None:
    assert (ResumedScene(last(seconds)).look() is not None) is is_asked


@pytest.mark.parametrize("peer", [Chain(0, 8), Chain(3, 9)])
def test_a_peer_that_began_again_or_is_gone_tells_nothing(peer: Chain) -> None:
    scene = ResumedScene(last(peer=peer))
    assert scene.look() is None
    assert scene.resumption.is_waiting


@pytest.mark.parametrize(("points", "is_over"), [(frozenset(), True), (frozenset([1]), False)])
def test_who_is_localised_needs_it_no_more(points: frozenset[int], is_over: bool) -> None:
    scene = ResumedScene(last())
    assert (scene.look(solved(1, points=points)) is None) is is_over
    assert scene.resumption.is_waiting is not is_over


def test_for_ten_seconds_after_a_place_was_told_it_may_be_vague() -> None:
    scene, t0 = ResumedScene(last()), UNTIL * 100_000
    assert not scene.resumption.is_settling(t0)
    found = scene.found()
    for k in (0, 2):
        scene.resumption.on_found(found, scene.own, t0 + k * SECOND_US)
    assert scene.resumption.is_settling(t0 + 12 * SECOND_US - 1)
    assert not scene.resumption.is_settling(t0 + 12 * SECOND_US)


def test_who_remembers_nothing_asks_nothing_and_nobody() -> None:
    scene = ResumedScene(None)
    assert scene.look() is None
    assert not scene.resumption.is_waiting
    assert scene.resumption.beside == frozenset()
    assert ResumedScene(last()).resumption.beside == {Chain(0, 9)}
