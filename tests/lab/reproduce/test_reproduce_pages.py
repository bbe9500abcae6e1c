"""The tables as Markdown."""

from __future__ import annotations

from lab.reproduce import pages, printed, verdict
from reproduce_totals import good


def test_the_page_holds_every_printed_row() -> None:
    page = pages.everything(good(), verdict.checks(good()), [])
    for way in printed.TABLE_1[50].values():
        assert way[0] in page
    for row in printed.TABLE_2.values():
        assert f"| {row[0]} | {row[1]}, {row[2]} | {row[3]}, {row[4]} |" in page
