"""The figures of a report as SVG: text stays text, and the same run gives the same bytes."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Ellipse

from lab.recordings.recording import Array
from lab.report.evidence import Agreement, Evidence, Residuals
from lab.report.honesty import HONEST, Honesty
from lab.score import metrics, panels
from lab.score.claims import ELLIPSE_95
from lab.score.outcome import Outcome, Played, dead_reckoning

WIDTH = 7.2
"""Inches, two columns of a paper."""
AGREES = 11.345
"""Squared length below which two closures agree: chi-squared, three degrees of freedom, 0.99."""
MOST_ELLIPSES = 60


def svg(draw: Callable[[Any], None], height: float, width: float = WIDTH) -> str:
    """One figure as an element of a page."""
    out = io.StringIO()
    with plt.rc_context(panels.STYLE):
        figure = plt.figure(figsize=(width, height), layout="constrained")
        draw(figure)
        figure.savefig(out, format="svg", metadata={"Date": None}, transparent=True)
        panels.closed(figure)
    text = out.getvalue()
    return text[text.index("<svg") :]


def maps(recording: Played, result: Outcome) -> str:
    """Dead reckoning and the estimate over the truth."""
    robots, found = sorted(recording.trails), panels.aligned(recording, result)
    given = dead_reckoning(recording)
    seen = [t.truth for t in recording.trails.values()] + [*given.values(), *found.values()]

    def draw(figure: Any) -> None:
        left, right = figure.subplots(1, 2)
        for axes, paths, title in (
            (left, given, "Dead reckoning, true start given"),
            (right, found, "drslamd, no start given"),
        ):
            panels.draw_truth(axes, recording)
            panels.draw_paths(axes, paths, robots)
            panels.set_map(axes, title)
            panels.set_extent(axes, np.concatenate(seen))
        panels.map_legend(left, robots)

    return svg(draw, 4.2)


def errors(recording: Played, result: Outcome) -> str:
    """Position and heading over time: dead reckoning dashed, the final estimate drawn through, and
    published poses as dots."""
    robots, found = sorted(recording.trails), panels.aligned(recording, result)
    given = dead_reckoning(recording)
    wheels = {robot: (recording.trails[robot].t, given[robot]) for robot in robots}
    estimate = {robot: (result.final[robot].t, found[robot]) for robot in found}

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2, sharex=True)
        for paths, style in ((wheels, {"ls": "--", "lw": 0.8}), (estimate, {"lw": 1.4})):
            for robot, (t, *off) in panels.errors_over_time(recording, paths).items():
                for panel, error in zip(axes, off, strict=True):
                    panel.plot(t, error, color=panels.colour(robots.index(robot)), **style)
        for panel, unit in zip(axes, ("position error [m]", "heading error [deg]"), strict=True):
            panel.set_xlabel("time [s]")
            panel.set_ylabel(unit)
            panel.set_ylim(bottom=0)

    return svg(draw, 2.6)


def convergence(recording: Played, result: Outcome) -> str:
    """Errors of the poses as they were published, each frame moved onto the truth for itself."""
    robots = sorted(recording.trails)
    live = {r: path for r, path in result.live.items() if len(path.t) > 1}

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        truths = {
            r: metrics.at_times(recording.trails[r].t, recording.trails[r].truth, path.t)
            for r, path in live.items()
        }
        moved = {}
        if live:
            poses = {r: path.poses for r, path in live.items()}
            moved = metrics.aligned(poses, truths, {r: path.frame for r, path in live.items()})
        for r, estimate in sorted(moved.items()):
            error = np.hypot(*(estimate - truths[r])[:, :2].T)
            shade = panels.colour(robots.index(r))
            axes.semilogy(live[r].t, error, ".-", ms=3, lw=0.8, color=shade, label=f"robot {r}")
            axes.axvline(live[r].t[0], color=shade, lw=0.8, ls=":")
        axes.set_xlabel("time [s]; dotted: the first pose of each robot")
        axes.set_ylabel("error of published poses [m]")
        if moved:
            axes.legend(loc="upper right", ncols=2)

    return svg(draw, 2.6)


def residuals(found: Mapping[str, Residuals]) -> str:
    """Of the ranges of each pair over time, and their spread against what was claimed."""

    def draw(figure: Any) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(2, 1))
        for place, (name, pair) in enumerate(found.items()):
            shade = panels.colour(place)
            left.plot(pair.t, pair.metres, ".", ms=2.5, color=shade, label=f"pair {name}")
            scaled = pair.metres / pair.sigma
            bins = np.linspace(-4, 4, 33)
            right.hist(np.clip(scaled, -4, 4), bins, histtype="step", density=True, color=shade)
        x = np.linspace(-4, 4, 100)
        right.plot(x, np.exp(-x * x / 2) / np.sqrt(2 * np.pi), color="#999999", lw=1, ls="--")
        left.axhline(0, color="#999999", lw=0.8)
        left.set_xlabel("time [s]")
        left.set_ylabel("predicted minus measured [m]")
        right.set_xlabel("residual / sigma")
        if found:
            left.legend(loc="best", ncols=3, markerscale=3)

    return svg(draw, 2.8)


def agreement(name: str, pair: Agreement) -> str:
    """The matrix of module 2: dark agrees; the bars beside it are the clique."""

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        count = len(pair.t)
        shown = axes.imshow(
            np.minimum(np.sqrt(pair.squared), 3 * np.sqrt(AGREES)),
            cmap="cividis",
            interpolation="nearest",
        )
        kept = np.flatnonzero(pair.kept)
        axes.plot(np.full(len(kept), -0.03 * count - 1), kept, "s", ms=2, color=panels.COLOURS[1])
        axes.plot(kept, np.full(len(kept), -0.03 * count - 1), "s", ms=2, color=panels.COLOURS[1])
        axes.grid(visible=False)
        ticks = np.unique(np.linspace(0, count - 1, min(5, count)).astype(int))
        labels = [f"{pair.t[k]:.0f}" for k in ticks]
        axes.set_xticks(ticks, labels)
        axes.set_yticks(ticks, labels)
        axes.set_xlabel("closure at [s]")
        axes.set_title(f"pair {name}: {len(kept)} of {count} kept")
        bar = figure.colorbar(shown, ax=axes, shrink=0.8)
        bar.set_label("length of the loop [sigma]")

    return svg(draw, 3.0, WIDTH / 2)


def honesty(found: Mapping[int, Honesty]) -> str:
    """Squared errors in units of the covariance over time."""

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        for place, (robot, said) in enumerate(found.items()):
            if len(said.t):
                squared = np.maximum(said.squared, 1e-2)
                axes.semilogy(
                    said.t,
                    squared,
                    ".-",
                    ms=3,
                    lw=0.7,
                    color=panels.colour(place),
                    label=f"robot {robot}",
                )
        axes.axhline(HONEST, color="#555555", lw=1, ls="--")
        axes.set_xlabel("time [s]; dashed: 3, the mean of honest poses")
        axes.set_ylabel("NEES of x, y, theta")
        if any(len(said.t) for said in found.values()):
            axes.legend(loc="best", ncols=3)

    return svg(draw, 2.6)


def paths(result: Outcome) -> str:
    """Each robot's own account, in the frame that it names; nobody knows the truth."""
    robots = sorted(result.final)

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        panels.draw_paths(axes, {r: p.poses for r, p in result.final.items()}, robots)
        panels.set_map(axes, "drslamd, in the frame of the team")
        panels.map_legend(axes, robots)

    return svg(draw, 5.0, 5.2)


def ellipses(evidence: Evidence, truths: Mapping[int, Array], origin: Mapping[int, Array]) -> str:
    """Published poses with their 95 % ellipses, in the frame that most of them name, over the truth
    (k, 3) of each robot where it is known.

    Args:
        origin: where the frame of each robot truly is.
    """
    robots = sorted(evidence.published)
    frames = np.concatenate([np.zeros(0, int), *(p.frame for p in evidence.published.values())])

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        panels.set_map(axes, "Published poses, 95 % ellipses")
        if not len(frames):
            return
        frame = int(np.bincount(frames).argmax())
        for robot, said in sorted(evidence.published.items()):
            shade = panels.colour(robots.index(robot))
            if robot in truths and frame in origin:
                truth = metrics.relative(origin[frame], truths[robot])
                axes.plot(*truth[:, :2].T, color=panels.TRUTH, lw=3, zorder=1)
            mine = np.flatnonzero(said.frame == frame)
            for k in mine[:: max(1, len(mine) // MOST_ELLIPSES)]:
                axes.add_patch(_ellipse(said.poses[k], said.covariances[k], shade))
            axes.plot(*said.poses[mine, :2].T, ".", ms=2, color=shade)
        axes.autoscale_view()

    return svg(draw, 5.0, 5.2)


def _ellipse(pose: Array, covariance: Array, shade: str) -> Ellipse:
    values, vectors = np.linalg.eigh(covariance[:2, :2])
    minor, major = 2 * np.sqrt(ELLIPSE_95 * np.maximum(values, 0.0))
    turn = float(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
    return Ellipse((pose[0], pose[1]), major, minor, angle=turn, fill=False, ec=shade, lw=0.6)


def traffic(sent: Mapping[int, Mapping[str, int]], seconds: float) -> str:
    """Bytes a second of each kind of message."""
    kinds = sorted({kind for by_kind in sent.values() for kind in by_kind})

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        base = np.zeros(len(sent))
        for place, kind in enumerate(kinds):
            rate = np.array([by_kind.get(kind, 0) / seconds for by_kind in sent.values()])
            axes.bar(range(len(sent)), rate, bottom=base, color=panels.colour(place), label=kind)
            base += rate
        axes.set_xticks(range(len(sent)), [f"robot {robot}" for robot in sent])
        axes.set_ylabel("sent [bytes/s]")
        if kinds:
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))

    return svg(draw, 2.4)


def computations(ms: Mapping[str, list[float]]) -> str:
    """How long each module took, as the share of computations that were shorter."""

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        for place, (name, took) in enumerate(sorted(ms.items())):
            if took:
                share = np.arange(1, len(took) + 1) / len(took)
                shade = panels.colour(place)
                axes.step(np.sort(took), share, where="post", color=shade, label=name)
        axes.set_xscale("log")
        axes.set_xlabel("computation [ms] on this computer")
        axes.set_ylabel("share that was shorter")
        if any(ms.values()):
            axes.legend(loc="lower right")

    return svg(draw, 2.4)
