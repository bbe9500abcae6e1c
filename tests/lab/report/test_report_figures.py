"""Figures: SVG that stands alone, whatever there is to draw."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
import team_answers
from lab.play.virtual_team import outcome
from lab.report import figures
from lab.report.evidence import Agreement, Evidence, Residuals, gather
from lab.report.honesty import honesty, origins
from lab.score.outcome import Outcome


def every(result: Outcome, evidence: Evidence) -> dict[str, str]:
    recording = team_answers.recording()
    origin = origins(recording, starts_at_zero=True)
    truths = {robot: trail.truth for robot, trail in recording.trails.items()}
    return {
        "paths": figures.paths(result),
        "ellipses alone": figures.ellipses(evidence, {}, {}),
        "maps": figures.maps(recording, result),
        "errors": figures.errors(recording, result),
        "convergence": figures.convergence(recording, result),
        "residuals": figures.residuals(evidence.residuals),
        "honesty": figures.honesty(honesty(recording, evidence.published, origin)),
        "ellipses": figures.ellipses(evidence, truths, origin),
        "traffic": figures.traffic(evidence.sent, 40.0),
        "computations": figures.computations(result.ms),
        **{f"pair {k}": figures.agreement(k, pair) for k, pair in evidence.agreement.items()},
    }


@pytest.mark.parametrize(
    "full",
    [pytest.param(True, marks=pytest.mark.slow), False],
    ids=["a whole run", "nothing at all"],
)
def test_each_figure_is_one_element_with_its_words_as_text(full: bool) -> None:
    simulator = team_answers.team().simulator
    drawn = every(outcome(simulator), gather(simulator)) if full else every(Outcome(), Evidence())
    for name, text in drawn.items():
        root = ElementTree.fromstring(text)
        assert root.tag == "{http://www.w3.org/2000/svg}svg", name
        words = "".join(root.itertext())
        assert "[" in words or "NEES" in words or "share" in words, name
        for link in re.findall(r'(?:href|src)="([^"]+)"', text):
            assert link.startswith(("#", "data:")), name


def test_the_same_run_gives_the_same_bytes() -> None:
    pair = {"0-1": Residuals(np.arange(5.0), np.full(5, 0.1), np.full(5, 0.1))}
    assert figures.residuals(pair) == figures.residuals(pair)


def test_a_pair_of_one_closure_has_a_matrix() -> None:
    one = Agreement(np.array([3.0]), np.zeros((1, 1)), np.array([True]))
    assert "pair 0-1: 1 of 1 kept" in figures.agreement("0-1", one)
