"""The figures of a case, over all its seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from lab.score.claims import WILD, Claim
from lab.trust import naming
from lab.trust.naming import Cause, Said
from lab.trust.watch import DOUBTFUL, LOCALISED, Run, Stated

WIDE_M = 0.5
"""A sigma that helps nobody."""
NAN = float("nan")


@dataclass(frozen=True)
class Figures:
    """Shares are between 0 and 1; NaN where nothing is to be measured.

    Attributes:
        nees: mean squared error of poses per degree of freedom (x, y, angle), of robots other than
            that of the frame, where they are called localised.
        inside: share of these in their own 95 % ellipse.
        pair_nees, pair_inside: the same of the poses of robots in each other.
        liars: share of localised poses that are over 1 m off at a sigma below 0.33 m; pair_liars.
        doubtful: share of poses that are called so.
        wide: share of poses with a sigma above 0.5 m.
        closure_nees: of windows that named one pose.
        wrong_unique: number of such windows that are liars, or off by a squared error beyond all
            bounds.
        connected: share of runs that end with all robots in one frame.
        ate_m: mean over those; ate_x_clean: over that of the clean twin with the same seeds;
            healthy_x_clean: of the robots that are not at fault; ate_x_today: over what is on
            record.
        bias_m: the largest range bias that was believed.
        said_s, cause_s: from when a fault could be known to the first sentence about it, and to the
            first that says what it is; the longest of all runs, infinite where one said nothing.
        named: share of runs that say it.
        wrong_names: number of runs that tell to set a key which is right as it is.
    """

    runs: int
    nees: float
    inside: float
    pair_nees: float
    pair_inside: float
    liars: float
    pair_liars: float
    doubtful: float
    wide: float
    closure_nees: float
    wrong_unique: int
    connected: float
    ate_m: float
    ate_x_clean: float
    healthy_x_clean: float
    ate_x_today: float
    bias_m: float
    said_s: float
    cause_s: float
    named: float
    wrong_names: int


def figures(
    runs: Mapping[int, Run],
    twins: Mapping[int, Run],
    today: Mapping[int, float],
    cause: Cause,
) -> Figures:
    """
    Args:
        runs, twins: by seed, of the case and of the same with nothing wrong.
        today: ATE on record by seed, m.
        cause: what may be said of what is wrong.
    """
    poses = [stated for run in runs.values() for stated in run.poses]
    pairs = [stated for run in runs.values() for stated in run.pairs]
    called, called_pairs = _called(poses), _called(pairs)
    others = _called(stated for stated in poses if not stated.of_frame)
    closures = [claim for run in runs.values() for claim in run.closures]
    wrong = [c for c in closures if c.is_lie or c.squared > WILD]
    ates = {seed: _ate(run) for seed, run in runs.items()}
    finite = [ate for ate in ates.values() if np.isfinite(ate)]
    known = [run for run in runs.values() if np.isfinite(known_s(run))]
    said = [said_after(run, cause.is_about) for run in known]
    causes = [cause_after(run, cause) for run in known]
    return Figures(
        runs=len(runs),
        nees=_mean(c.squared / 3 for c in others),
        inside=_mean(c.is_inside for c in others),
        pair_nees=_mean(c.squared / 3 for c in called_pairs),
        pair_inside=_mean(c.is_inside for c in called_pairs),
        liars=_mean(c.is_lie for c in called),
        pair_liars=_mean(c.is_lie for c in called_pairs),
        doubtful=_mean(stated.called == DOUBTFUL for stated in poses),
        wide=_mean(stated.claim.sigma_m > WIDE_M for stated in poses),
        closure_nees=_mean(c.squared / 3 for c in closures),
        wrong_unique=len(wrong),
        connected=_mean(run.connected for run in runs.values()),
        ate_m=_mean(finite),
        ate_x_clean=ratio(ates, {seed: _ate(twin) for seed, twin in twins.items()}),
        healthy_x_clean=_healthy(runs, twins),
        ate_x_today=ratio(ates, today),
        bias_m=max((run.bias_m for run in runs.values()), default=NAN),
        said_s=max(said, default=NAN) if cause.about else NAN,
        cause_s=max(causes, default=NAN) if cause.about else NAN,
        named=_mean(np.isfinite(causes)) if cause.about else NAN,
        wrong_names=sum(bool(naming.wrong_names(r.said, cause, r.at_fault)) for r in runs.values()),
    )


def ratio(ates: Mapping[int, float], others: Mapping[int, float]) -> float:
    """Mean ATE over that of others, of seeds for which both are finite."""
    both = [
        (ate, others[seed])
        for seed, ate in ates.items()
        if np.isfinite(ate) and np.isfinite(others.get(seed, NAN))
    ]
    return float(np.divide(*np.mean(both, axis=0))) if both else NAN


def _healthy(runs: Mapping[int, Run], twins: Mapping[int, Run]) -> float:
    """`ratio` of robots that are not at fault, where one robot is."""
    ill = {seed: min(run.at_fault) for seed, run in runs.items() if len(run.at_fault) == 1}
    ates = {seed: _ate(runs[seed], robot) for seed, robot in ill.items()}
    others = {s: _ate(twins[s], robot) for s, robot in ill.items() if s in twins}
    return ratio(ates, others)


def _ate(run: Run, without: int | None = None) -> float:
    """Of all robots or of all but one; infinite where nobody had a pose."""
    return run.ate_m.get(without, np.inf)


def known_s(run: Run) -> float:
    """From when a fault could be known; of a world that is broken from the first pose at least."""
    return run.evident_s if run.at_fault else max(run.evident_s, run.localised_s)


def said_after(run: Run, is_it: Callable[[Said], bool]) -> float:
    """Seconds from when it could be known to the first such sentence; infinite where none came."""
    since = known_s(run)
    return min((s.t for s in run.said if s.t >= since and is_it(s)), default=np.inf) - since


def cause_after(run: Run, cause: Cause) -> float:
    """Likewise to the first that says what it is."""
    return said_after(run, lambda said: cause.is_named(said, run.at_fault))


def _called(stated: Iterable[Stated]) -> list[Claim]:
    """Of poses that are called localised."""
    return [s.claim for s in stated if s.called == LOCALISED]


def _mean(values: Iterable[float]) -> float:
    found = list(values)
    return float(np.mean(found)) if found else NAN
