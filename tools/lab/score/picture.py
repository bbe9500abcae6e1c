"""A run at a glance: what drslamd was given, dead reckoning, what it found, errors over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from lab.files import drawn
from lab.recordings.recording import Array, Recording
from lab.score import metrics, panels
from lab.score.outcome import Outcome, dead_reckoning, score

SIZE_INCHES = (13.0, 8.6)
MISSING = "no robot is localised"


def draw(recording: Recording, outcome: Outcome, path: Path) -> int:
    """Write a picture, whole or not at all; the exit code.

    The estimate is aligned to the truth as one team, dead reckoning was given the true start.
    """
    robots = sorted(recording.trails)
    scores, found = score(recording, outcome), panels.aligned(recording, outcome)
    given = dead_reckoning(recording)
    with plt.rc_context(panels.STYLE):
        figure = plt.figure(figsize=SIZE_INCHES, dpi=110, layout="constrained")
        halves: Any = figure.subfigures(2, 1, height_ratios=(1.75, 1))
        maps, errors = halves
        _maps(maps, recording, robots, given, found, scores)
        _errors(errors, recording, robots, given, found, outcome)
        figure.suptitle(recording.name, fontweight="bold")
        code = drawn(figure, path)
        panels.closed(figure)
    return code


def _maps(
    figure: Any,
    recording: Recording,
    robots: list[int],
    given: dict[int, Array],
    found: dict[int, Array],
    scores: dict[str, Any],
) -> None:
    blind, told, ours = figure.subplots(1, 3)
    starts = {
        robot: metrics.relative(trail.odometry[:1], trail.odometry)
        for robot, trail in recording.trails.items()
    }
    panels.draw_paths(blind, starts, robots)
    panels.set_map(blind, "What drslamd was given: odometry, no start")
    panels.draw_truth(told, recording)
    panels.draw_paths(told, given, robots)
    panels.set_map(told, f"Dead reckoning, true start given: {_said(scores['odometry']['team'])}")
    panels.draw_truth(ours, recording)
    panels.draw_paths(ours, found, robots)
    panels.set_map(ours, f"drslamd, no start given: {_said(scores['team'])}")
    seen = [trail.truth for trail in recording.trails.values()] + [*given.values(), *found.values()]
    for panel in (told, ours):
        panels.set_extent(panel, np.concatenate(seen))
    if not found:
        ours.text(0.5, 0.5, MISSING, transform=ours.transAxes, ha="center", color="#aa0000")
    panels.map_legend(told, robots)


def _said(errors: dict[str, float] | None) -> str:
    return MISSING if errors is None else f"{100 * errors['ate_rmse_m']:.1f} cm"


def _errors(
    figure: Any,
    recording: Recording,
    robots: list[int],
    given: dict[int, Array],
    found: dict[int, Array],
    outcome: Outcome,
) -> None:
    """Position and heading; dead reckoning dashed, the estimate drawn through."""
    axes = figure.subplots(1, 2, sharex=True)
    wheels = {robot: (recording.trails[robot].t, given[robot]) for robot in robots}
    estimate = {robot: (outcome.final[robot].t, found[robot]) for robot in found}
    for paths, style in ((wheels, {"ls": (0, (4, 2)), "lw": 0.9}), (estimate, {"lw": 1.6})):
        for robot, (t, *off) in panels.errors_over_time(recording, paths).items():
            for panel, error in zip(axes, off, strict=True):
                panel.plot(t, error, color=panels.colour(robots.index(robot)), **style)
    for panel, title, unit in zip(axes, ("Position", "Heading"), ("[m]", "[degrees]"), strict=True):
        panel.set_title(f"{title} error: dead reckoning dashed, drslamd drawn through")
        panel.set_xlabel("time [s]")
        panel.set_ylabel(unit)
        panel.set_ylim(bottom=0)
        panel.margins(x=0)
    ends = [float(np.max(trail.t)) for trail in recording.trails.values()]
    axes[0].set_xlim(0, max(ends))
