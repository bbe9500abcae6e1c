"""Moments in which odometry was wrong: links of it that are let go, one after the other.

Baarda's test says of each link by how much the cost would fall without it:

    T = e' Q^-1 e     Q = C - J H^-1 J'

e is its error, C its covariance, Q that of the error. A link that is wrong bends all others until
they fit, so what sticks out is not its own error; but only its own release takes the cost away.
The one that brings most goes first, and the team is solved again, until no other is worth it.
Descending ends in a mirror as often as not where a robot went far meanwhile; then the rest of its
path is laid down anew (`breaks`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ
from drslamd.slam.graph.timed_rows import NEVER
from drslamd.slam.optimizer.banded import linearised
from drslamd.slam.optimizer.banded.band_factor import BandFactor
from drslamd.slam.optimizer.banded.misfit import Run, runs
from drslamd.slam.optimizer.banded.newton_descent import descend
from drslamd.slam.optimizer.banded.normal_equations import Equations
from drslamd.slam.optimizer.banded.odometry_levels import (
    BEFORE,
    MEMORY,
    MOST_LEVEL,
    ROUGH,
)
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.banded.slips import breaks
from drslamd.slam.optimizer.banded.slips.breaks import Piece
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

WORTH = 20.0
"""Cost that letting a link go must take away; as modelled no link's test exceeds 10."""
EACH = 6.0
"""Of these, what each further link of one gap must be worth."""
UNUSED = 1.0
"""Likewise each range of that time: as modelled it costs less."""
NEARLY = 0.6
"""Of the greatest test: links of other robots whose test is as great are tried as well."""
LONG = 2 * GRID_HZ
"""Steps of the keyframes' grid over which counters stood: a likely cause, whatever its test ..."""
MOST_STOOD = 3
"""... of which so many are tried."""
RIGHT = 9.0
"""Squared error up to which a link that was let go is kept after all."""
LEAST_LEFT = 1e-3
"""Of the variance of an error that nothing else checks."""
MOST_ROUNDS = 6
"""Times that something is let go."""
LOST_MPS, LOST_RADPS = 0.7, 0.7
"""How fast a robot may have gone elsewhere than its wheels say: sigma of what is let go, by how
long it took. So a counter that stood for seconds is a better reason than a moment of a drive."""
LEAST_SAID = 3.0
"""Times the nominal sigma that is said at least of what was worth letting go."""
ONCE = 15 * GRID_HZ
"""Steps of the grid that one fault lasts at most; who stands for longer is parked."""
STEPS = 25
"""A path that is bent back over half a minute takes more of them than other rounds do."""
SURE = 15.0
"""Cost by which another place must be worse to be excluded."""


@dataclass(frozen=True)
class Released:
    """
    Attributes:
        equations: with odometry that was let go where it was wrong.
        point: its solution, to `ROUGH`.
        lost: (m,) which links were let go.
        other: another place that cannot be excluded.
    """

    equations: Equations
    point: Point
    lost: NDArray[np.bool_]
    other: Point | None = None


def released(equations: Equations, nominal: Point) -> Released:
    """The solution without the links that are not worth having."""
    best = Released(equations, nominal, np.zeros(len(equations.problem.odometry), dtype=bool))
    test = gains(equations, nominal)
    for _ in range(MOST_ROUNDS):
        if test is None or (test.max(initial=0.0) < WORTH / 2 and not _has_runs(best)):
            break
        better = _better(equations, best, test)
        if better is None:
            break
        best, test = better, gains(better.equations, better.point)
    return _kept(equations, best)


def _better(equations: Equations, best: Released, test: Array) -> Released | None:
    """The best that may be let go beside what was; None where nothing is worth it."""
    worth, tried = _cost(best) - WORTH + EACH, []
    for choice in _choices(equations, best, test):
        tried.append(_solved(equations, best, *choice))
        if _cost(tried[-1]) < worth and _is_all(tried[-1]):
            break
    better = min(tried, key=_cost, default=None)
    return None if better is None or _cost(better) > worth else _with_rival(better, tried)


def _is_all(found: Released) -> bool:
    """Is nothing left to explain? Of two robots alone the other one may be as good a reason."""
    if found.other is not None or len(found.equations.problem.priors.scale) == 2:
        return False
    left = gains(found.equations, found.point)
    return left is not None and left.max(initial=0.0) < WORTH / 2 and not _has_runs(found)


def _has_runs(found: Released) -> bool:
    return bool(runs(found.equations.problem, found.point))


def _with_rival(best: Released, tried: list[Released]) -> Released:
    """With the solution farthest from it that cannot be excluded, as to where robots are now."""
    rivals = [best.other] if best.other is not None else []
    rivals += [r.point for r in tried if r is not best and _cost(r) < _cost(best) + SURE]
    robot = best.equations.problem.robot
    last = len(robot) - 1 - np.unique(robot[::-1], return_index=True)[1]
    if not rivals:
        return best
    apart = [np.abs(r.poses[last, :2] - best.point.poses[last, :2]).max() for r in rivals]
    return replace(best, other=rivals[int(np.argmax(apart))])


def _kept(equations: Equations, found: Released) -> Released:
    """With the links that turned out to be right."""
    lost = found.lost & (squares(equations.problem, found.point) > RIGHT)
    if (lost == found.lost).all():
        return found
    again = _believed(equations, found.point, lost, found.point.poses)
    return replace(again, other=found.other) if _cost(again) < _cost(found) else found


def squares(problem: Problem, point: Point) -> Array:
    """(m,) squared error of each link in units of its own covariance."""
    return np.asarray(
        np.einsum("ki,kij,kj->k", point.link, problem.odometry.information, point.link)
    )


def _cost(found: Released) -> float:
    ranges = found.equations.problem.ranges
    unused = float(np.count_nonzero(ranges.sigma > LOST_MPS))
    let_go = EACH * float(np.count_nonzero(found.lost)) + UNUSED * unused
    return found.equations.cost(found.point, _threshold(found)) + let_go


def _threshold(found: Released) -> Array:
    """One for all, or a solution that scatters more would cost less."""
    problem = found.equations.problem
    return np.full(problem.pairs, problem.model.cauchy_sigmas)


def _choices(
    equations: Equations, best: Released, test: Array
) -> Iterator[tuple[Index, Piece | None]]:
    """Links (k,) that may go together, and how the rest of their robot's path lies then; the
    likeliest first.

    Args:
        equations: with all links as configured.
        test: (m,) see `gains`.
    """
    problem = equations.problem
    odometry, n = problem.odometry, problem.n
    test = np.where(best.lost | ~_near(problem, best.lost), 0.0, test)
    lasted = n[odometry.j] - n[odometry.i]
    stood = np.flatnonzero((lasted >= LONG) & (lasted <= ONCE) & (test > 0))
    stood = stood[np.argsort(-test[stood], kind="stable")[:MOST_STOOD]]
    gaps = [(int(odometry.robot[k]), int(n[odometry.i[k]])) for k in stood]
    gaps += _begun(problem, _suspects(runs(problem, best.point)), test)
    single = []
    for robot in range(len(problem.priors.scale)):
        of_robot = np.where(odometry.robot == robot, test, 0.0)
        if of_robot.max() >= max(NEARLY * float(test.max()), WORTH / 2):
            single.append(int(np.argmax(of_robot)))
    if not best.lost.any():
        gaps += [(int(odometry.robot[k]), int(n[odometry.i[k]])) for k in single]
    for robot, begun in dict.fromkeys(gaps):
        after = np.flatnonzero((odometry.robot == robot) & (n[odometry.i] >= begun))
        loose = best.lost.copy()
        loose[after] = True
        free = _believed(equations, best.point, loose, best.point.poses).point
        laid = breaks.piece(problem, free, robot, begun)
        yield (after if laid is None else after[n[odometry.j[after]] <= n[laid.places[0]]]), laid
    for link in single:
        yield np.array([link]), None


def _near(problem: Problem, lost: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(m,) which links may be of the same fault as those that were let go; all before any was."""
    odometry = problem.odometry
    near = np.ones(len(odometry), dtype=bool)
    for k in np.flatnonzero(lost):
        near &= odometry.robot == odometry.robot[k]
        near &= np.abs(problem.n[odometry.j] - problem.n[odometry.i[k]]) <= ONCE
        near &= np.abs(problem.n[odometry.i] - problem.n[odometry.j[k]]) <= ONCE
    return near


def _begun(
    problem: Problem, suspects: list[tuple[int, int]], test: Array
) -> Iterator[tuple[int, int]]:
    """Of each suspect the keyframe before the link that sticks out most of late."""
    odometry, n = problem.odometry, problem.n
    for robot, since in suspects:
        late = np.flatnonzero((odometry.robot == robot) & (n[odometry.j] >= since - BEFORE))
        if len(late) and test[late].any():
            yield robot, int(n[odometry.i[late[int(np.argmax(test[late]))]]])


def _suspects(found: list[Run]) -> list[tuple[int, int]]:
    """Robots in most of the runs of outliers, and their keyframes at the first of them."""
    begun: dict[int, list[int]] = {}
    for run in found:
        begun.setdefault(run.i, []).append(run.n_i)
        begun.setdefault(run.j, []).append(run.n_j)
    most = max((len(n) for n in begun.values()), default=0)
    return [(robot, min(n)) for robot, n in begun.items() if len(n) == most]


def _solved(equations: Equations, best: Released, links: Index, laid: Piece | None) -> Released:
    """The team solved without some links."""
    lost = best.lost.copy()
    lost[links] = True
    start = best.point.poses.copy()
    if laid is not None:
        start[laid.places] = laid.poses
    found = _believed(equations, best.point, lost, start)
    if laid is None or laid.margin > SURE:
        return found
    start[laid.places] = laid.other
    return replace(found, other=_believed(equations, best.point, lost, start).point)


def _believed(equations: Equations, near: Point, lost: NDArray[np.bool_], start: Array) -> Released:
    problem = without(equations.problem, lost)
    initial = start.copy()
    # the gauge is held where the frame begins
    initial[problem.gauge] = equations.problem.initial[problem.gauge]
    believed = Equations(replace(problem, initial=initial), like=equations)
    point = descend(believed, near.calibration, STEPS, ROUGH)
    return Released(believed, point, lost)


def without(problem: Problem, lost: NDArray[np.bool_]) -> Problem:
    """The problem with links that say nothing but how long they took.

    While counters stand there are no keyframes, and what was ranged meanwhile stands at those of
    either end: it says little of where they are.
    """
    odometry, ranges = problem.odometry, problem.ranges
    seconds = np.minimum(problem.n[odometry.j] - problem.n[odometry.i], ONCE) / GRID_HZ * lost
    sigma = seconds[:, None] * [LOST_MPS, LOST_MPS, LOST_RADPS]
    covariance = odometry.covariance + (sigma**2)[:, :, None] * np.eye(3)
    way = np.zeros(len(problem.robot))
    stood = np.where(seconds * GRID_HZ >= LONG, LOST_MPS * seconds, 0.0)
    for ends in (odometry.i, odometry.j):
        np.maximum.at(way, ends, stood)
    apart = np.hypot(ranges.sigma, np.hypot(way[ranges.i], way[ranges.j]))
    return replace(
        problem,
        odometry=replace(odometry, covariance=covariance),
        ranges=replace(ranges, sigma=apart),
    )


def gains(equations: Equations, point: Point) -> Array | None:
    """(m,) Baarda's test of each link; None of a system that cannot be solved."""
    problem = equations.problem
    factor = BandFactor.of(equations.weighed(point))
    if factor is None:
        return None
    odometry = problem.odometry
    blocks = factor.covariance_blocks(equations.layout.odometry_unknowns(odometry))
    if blocks is None:
        return None
    jacobian = linearised.odometry_jacobian(problem, point.poses)
    left = odometry.covariance - jacobian @ blocks @ np.swapaxes(jacobian, 1, 2)
    sigma = np.sqrt(np.einsum("kii->ki", odometry.covariance))
    left /= sigma[:, :, None] * sigma[:, None, :]
    values, vectors = np.linalg.eigh((left + np.swapaxes(left, 1, 2)) / 2)
    along = np.einsum("kij,ki->kj", vectors, point.link / sigma)
    # a link that goes is still held by what it may be at most
    return np.asarray((along**2 / (np.maximum(values, 0.0) + LEAST_LEFT)).sum(axis=1))


def seen(problem: Problem, point: Point, lost: NDArray[np.bool_]) -> Array:
    """(m,) variance of each link over the nominal one, as far as it was seen.

    Args:
        problem: with all links as configured.
    """
    found = np.clip(squares(problem, point) / 3, LEAST_SAID**2, MOST_LEVEL**2)
    return np.asarray(np.where(lost, found, 1.0))


def lately(problem: Problem, found: Array) -> Array:
    """(m,) likewise of the last seconds; of two robots alone nobody can say which of them it was.

    Args:
        found: see `seen`.
    """
    odometry, n = problem.odometry, problem.n[problem.odometry.j]
    robots, said = len(problem.priors.scale), found.copy()
    for k in np.flatnonzero(found > 1):
        for robot in range(robots) if robots == 2 else [int(odometry.robot[k])]:
            after = np.flatnonzero((odometry.robot == robot) & (odometry.j >= odometry.j[k]))
            near = after[n[after] <= n[after].min(initial=NEVER) + MEMORY]
            said[near] = np.maximum(said[near], found[k])
    return np.asarray(said)
