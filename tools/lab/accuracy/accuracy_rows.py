"""The rows of tools/accuracy: what is played, what is measured, what is wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.tuning import DEFAULTS, Tuning
from lab.play import edge_run, virtual_team
from lab.recordings import injection, murp, pyfg, range_only_cl, swust, vub
from lab.recordings.recording import EdgeRecording, Recording
from lab.score import metrics, outcome, relative_errors
from lab.score.outcome import Outcome
from lab.score.relative_errors import RelativeErrors

SEEDS = range(10)
EDGE_SEEDS = range(3)
CHI2_98, CHI2_NEVER = 14.2, 50.0
"""Bounds of the squared Mahalanobis error, 3 degrees of freedom: 99.7 % and never."""
BROKEN_M, BROKEN_DEG = 0.25, 10.0
"""Odometry that is wrong by so much within a second is broken."""
MEMORY_S = 40.0
"""A closure may have looked back so far."""


@dataclass(frozen=True)
class Figure:
    """One promise and what became of it."""

    recording: str
    measure: str
    reached: float
    wanted: float
    unit: str = ""
    is_least: bool = False

    @property
    def is_reached(self) -> bool:
        return self.reached >= self.wanted if self.is_least else self.reached <= self.wanted


@dataclass(frozen=True)
class Setup:
    """Of every robot: sections of TOML that it gets, and constants of its estimator."""

    extra: str = ""
    tuning: Tuning = DEFAULTS


@dataclass(frozen=True)
class Row:
    """Some figures of one kind of recording; `measure` gets the data folder and the set-up."""

    needs: str
    measure: Callable[[Path, Setup], list[Figure]]


def _median(figures: Iterable[list[Figure]]) -> list[Figure]:
    """Figure by figure the median over runs."""
    return [
        replace(runs[0], reached=float(np.median([figure.reached for figure in runs])))
        for runs in zip(*figures, strict=True)
    ]


# TIERS

TIERS = "tiers_turtlebots/tiers_4robots_cora.pyfg"


def _tiers(data: Path, setup: Setup) -> list[Figure]:
    recording = pyfg.read(data / TIERS)
    result = virtual_team.run(recording, extra=setup.extra, tuning=setup.tuning)
    team = outcome.score(recording, result)["team"]
    off = max(modules_off(recording, result).values(), default=float("inf"))
    return [
        Figure("TIERS", "joint ATE RMSE", team["ate_rmse_m"], 0.027, "m"),
        Figure("TIERS", "standing node L0", off, 0.03, "m"),
        Figure("TIERS", "rotation, mean", team["rot_mean_deg"], 1.8, "deg"),
        Figure("TIERS", "rotation, centred", team["rot_mean_centred_deg"], 0.6, "deg"),
    ]


def modules_off(recording: Recording, result: Outcome) -> dict[int, float]:
    """How far standing nodes are off, m, in the frame in which all paths fit the truth best."""
    found, true = [], []
    for robot, path in result.final.items():
        trail = recording.trails[robot]
        found.append(path.poses[:, :2])
        true.append(metrics.at_times(trail.t, trail.truth, path.t)[:, :2])
    shift = metrics.alignment(np.concatenate(found), np.concatenate(true))
    return {
        node: float(np.hypot(*(metrics.compose(shift, np.append(place, 0.0))[:2] - truth)))
        for node, place in modules(result).items()
        if (truth := recording.nodes.get(node)) is not None
    }


def modules(result: Outcome) -> dict[int, NDArray[np.float64]]:
    """Places (2,) of standing nodes by their ids, as the lowest robot has them."""
    told = result.status[min(result.status)]["graph"]["modules"]
    return {int(node): np.array([place["x_m"], place["y_m"]]) for node, place in told.items()}


def _tiers_wronged(data: Path, setup: Setup) -> list[Figure]:
    recording = pyfg.read(data / TIERS)

    def once(seed: int) -> list[Figure]:
        played = injection.wronged(recording, 0.10, seed)
        result = virtual_team.run(played, seed=seed, extra=setup.extra, tuning=setup.tuning)
        team = outcome.score(played, result)["team"]
        ate = team["ate_rmse_m"] if team else float("inf")
        name = "TIERS, 10 % in bursts, biases, seeds 0-9"
        return [Figure(name, "joint ATE RMSE, median", ate, 0.06, "m")]

    return _median(map(once, SEEDS))


# pairs


def _pair_figures(
    name: str, errors: RelativeErrors, live: RelativeErrors, metres: float, degrees: float
) -> list[Figure]:
    """Of windows, which answer for themselves, and of published poses, which remember more."""
    out = []
    for what, found in (("windows", errors), ("published", live)):
        position, rotation = found.median
        out += [
            Figure(name, f"relative pose, {what}, position, median", position, metres, "m"),
            Figure(name, f"relative pose, {what}, rotation, median", rotation, degrees, "deg"),
        ]
    return out


def _played(recording: Recording, setup: Setup) -> tuple[Outcome, RelativeErrors, RelativeErrors]:
    result = virtual_team.run(recording, extra=setup.extra, tuning=setup.tuning)
    return (
        result,
        relative_errors.of_windows(recording, result),
        relative_errors.published(recording, result),
    )


def _vub(data: Path, setup: Setup) -> list[Figure]:
    """Of windows that had 40 s to look back on, as the figure wanted has it."""
    recording = vub.read(data / "vub_two_turtlebots" / "exp4_los.csv")
    _, windows, live = _played(recording, setup)
    full = [errors.chosen(errors.t >= MEMORY_S) for errors in (windows, live)]
    return _pair_figures(f"VUB exp4, after {MEMORY_S:.0f} s", full[0], full[1], 0.15, 3.0)


def _vub_broken(data: Path, setup: Setup) -> list[Figure]:
    """Accepted are windows with one pose that module 2 kept."""
    found: list[float] = []
    for number in (1, 2, 3):
        recording = vub.read(data / "vub_two_turtlebots" / f"exp{number}_los.csv")
        result = virtual_team.run(recording, extra=setup.extra, tuning=setup.tuning)
        accepted = [c for c in result.closures if c.kept and c.verdict == "unique"]
        when = np.array([c.t for c in accepted])
        touched = _while_broken(recording, when)
        found += [
            relative_errors.squared_mahalanobis(recording, c)
            for c, is_touched in zip(accepted, touched, strict=True)
            if is_touched
        ]
    name = f"VUB exp1-3, {len(found)} closures accepted while odometry is broken"
    chi2 = np.array(found or [0.0])
    share, what = (
        float(np.mean(chi2 <= CHI2_98)),
        f"share with a squared error of at most {CHI2_98}",
    )
    return [
        Figure(name, what, share, 0.98, is_least=True),
        Figure(name, "largest squared error", float(chi2.max()), CHI2_NEVER),
    ]


def _while_broken(recording: Recording, when: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which times (k,) have broken odometry of either robot in the memory before them."""
    touched = np.zeros(len(when), dtype=bool)
    for trail in recording.trails.values():
        t = trail.t[trail.t < trail.t[-1] - 1]
        steps = [
            metrics.relative(metrics.at_times(trail.t, p, t), metrics.at_times(trail.t, p, t + 1))
            for p in (trail.odometry, trail.truth)
        ]
        off = steps[0] - steps[1]
        turn = np.degrees(np.abs(metrics.wrapped(off[:, 2])))
        bad = t[(np.hypot(off[:, 0], off[:, 1]) > BROKEN_M) | (turn > BROKEN_DEG)]
        touched |= np.array([bool(((bad <= x) & (bad >= x - MEMORY_S)).any()) for x in when], bool)
    return touched


TAPED_M = 2.05
"""Between the two standing nodes of range_only_CL, by tape."""


def _range_only(data: Path, setup: Setup) -> list[Figure]:
    recording = range_only_cl.read(data / "range_only_cl" / "data190313.mat")
    result, windows, live = _played(recording, setup)
    a, b = sorted(recording.trails)

    def both(errors: RelativeErrors) -> RelativeErrors:
        moving = [relative_errors.moving(recording.trails[r], errors.t) for r in (a, b)]
        return errors.chosen(moving[0] & moving[1])

    name = "range_only_CL, both moving"
    figures = _pair_figures(name, both(windows), both(live), 0.12, 8.0)
    off = abs(bias_not_found(recording, a, b, result))
    there = list(modules(result).values())
    apart = float(np.hypot(*(there[0] - there[1]))) if len(there) == 2 else float("inf")
    return [
        *figures,
        Figure("range_only_CL", "range bias, error", off, 0.05, "m"),
        Figure(
            "range_only_CL", "standing nodes, error of distance", abs(apart - TAPED_M), 0.15, "m"
        ),
    ]


def bias_not_found(recording: Recording, a: int, b: int, found: Outcome) -> float:
    """Median of what ranges of a pair have too much beyond what was found of it, m.

    What is found of a range is the bias of its pair and the near-range bias over its distance.
    Where distances vary little the two cannot be told apart, so only their sum is true or not.
    """
    rows = recording.ranges[(recording.ranges[:, 1] == a) & (recording.ranges[:, 2] == b)]
    ends = relative_errors.true_relative(recording, a, b, rows[:, 0])
    distances = np.hypot(ends[:, 0], ends[:, 1])
    near = (found.near_bias_m or 0.0) * DEFAULTS.ranges.near_range_shape(distances)
    return float(np.median(rows[:, 3] - distances - found.bias_m.get(f"{a}-{b}", 0.0) - near))


def _murp(data: Path, setup: Setup) -> list[Figure]:
    figures = []
    for trial in ("16", "17"):
        path = data / "murp_linktrack" / f"{trial}_base-2_targ-3_win-1_step-1.csv"

        def once(seed: int, path: Path = path, trial: str = trial) -> list[Figure]:
            _, windows, live = _played(murp.read(path, seed), setup)
            return _pair_figures(f"MURP {trial}, seeds 0-9", windows, live, 0.15, 3.0)

        figures += _median(map(once, SEEDS))
    return figures


# edges

PRECISION = {0.10: 0.99, 0.20: 0.99, 0.40: 0.97}
RECALL, RATIO = 0.95, 1.2
MISLED = 20
"""False edges that agree, and all that a pair has."""


def _swust(data: Path, setup: Setup) -> list[Figure]:
    """Worst of the seeds."""
    recording = swust.read(data / "swust_three_robots")
    clean = edge_run.run(recording, setup.extra, tuning=setup.tuning)[0]
    clean_ate = _ate(recording, clean)
    figures = []
    for share, precision in PRECISION.items():
        kept_true, kept_share, ratios = [], [], []
        for seed in EDGE_SEEDS:
            played, is_true = injection.with_false_edges(recording, share, seed)
            result, kept = edge_run.run(played, setup.extra, tuning=setup.tuning)
            kept_true.append(float(is_true[kept].mean()))
            kept_share.append(float(kept[is_true].mean()))
            ratios.append(_ate(played, result) / clean_ate)
        name = f"SWUST, {share:.0%} false edges, worst of seeds 0-{EDGE_SEEDS[-1]}"
        figures += [
            Figure(name, "precision", min(kept_true), precision, "", True),
            Figure(name, "recall", min(kept_share), RECALL, "", True),
            Figure(name, f"ATE over the clean one ({clean_ate:.3f} m)", max(ratios), RATIO),
        ]
    return figures


def _swust_misled(data: Path, setup: Setup) -> list[Figure]:
    """One pair at a time is wrong as a whole, and module 2 cannot see it; against a run without
    that pair, of which nothing better is known then."""
    recording = swust.read(data / "swust_three_robots")
    ratios = []
    for seed, pair in enumerate(np.unique(recording.edges[:, 1:3], axis=0)):
        others = (recording.edges[:, 1:3] != pair).any(axis=1)
        without = replace(recording, edges=recording.edges[others])
        played = injection.misled(recording, pair, MISLED, seed)
        both = [
            edge_run.run(r, setup.extra, optimizer="closures", tuning=setup.tuning)[0]
            for r in (played, without)
        ]
        ratios.append(_ate(played, both[0]) / _ate(without, both[1]))
    name = f"SWUST, one pair has {MISLED} false edges that agree, worst of three pairs"
    return [Figure(name, "ATE over that without the pair, `closures`", max(ratios), RATIO)]


def _ate(recording: EdgeRecording, result: Outcome) -> float:
    team = outcome.score(recording, result)["team"]
    if not result.is_one_team or team is None:
        return float("inf")
    return float(team["ate_rmse_m"])


ROWS = {
    "tiers": Row(TIERS, _tiers),
    "tiers-wronged": Row(TIERS, _tiers_wronged),
    "vub": Row("vub_two_turtlebots/exp4_los.csv", _vub),
    "vub-broken": Row("vub_two_turtlebots/exp1_los.csv", _vub_broken),
    "range-only": Row("range_only_cl/data190313.mat", _range_only),
    "murp": Row("murp_linktrack", _murp),
    "swust": Row("swust_three_robots", _swust),
    "swust-misled": Row("swust_three_robots", _swust_misled),
}
