"""Trajectories as a picture: what the wheels said, what the team estimated, what was true."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from lab.recordings.recording import Recording
from lab.score import metrics
from lab.score.outcome import Outcome, dead_reckoning


def draw(recording: Recording, outcome: Outcome, path: Path) -> None:
    """Write a PNG; the estimate is aligned to the truth as a team, the odometry is not."""
    estimates, truths, frames = {}, {}, {}
    for robot, final in outcome.final.items():
        trail = recording.trails[robot]
        estimates[robot], frames[robot] = final.poses, final.frame
        truths[robot] = metrics.at_times(trail.t, trail.truth, final.t)
    aligned = metrics.aligned(estimates, truths, frames) if estimates else {}
    wheels = dead_reckoning(recording)
    figure, axes = plt.subplots(figsize=(9, 9), dpi=110)
    for number, (robot, trail) in enumerate(sorted(recording.trails.items())):
        colour = f"C{number}"
        axes.plot(*trail.truth[:, :2].T, color="black", lw=0.8, alpha=0.5)
        axes.plot(*wheels[robot][:, :2].T, color=colour, lw=0.9, ls=":")
        if robot in aligned:
            axes.plot(*aligned[robot][:, :2].T, color=colour, lw=1.6, label=f"robot {robot}")
        axes.plot(*trail.truth[0, :2], "o", color=colour, ms=5)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(f"{recording.name}: estimate, odometry (dotted), truth (black)")
    axes.legend(loc="best")
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    plt.close(figure)
