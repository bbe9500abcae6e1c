"""The report as one HTML file that needs nothing else."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from lab.recordings.recording import EdgeRecording, Recording
from lab.report import figures
from lab.report.evidence import Evidence
from lab.report.honesty import Honesty, honesty, origins
from lab.score.outcome import Outcome, Played

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 62rem;
       margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin-bottom: 0; } h2 { font-size: 1.15rem; margin: 2rem 0 .4rem; }
figure { margin: .5rem 0; overflow-x: auto; } figcaption { color: #555; font-size: .9rem; }
svg { max-width: 100%; height: auto; } .pair { display: inline-block; max-width: 50%; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .15rem .8rem; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child { text-align: left; }
.wrong { color: #a00; }
"""
Rows = Iterable[Sequence[str]]


def page(
    recording: Recording,
    result: Outcome,
    evidence: Evidence,
    scores: dict[str, Any],
    about: str,
    starts_at_zero: bool = True,
) -> str:
    """Of a run whose truth is known.

    Args:
        about: by which version, with which configuration; one line.
        starts_at_zero: see `honesty.origins`.
    """
    origin = origins(recording, starts_at_zero)
    claims = honesty(recording, evidence.published, origin)
    truths = {robot: trail.truth for robot, trail in recording.trails.items()}
    parts = [
        *_result(recording, result, scores),
        *_measured(evidence),
        _section("What poses claim", figures.honesty(claims), NEES),
        _table(("robot", "poses", "mean NEES", "in the 95 % ellipse"), _claimed(claims)),
        f"<figure>{figures.ellipses(evidence, truths, origin)}</figure>",
        *_spent(evidence, result, recording.duration),
    ]
    return _whole(recording.name, about, parts)


def blind_page(name: str, result: Outcome, evidence: Evidence, seconds: float, about: str) -> str:
    """Of a run whose truth nobody knows: nothing in it is an error.

    Args:
        seconds: that it took.
    """
    parts = [
        "<h2>Result</h2>",
        *_unlocalised(result),
        f"<figure>{figures.paths(result)}</figure>",
        *_measured(evidence),
        "<h2>What poses claim</h2>",
        f"<figure>{figures.ellipses(evidence, {}, {})}</figure>",
        *_spent(evidence, result, seconds),
    ]
    return _whole(name, about, parts)


def _measured(evidence: Evidence) -> list[str]:
    return [
        _section("Residuals of ranges", figures.residuals(evidence.residuals), RESIDUALS),
        _table(("pair", "ranges", "rms [m]", "median [m]", "beyond 3 sigma"), _spread(evidence)),
        "<h2>Consistency</h2>",
        *(
            f'<figure class="pair">{figures.agreement(name, pair)}</figure>'
            for name, pair in evidence.agreement.items()
        ),
        f"<p>{CONSISTENCY}</p>",
    ]


def _spent(evidence: Evidence, result: Outcome, seconds: float) -> list[str]:
    return [
        _section("Traffic", figures.traffic(evidence.sent, seconds), TRAFFIC),
        _section("Computations", figures.computations(result.ms), COMPUTATIONS),
        "<h2>What was said to be wrong at the end</h2>",
        _table(("robot", "sentence"), _said(evidence)),
    ]


def _unlocalised(result: Outcome) -> list[str]:
    return [] if result.final else ['<p class="wrong">No robot was localised.</p>']


def edge_page(recording: EdgeRecording, result: Outcome, scores: dict[str, Any], about: str) -> str:
    """Of relative poses that others estimated: neither ranges nor messages are in it."""
    kept = f"<p>{scores['closures']['kept']} of {scores['closures']['seen']} edges were kept.</p>"
    return _whole(recording.name, about, [*_result(recording, result, scores), kept])


RESIDUALS = (
    "Predicted minus measured, biases taken out, of what module 3 solves; on the right in units of "
    "the sigma that was configured, dashed the normal distribution."
)
CONSISTENCY = (
    "Each two closures of a pair with both odometries make a loop; its length in units of its own "
    "covariance, equation (3) of the paper, is dark where both agree. Marks at the edges: the "
    "largest set that agrees, which is kept."
)
NEES = (
    "Squared error of each published pose in units of its covariance, in the frame that it names. "
    "Honest poses have 3 in the mean, and 95 % of them lie in their ellipse."
)
TRAFFIC = "Payload of the messages that each robot sent, by kind."
COMPUTATIONS = "Of all robots together, one thread each."
LIVE = "Each pose as it was published, not as the end knows better."


def _result(recording: Played, result: Outcome, scores: dict[str, Any]) -> list[str]:
    return [
        "<h2>Result</h2>",
        _table(
            (
                *("", "ATE [m]", "heading [deg]"),
                *("dead reckoning ATE [m]", "heading [deg]", "published ATE [m]"),
            ),
            _errors(scores),
        ),
        *_unlocalised(result),
        f"<figure>{figures.maps(recording, result)}</figure>",
        _section("Errors over time", figures.errors(recording, result), "Dead reckoning dashed."),
        *(
            [_section("Convergence", figures.convergence(recording, result), LIVE)]
            if result.live
            else []
        ),
    ]


def _errors(scores: dict[str, Any]) -> Rows:
    robots = sorted(scores["odometry"]["robots"], key=int)
    for name, part in (*((f"robot {r}", r) for r in robots), ("team", None)):
        cells = [name]
        for source in (scores, scores["odometry"], scores.get("live", {})):
            found = source.get("team") if part is None else source.get("robots", {}).get(part)
            cells.append("-" if not found else f"{found['ate_rmse_m']:.3f}")
            cells.append("-" if not found else f"{found['rot_mean_deg']:.2f}")
        yield cells[:-1]


def _spread(evidence: Evidence) -> Rows:
    for name, pair in evidence.residuals.items():
        rms = float(np.sqrt(np.mean(pair.metres**2)))
        beyond = float(np.mean(np.abs(pair.metres) > 3 * pair.sigma))
        median = float(np.median(pair.metres))
        yield name, str(len(pair.t)), f"{rms:.3f}", f"{median:+.3f}", f"{100 * beyond:.1f} %"


def _claimed(claims: dict[int, Honesty]) -> Rows:
    for robot, said in claims.items():
        if said.claims:
            inside = f"{100 * said.share_inside:.0f} %"
            yield f"robot {robot}", str(len(said.t)), f"{said.squared.mean():.2f}", inside
        else:
            yield f"robot {robot}", "0", "-", "-"


def _said(evidence: Evidence) -> Rows:
    rows = [(f"robot {r}", text) for r, found in evidence.problems.items() for text in found]
    return rows or [("-", "nothing")]


def _section(title: str, figure: str, caption: str) -> str:
    return (
        f"<h2>{html.escape(title)}</h2><figure>{figure}"
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
    )


def _table(head: Sequence[str], rows: Rows) -> str:
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _whole(name: str, about: str, parts: list[str]) -> str:
    name = html.escape(name)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style></head><body>'
        f"<h1>{name}</h1><p>{html.escape(about)}</p>" + "\n".join(parts) + "</body></html>\n"
    )
