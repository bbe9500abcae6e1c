"""Which stretch explains what does not fit, and when none does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lapse_scenes import FAULT, FROM_TO, a_team, nominal, worst
from slam_problems import IDS, links_of, mismeasured, slipping, stuck

from drslamd.slam.graph.estimate import Lapse
from drslamd.slam.optimizer.banded.lapses import lapse_search
from drslamd.slam.optimizer.banded.lapses.known_lapses import GAIN, lapse_of
from drslamd.slam.optimizer.banded.lapses.lapse_search import (
    ABRUPT,
    BEHIND,
    Tried,
    best,
    is_asked_for,
)
from drslamd.slam.optimizer.banded.lapses.placements import RIVAL
from drslamd.slam.optimizer.banded.lapses.stretches import likely_stretches
from drslamd.slam.optimizer.banded.newton_descent import TOLERANCE
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.problem import Problem


def tried(problem: Problem) -> Tried | None:
    return best(Equations(problem), nominal(problem), 60, TOLERANCE)


@pytest.mark.parametrize("fault", [stuck, slipping])
@pytest.mark.parametrize("robots", [2, 3])
def test_the_stretch_is_found_and_behind_it_poses_are_as_if_nothing_had_been(
    robots: int, fault: object
) -> None:
    problem, truth = a_team(7, robots)
    clean = worst(nominal(problem).poses, truth)
    problem = fault(problem, 1, *FAULT)  # type: ignore[operator]
    answer = tried(problem)
    assert answer is not None
    assert worst(nominal(problem).poses, truth) > 1.5
    assert answer.gain > 10 * GAIN
    (freed,) = answer.equations.problem.freed
    assert lapse_of(problem, [4, 6, 9], freed) == Lapse(
        6, *FROM_TO, fault is stuck, is_settled=True
    )
    outside = np.ones(len(truth), dtype=bool)
    outside[robots * FAULT[0] : robots * FAULT[1]] = False
    assert worst(answer.point.poses[outside], truth[outside]) < clean + 0.5


def test_of_several_stretches_the_one_that_explains_most_is_taken() -> None:
    """Robot 0 slipped a little."""
    problem, _ = a_team(7)
    both = stuck(problem, 1, *FAULT)
    measured = both.odometry.measured.copy()
    measured[links_of(both, 0, 5, 8)] *= [1.5, 1.5, 1.0]
    both = replace(both, odometry=replace(both.odometry, measured=measured))
    assert [freed.robot for freed in likely_stretches(both)] == [0, 1]
    answer = tried(both)
    assert answer is not None
    assert answer.equations.problem.freed[0].robot == 1


def test_where_nothing_stood_or_spun_nothing_is_freed() -> None:
    problem, _ = a_team(7)
    links = links_of(problem, 1, *FAULT)
    turned = problem.odometry.measured[links] + [0.0, 0.0, 0.2]
    assert tried(mismeasured(problem, links, turned)) is None


@pytest.mark.parametrize(("times", "is_found"), [(1.01, False), (0.9, True)])
def test_what_gains_little_is_no_reason(
    times: float, is_found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = slipping(a_team(7)[0], 1, *FAULT)
    answer = tried(problem)
    assert answer is not None
    monkeypatch.setattr(lapse_search, "GAIN", times * answer.gain)
    assert (tried(problem) is not None) is is_found


def test_what_is_freed_already_is_not_tried_again() -> None:
    problem = slipping(a_team(7)[0], 1, *FAULT)
    answer = tried(problem)
    assert answer is not None
    assert tried(answer.equations.problem) is None


def test_ranges_that_no_longer_count_are_no_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """Robot 0 is said to have stood, so that nothing counts which contradicts robot 1."""
    problem = slipping(a_team(7)[0], 1, *FAULT)
    (freed,) = likely_stretches(problem)
    silent = replace(problem.ranges, sigma=np.full(len(problem.ranges), 100.0))
    useless = replace(freed, added=0.0 * freed.added)
    monkeypatch.setattr(
        lapse_search,
        "with_freed",
        lambda at, _: replace(at, ranges=silent, freed=(useless,)),
    )
    assert tried(problem) is None


@pytest.mark.parametrize("times", [0.99, 1.01])
def test_who_explains_hardly_less_may_have_been_it_as_well(
    times: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of robots 0 and 1 each has a stretch."""
    problem = slipping(a_team(7)[0], 1, *FAULT)
    (freed,) = likely_stretches(problem)
    other = replace(freed, robot=0)
    polished = lapse_search._polished

    def gaining(*args: object) -> Tried:
        answer = polished(*args)  # type: ignore[arg-type]
        return replace(answer, gain=100.0 if answer.robot else 100.0 - times * RIVAL)

    monkeypatch.setattr(lapse_search, "likely_stretches", lambda _: [freed, other])
    monkeypatch.setattr(lapse_search, "_polished", gaining)
    assert (tried(problem) is not None) is (times > 1)


@pytest.mark.parametrize(("links", "is_tried"), [(BEHIND, True), (BEHIND + 1, False)])
def test_a_stretch_behind_which_all_was_as_modelled_for_long_is_no_reason(
    links: int, is_tried: bool
) -> None:
    """It ends with keyframe 32 of robot 1."""
    problem = slipping(a_team(7)[0], 1, *FAULT)
    fitted = np.array([1e9, FROM_TO[1] + 10 * links, 1e9])
    assert (tried(replace(problem, fitted=fitted)) is not None) is is_tried


def given_stretches(monkeypatch: pytest.MonkeyPatch, *abrupt: bool) -> Problem:
    """Robots 0, 1 and so on have one each, of which some are abrupt."""
    problem = slipping(a_team(7)[0], 1, *FAULT)
    (freed,) = likely_stretches(problem)
    each = [replace(freed, robot=robot, is_abrupt=a) for robot, a in enumerate(abrupt)]
    monkeypatch.setattr(lapse_search, "likely_stretches", lambda _: each)
    return problem


@pytest.mark.parametrize(("less", "named"), [(-1.0, None), (1.0, 1)])
def test_an_abrupt_stretch_is_preferred_to_one_that_explains_a_little_more(
    less: float, named: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = given_stretches(monkeypatch, False, True)
    polished = lapse_search._polished

    def gaining(*args: object) -> Tried:
        answer = polished(*args)  # type: ignore[arg-type]
        return replace(answer, gain=100.0 if answer.robot else 100.0 + ABRUPT - RIVAL - less)

    monkeypatch.setattr(lapse_search, "_polished", gaining)
    answer = tried(problem)
    assert (answer.robot if answer else None) == named


@pytest.mark.parametrize("more", [-1.0, 1.0])
@pytest.mark.parametrize("is_abrupt", [False, True])
def test_an_abrupt_stretch_need_not_explain_as_much(
    is_abrupt: bool, more: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = given_stretches(monkeypatch, is_abrupt)
    gain = GAIN + more - ABRUPT * is_abrupt
    polished = lapse_search._polished
    monkeypatch.setattr(
        lapse_search,
        "_polished",
        lambda *args: replace(polished(*args), gain=gain),
    )
    assert (tried(problem) is not None) is (more > 0)


@pytest.mark.parametrize(
    ("abrupt", "samples", "pairs", "is_asked"),
    [(1, 2, 45, 1), (0, 2, 45, 0), (1, 3, 45, 0), (1, 2, 46, 0)],
)
def test_a_small_team_asks_for_abrupt_stretches_though_all_fits(
    abrupt: int, samples: int, pairs: int, is_asked: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = given_stretches(monkeypatch, bool(abrupt))
    n = problem.n.copy()
    (link,) = links_of(problem, 1, 20, 21)
    n[problem.odometry.j[link]] = n[problem.odometry.i[link]] + samples
    assert is_asked_for(replace(problem, n=n, pairs=pairs)) is bool(is_asked)


def test_an_abrupt_stretch_that_is_freed_or_long_ago_is_not_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(lapse_search, "has_short_links", lambda _: True)
    problem = given_stretches(monkeypatch, False, True)
    assert is_asked_for(problem)
    freed = lapse_search._possible(problem)[0]
    assert not is_asked_for(replace(problem, freed=(freed,)))
    newest = np.array([problem.n[problem.robot_id == robot].max() for robot in IDS[:3]])
    assert not is_asked_for(replace(problem, fitted=newest))


@pytest.mark.parametrize(("since", "is_asked"), [(0, False), (10, True)])
def test_of_a_robot_that_parks_an_abrupt_stretch_is_not_asked_for_again_and_again(
    since: int, is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last solution had all but so much of its way, and it ends soon behind the stretch."""
    monkeypatch.setattr(lapse_search, "has_short_links", lambda _: True)
    monkeypatch.setattr(lapse_search, "BEHIND", 100)
    problem = given_stretches(monkeypatch, False, True)
    newest = np.array([problem.n[problem.robot_id == robot].max() for robot in IDS[:3]])
    newest[1] -= since
    assert is_asked_for(replace(problem, fitted=newest)) is is_asked
