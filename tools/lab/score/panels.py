"""Panels of figures that are shared by the demo's picture and the reports: maps and errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.lines import Line2D

from lab.recordings.recording import Array
from lab.score import metrics
from lab.score.outcome import Outcome, Played

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7a5195", "#5f6b6d")
"""Told apart by everybody, by whatever cones (Okabe and Ito, and two more)."""
TRUTH = "#c9c9c9"
INK = "#333333"
EDGE_M = 0.5
STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.edgecolor": "#999999",
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#eeeeee",
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "svg.fonttype": "none",
    "svg.hashsalt": "drslamd",
}
"""Text stays text in an SVG, and the same figure is the same file."""


def colour(place: int) -> str:
    """Of the robot at this place in the order of ids."""
    return COLOURS[place % len(COLOURS)]


def aligned(recording: Played, result: Outcome) -> dict[int, Array]:
    """The final paths (k, 3), moved onto the truth as one team."""
    estimates, truths, frames = {}, {}, {}
    for robot, final in result.final.items():
        if len(final.t) < 2:
            continue
        trail = recording.trails[robot]
        estimates[robot], frames[robot] = final.poses, final.frame
        truths[robot] = metrics.at_times(trail.t, trail.truth, final.t)
    return metrics.aligned(estimates, truths, frames) if estimates else {}


def set_map(axes: Any, title: str) -> None:
    """Metres on both axes, alike."""
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(title)


def set_extent(axes: Any, poses: Array) -> None:
    """A map that shows poses (k, 3 or 2) and half a metre around them."""
    for limit, values in ((axes.set_xlim, poses[:, 0]), (axes.set_ylim, poses[:, 1])):
        limit(float(values.min()) - EDGE_M, float(values.max()) + EDGE_M)


def draw_truth(axes: Any, recording: Played) -> None:
    """A broad grey band under what is claimed, and a ring where each robot began."""
    for place, (_, trail) in enumerate(sorted(recording.trails.items())):
        axes.plot(*trail.truth[:, :2].T, color=TRUTH, lw=4.5, solid_capstyle="round", zorder=1)
        style = {"mfc": "white", "mec": colour(place), "mew": 1.5}
        axes.plot(*trail.truth[0, :2], "o", ms=6, zorder=4, **style)


def draw_paths(axes: Any, paths: Mapping[int, Array], robots: list[int]) -> None:
    """Poses (k, 3) of robots, each in its colour, with a dot where it ended."""
    for robot, poses in sorted(paths.items()):
        shade = colour(robots.index(robot))
        axes.plot(*poses[:, :2].T, color=shade, lw=1.3, zorder=3)
        axes.plot(*poses[-1, :2], "o", color=shade, ms=4.5, zorder=5)


def map_legend(axes: Any, robots: list[int]) -> None:
    """Colours of robots, the truth, begin and end."""
    handles = [
        Line2D([], [], color=colour(k), lw=2, label=f"robot {robot}")
        for k, robot in enumerate(robots)
    ]
    handles += [
        Line2D([], [], color=TRUTH, lw=4.5, label="truth"),
        Line2D([], [], color=INK, marker="o", mfc="white", lw=0, ms=6, label="begin"),
        Line2D([], [], color=INK, marker="o", lw=0, ms=4.5, label="end"),
    ]
    axes.legend(handles=handles, loc="best", ncols=2 if len(robots) > 3 else 1)


def errors_over_time(
    recording: Played, paths: Mapping[int, tuple[Array, Array]]
) -> dict[int, tuple[Array, Array, Array]]:
    """Times (k,) s, position errors m and heading errors degrees of each robot.

    Args:
        paths: times (k,) and poses (k, 3) in the frame of the truth.
    """
    out = {}
    for robot, (t, poses) in sorted(paths.items()):
        trail = recording.trails[robot]
        off = poses - metrics.at_times(trail.t, trail.truth, t)
        degrees = np.degrees(np.abs(metrics.wrapped(off[:, 2])))
        out[robot] = (t, np.hypot(off[:, 0], off[:, 1]), degrees)
    return out


def closed(figure: Any) -> None:
    """Give its memory back."""
    plt.close(figure)
