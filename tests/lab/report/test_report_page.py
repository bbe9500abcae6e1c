"""The page: complete, self-contained, and true figures in its tables."""

from __future__ import annotations

from html.parser import HTMLParser

import pytest
import team_answers
from lab.play.virtual_team import outcome
from lab.report.evidence import Evidence, gather
from lab.report.page import edge_page, page
from lab.score.outcome import Outcome, score


class Outline(HTMLParser):
    """Headings, rows of cells, and whatever would be fetched."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.headings: list[str] = []
        self.rows: list[list[str]] = []
        self.fetched: list[str] = []
        self._in = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._in = tag
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        links = [v for k, v in attrs if k in ("src", "href", "xlink:href") and v]
        self.fetched += [v for v in links if not v.startswith(("#", "data:"))]

    def handle_data(self, data: str) -> None:
        if self._in in ("td", "th"):
            self.rows[-1][-1] += data
        if self._in in ("h1", "h2"):
            self.headings.append(data)

    def handle_endtag(self, tag: str) -> None:
        self._in = ""


@pytest.fixture(scope="module")
def text() -> str:
    recording, simulator = team_answers.recording(), team_answers.team().simulator
    result = outcome(simulator)
    return page(recording, result, gather(simulator), score(recording, result), "<about>")


def test_everything_that_was_promised_has_its_heading(text: str) -> None:
    assert Outline(text).headings[1:] == [
        "Result",
        "Errors over time",
        "Convergence",
        "Residuals of ranges",
        "Consistency",
        "What poses claim",
        "Traffic",
        "Computations",
        "What was said to be wrong at the end",
    ]
    pairs = gather(team_answers.team().simulator).agreement
    assert text.count("<svg") == 8 + len(pairs)
    assert "&lt;about&gt;" in text


def test_nothing_is_fetched_from_elsewhere(text: str) -> None:
    assert Outline(text).fetched == []
    assert "<script" not in text
    assert "@import" not in text


def test_the_table_has_the_scores(text: str) -> None:
    result = outcome(team_answers.team().simulator)
    scores = score(team_answers.recording(), result)
    rows = {row[0]: row for row in Outline(text).rows if row}
    assert rows["team"] == [
        "team",
        f"{scores['team']['ate_rmse_m']:.3f}",
        f"{scores['team']['rot_mean_deg']:.2f}",
        f"{scores['odometry']['team']['ate_rmse_m']:.3f}",
        f"{scores['odometry']['team']['rot_mean_deg']:.2f}",
        f"{scores['live']['team']['ate_rmse_m']:.3f}",
    ]
    assert {"0-1", "0-2", "1-2"} <= set(rows)


def test_a_team_that_found_nothing_has_a_page_that_says_so() -> None:
    recording, nothing = team_answers.recording(), Outcome()
    text = page(recording, nothing, Evidence(), score(recording, nothing), "")
    assert "No robot was localised." in text
    rows = {row[0]: row for row in Outline(text).rows if row}
    assert rows["team"][1:3] == ["-", "-"]


def test_relative_poses_of_others_have_a_shorter_page() -> None:
    recording = team_answers.recording()
    result = outcome(team_answers.team().simulator)
    text = edge_page(recording, result, score(recording, result), "")  # type: ignore[arg-type]
    assert "edges were kept" in text
    assert "Residuals" not in Outline(text).headings
