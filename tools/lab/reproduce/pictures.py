"""Heat maps, trajectory panels and sweeps as PNG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot as plt

from drslamd.slam.relative_pose import algorithm_1
from drslamd.slam.relative_pose.window import Window
from lab.files import drawn
from lab.recordings.recording import Array
from lab.reproduce import dpgo, paper_column
from lab.reproduce.experiment import PAIRS, TYPICAL_SEED, Trial, trial
from lab.reproduce.tally import Tally
from lab.reproduce.window_columns import DELTAS, ODOMETRY_NOISE, RANGE_LIMITS, RANGE_NOISE
from lab.score import metrics

SHOWN_TAU, SHOWN_EPSILON = 50, 0.5
"""The paper's best row."""
FINE = 0.05
SWEPT = ("search step delta [rad]", "range limit, of the largest", "noise on odometry [m]")


def draw(total: Tally, folder: Path) -> list[str]:
    """All pictures; the names of the files."""
    data = trial(TYPICAL_SEED)
    heat_maps(data, folder / "heat-maps.png")
    panels(data, folder / "panels.png")
    names = ["heat-maps.png", "panels.png"]
    if any(name.startswith("sweep/") for name in total.sums):
        sweeps(total, folder / "sweeps.png")
        names.append("sweeps.png")
    return names


def mean_residuals(window: Window) -> tuple[Array, Array]:
    """Angles (m,) and mean |residual| (m, m) in metres over phi and theta, at the latest range."""
    angles = np.arange(-np.pi, np.pi, FINE)
    phi, theta = (x.ravel() for x in np.meshgrid(angles, angles, indexing="ij"))
    r = window.ranges[-1]
    poses = np.stack([r * np.cos(phi), r * np.sin(phi), theta], axis=-1)
    found = algorithm_1.window_residuals(poses, window.a_points, window.b_points, window.ranges)
    return angles, np.abs(found).mean(axis=1).reshape(len(angles), len(angles))


def rivalry(cost: Array) -> float:
    """Best minimum over the second best one, far from it: near 1 when they cannot be told apart."""
    m = len(cost)
    best = np.unravel_index(int(np.argmin(cost)), cost.shape)
    away = [np.minimum((np.arange(m) - b) % m, (b - np.arange(m)) % m) for b in best]
    far = (away[0][:, None] > m // 8) | (away[1][None, :] > m // 8)
    ring = np.pad(cost, 1, mode="wrap")
    around = [ring[i : i + m, j : j + m] for i in range(3) for j in range(3)]
    lowest = (cost <= np.min(around, axis=0)) & far
    return float(cost.min() / cost[lowest].min()) if lowest.any() else 0.0


def heat_maps(data: Trial, path: Path) -> None:
    """The easiest and the most ambiguous of some windows: both paths, and the residual."""
    some = range(0, len(data.truth[0]), 20)
    all_of_them = (data.window(pair, k, SHOWN_TAU) for pair in PAIRS for k in some)
    windows = [window for window in all_of_them if window is not None]
    maps = [mean_residuals(window) for window in windows]
    order = np.argsort([rivalry(cost) for _, cost in maps])
    figure, axes = plt.subplots(2, 2, figsize=(9, 8), dpi=110)
    for row, (words, at) in enumerate((("easy", order[0]), ("ambiguous", order[-1]))):
        window, (angles, cost) = windows[at], maps[at]
        axes[row, 0].plot(*window.a_points.T, label="robot a, in its own frame")
        axes[row, 0].plot(*window.b_points.T, label="robot b, in its own frame")
        axes[row, 0].set_aspect("equal", adjustable="datalim")
        axes[row, 0].set(xlabel="x [m]", ylabel="y [m]", title=f"{words}: odometry")
        axes[row, 0].legend()
        span = (angles[0], angles[-1], angles[0], angles[-1])
        image = axes[row, 1].imshow(cost.T, origin="lower", extent=span, aspect="auto")
        axes[row, 1].set(xlabel="phi [rad]", ylabel="theta [rad]", title="mean residual [m]")
        figure.colorbar(image, ax=axes[row, 1])
    _save(figure, path)


def panels(data: Trial, path: Path) -> None:
    """Raw closures, those that consistency keeps, and DPGO: robots 1 and 2 as robot 0 has them."""
    raw = {pair: paper_column.closures(data, pair, SHOWN_TAU, []) for pair in PAIRS}
    lengths = {pair: paper_column.consistency(data, pair, c) for pair, c in raw.items()}
    kept = {p: c.chosen(paper_column.inliers(lengths[p], SHOWN_EPSILON)) for p, c in raw.items()}
    solved = dpgo.solve(dpgo.graph(data.odometry, kept))
    figure, axes = plt.subplots(1, 3, figsize=(16, 5.5), dpi=110)
    truth = data.truth
    origin = truth[0][0]
    for axis, words in zip(axes, ("raw closures", "after PCM", "after DPGO"), strict=True):
        for robot in (1, 2):
            true = metrics.relative(origin[None], truth[robot])
            axis.plot(*true[:, :2].T, color="black", lw=0.7, alpha=0.6)
            colour = f"C{robot}"
            if words == "after DPGO":
                axis.plot(*solved[robot][:, :2].T, color=colour, label=f"robot {robot}")
            else:
                closures = (raw if words == "raw closures" else kept)[0, robot]
                here = metrics.relative(origin[None], truth[0][closures.k])
                places = metrics.compose(here, closures.poses)
                axis.plot(*places[:, :2].T, ".", ms=3, color=colour, label=f"robot {robot}")
        axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=words)
        axis.legend(loc="upper right")
    _save(figure, path)


def sweeps(total: Tally, path: Path) -> None:
    """Errors against the search step, the range limit and the odometry noise."""
    figure, axes = plt.subplots(2, 3, figsize=(15, 8), dpi=110)
    for row, unit in enumerate(("m", "deg")):
        for way in ("coarse", "paper", "drslamd"):
            names = [f"sweep/delta/{delta}/{way}/{unit}" for delta in DELTAS]
            _line(axes[row, 0], DELTAS, [total[n].mean for n in names], way, "-")
        for way, style in (("paper", "-"), ("drslamd", "--")):
            for sigma in RANGE_NOISE:
                names = [f"sweep/range/{limit}/{sigma}/{way}/{unit}" for limit in RANGE_LIMITS]
                values = [total[n].mean for n in names]
                _line(axes[row, 1], RANGE_LIMITS, values, f"{way}, +{sigma} m", style)
            names = [f"sweep/odometry/{level[0]}/{way}/{unit}" for level in ODOMETRY_NOISE]
            levels = [level[0] for level in ODOMETRY_NOISE]
            _line(axes[row, 2], levels, [total[n].mean for n in names], way, style)
        for axis, what in zip(axes[row], SWEPT, strict=True):
            axis.set(xlabel=what, ylabel="error [m]" if unit == "m" else "error [degrees]")
            axis.legend(fontsize=7)
    _save(figure, path)


def _line(axis: Any, x: Sequence[float], y: Sequence[float], label: str, style: str) -> None:
    axis.plot(x, y, style, marker="o", ms=3, label=label)


def _save(figure: Any, path: Path) -> None:
    figure.tight_layout()
    drawn(figure, path)
    plt.close(figure)
