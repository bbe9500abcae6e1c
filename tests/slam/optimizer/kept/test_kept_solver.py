"""One more second from what was kept, against the same second solved anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from kept_scenes import a_team_problem
from lab.benchmark.large_teams.met_team import MetTeam, begun

from drslamd.conventions import Chain
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.optimizer.banded import banded_optimizer
from drslamd.slam.optimizer.banded.banded_solver import SETTLED
from drslamd.slam.optimizer.banded.lapses import lapse_search
from drslamd.slam.optimizer.banded.pairs import narrowing
from drslamd.slam.optimizer.kept import (
    border,
    kept_claims,
    kept_factor,
    kept_solution,
    kept_solver,
    quick_check,
)

NEAR_M, NEAR_SIGMA = 1e-4, 1.03
"""What is feared of odometry may be of some links ago, and goes up and down with each."""

Said = list[tuple[Chain, GraphEntry]]


@pytest.fixture(autouse=True)
def however_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_solver, "FEW", 0)
    monkeypatch.setattr(border, "FEW", 0)


@dataclass
class Second:
    """What was found, and what is right."""

    found: TeamEstimate
    right: TeamEstimate
    began_anew: bool

    def is_right(self) -> bool:
        off = max(
            float(np.abs(path.poses - self.found.trajectories[robot].poses)[:, :2].max())
            for robot, path in self.right.trajectories.items()
        )
        ratios = np.sqrt(np.diag(self.found.joint) / np.diag(self.right.joint))
        sigma = float(np.maximum(ratios, 1 / ratios).max())
        return off < NEAR_M and sigma < NEAR_SIGMA


def driven(
    team: MetTeam, seconds: int, said: Callable[[int, Said], Said] = lambda _, said: said
) -> Iterator[Second]:
    """Second by second.

    Args:
        said: what of the entries of a second is heard then.
    """
    for second in range(seconds):
        job = begun(team.back, team.living)
        assert job is not None
        found: TeamEstimate = job()
        numbers, graph, group, previous = job.args
        problem = banded_optimizer.build_problem(graph, group, previous, numbers)
        right = banded_optimizer.solved(problem, group, tolerance=SETTLED)
        yield Second(found, right, not isinstance(found.kept, kept_solution.Kept))
        team.back.on_solution(found)
        for chain, entry in said(second, team.entries()):
            team.back.insert(chain, entry)


@pytest.mark.slow
def test_a_team_that_drives_on_is_solved_from_what_was_kept_and_stays_right() -> None:
    """Over a step of time, and longer than a tail waits."""
    seconds = list(driven(MetTeam(4, 70, 40), 24))
    assert all(second.is_right() for second in seconds)
    assert sum(second.began_anew for second in seconds[4:]) <= 2
    # what could be checked of odometry is not that of long ago
    for second in seconds:
        if second.began_anew:
            continue
        assert isinstance(second.found.kept, kept_solution.Kept)
        then = second.found.kept.checked.links
        now = [len(path.n) - 1 for path in second.found.trajectories.values()]
        assert (now <= quick_check.GROWN * then).all()


@pytest.mark.slow
def test_entries_that_come_late_or_never_are_no_harm() -> None:
    waiting: Said = []

    def lossy(second: int, entries: Said) -> Said:
        heard = [entry for k, entry in enumerate(entries) if (second + k) % 4]
        late, waiting[:] = waiting[:], [e for k, e in enumerate(entries) if not (second + k) % 4]
        return [*heard, *(late if second % 7 else [])]

    seconds = list(driven(MetTeam(4, 70, 40), 16, lossy))
    assert all(second.is_right() for second in seconds)


@pytest.mark.slow
def test_a_robot_that_stands_while_others_drive_is_no_harm() -> None:
    def standing(_: int, entries: Said) -> Said:
        return [
            (chain, entry) if chain.robot != 2 else (chain, GraphEntry(entry.seq, None, (), (), ()))
            for chain, entry in entries
        ]

    seconds = list(driven(MetTeam(4, 70, 40), 12, standing))
    assert all(second.is_right() for second in seconds)


@pytest.mark.slow
def test_who_joins_is_solved_with_the_others() -> None:
    team = MetTeam(4, 0, 110)
    for _ in range(70):
        for chain, entry in team.entries():
            if chain.robot != 3:
                team.back.insert(chain, entry)
    held: Said = []
    again = MetTeam(4, 0, 110)
    for _ in range(75):
        held += [(chain, entry) for chain, entry in again.entries() if chain.robot == 3]

    def joining(second: int, entries: Said) -> Said:
        if second < 4:
            return [(chain, entry) for chain, entry in entries if chain.robot != 3]
        return [*(held if second == 4 else []), *entries]

    seconds = list(driven(team, 10, joining))
    assert all(second.is_right() for second in seconds)
    assert [len(second.found.trajectories) for second in seconds] == 5 * [3] + 5 * [4]


@pytest.mark.parametrize("fault", ["places", "path", "check"])
def test_whatever_does_not_fit_is_solved_anew(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    names = {"places": "_matrix", "path": "approach"}
    if fault == "check":
        monkeypatch.setattr(quick_check, "misfit_as_modelled", lambda *_: None)
    else:
        monkeypatch.setattr(kept_solver, names[fault], lambda *_, **__: None)
    seconds = list(driven(MetTeam(3, 40, 10), 3))
    assert all(second.is_right() and second.began_anew for second in seconds)


@pytest.mark.parametrize(("more", "steps"), [(0, 36), (1, 12)])
def test_steps_of_a_large_problem_are_cheaper_than_a_matrix(
    more: int, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = []
    monkeypatch.setattr(kept_solver, "approach", lambda *args: said.append(args[-1]))
    team = replace(a_team_problem(), is_near=True)
    monkeypatch.setattr(kept_solver, "MANY", team.problem.pairs + more)
    kept_solver.solve(team, (), 1e-6)
    assert said == [steps]


@pytest.mark.parametrize(("more", "is_anew"), [(0, False), (1, True)])
def test_a_small_problem_is_solved_anew(
    more: int, is_anew: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    seconds = driven(MetTeam(3, 40, 10), 6)
    *_, before = [next(seconds) for _ in range(5)]
    assert not before.began_anew
    poses = sum(len(path.n) for path in before.found.trajectories.values())
    # each robot makes one more
    monkeypatch.setattr(kept_solver, "FEW", poses + 3 + more)
    assert next(seconds).began_anew is is_anew


@pytest.mark.parametrize("is_asked", [False, True])
def test_where_wheels_changed_their_speed_at_once_a_small_team_is_solved_anew(
    is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    seconds = driven(MetTeam(3, 40, 10), 6)
    *_, before = [next(seconds) for _ in range(5)]
    assert not before.began_anew
    monkeypatch.setattr(lapse_search, "is_asked_for", lambda _: is_asked)
    assert next(seconds).began_anew is is_asked


def test_shares_that_were_kept_are_those_that_are_found_anew() -> None:
    """From the matrix that was kept, and by the solver that keeps nothing."""
    for second in list(driven(MetTeam(3, 40, 10), 4))[2:]:
        assert isinstance(second.found.kept, kept_solution.Kept)
        found, right = second.found.narrower, second.right.narrower
        for pair in right.keys() | found.keys():
            assert found.get(pair, 1.0) == pytest.approx(right.get(pair, 1.0), rel=0.06)


@pytest.mark.parametrize("few", [0, 10_000])
def test_shares_are_not_found_each_second(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_solver, "FEW", few)
    times = []
    seen_noise = narrowing.seen_noise

    def counted(*args: Any, **there: Any) -> narrowing.SeenNoise | None:
        times.append(0)
        return seen_noise(*args, **there)

    team = MetTeam(3, 40, 10)
    for _ in range(4):
        job: Any = team.back.begin(team.living)
        team.back.on_solution(job())
        for chain, entry in team.entries():
            team.back.insert(chain, entry)
        monkeypatch.setattr(narrowing, "seen_noise", counted)
    # (the first second has nothing kept; the fourth is 7 % further than the first)
    assert len(times) <= 1


def test_where_the_whole_second_derivative_is_no_valley_the_weights_lead_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []
    build = kept_factor.build

    def without(*args: Any) -> kept_factor.KeptFactor | None:
        asked.append(args[-1])
        return None if args[-1] else build(*args)

    monkeypatch.setattr(kept_factor, "build", without)
    seconds = list(driven(MetTeam(3, 40, 10), 4))
    assert asked[:2] == [True, False]
    assert all(second.is_right() for second in seconds)
    assert not any(second.began_anew for second in seconds[1:])


@pytest.mark.parametrize(("more", "is_anew"), [(0.01, False), (-0.01, True)])
def test_what_is_claimed_is_made_anew_where_the_team_is_turned(
    more: float, is_anew: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    build = kept_factor.build

    def counted(*args: Any) -> kept_factor.KeptFactor | None:
        made.append(args[0].claims is not None)
        return build(*args)

    turned = kept_solver.TURNED - more
    monkeypatch.setattr(kept_claims, "turn_since", lambda *_: -turned)
    seconds = driven(MetTeam(3, 40, 10), 5)
    for _ in range(4):
        next(seconds)
    monkeypatch.setattr(kept_factor, "build", counted)
    next(seconds)
    assert (True in made) is is_anew
