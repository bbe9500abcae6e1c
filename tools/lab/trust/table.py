"""The tables that tools/trust prints, as Markdown in columns."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from lab.trust.figures import Figures
from lab.trust.promises import INFINITE, Check, Promise


@dataclass(frozen=True)
class Column:
    """How a figure is headed and written."""

    heading: str
    unit: str = ""
    digits: int = 2

    def text(self, value: float) -> str:
        if math.isnan(value):
            return "-"
        if self.unit == "%":
            return f"{100 * value:.1f} %"
        if value == INFINITE:
            return "never" if self.unit == "s" else "inf"
        return f"{value:.{self.digits}f} {self.unit}".rstrip()


COLUMNS = {
    "runs": Column("runs", digits=0),
    "nees": Column("NEES"),
    "inside": Column("in ellipse", "%"),
    "pair_nees": Column("NEES, pairs"),
    "pair_inside": Column("in ellipse, pairs", "%"),
    "liars": Column("liars", "%"),
    "pair_liars": Column("liars, pairs", "%"),
    "doubtful": Column("doubtful", "%"),
    "wide": Column("sigma > 0.5 m", "%"),
    "closure_nees": Column("NEES, closures"),
    "wrong_unique": Column("wrong unique windows", digits=0),
    "connected": Column("connected", "%"),
    "ate_m": Column("ATE", "m", 3),
    "ate_x_clean": Column("ATE x clean"),
    "healthy_x_clean": Column("healthy x clean"),
    "ate_x_today": Column("ATE x today"),
    "bias_m": Column("largest bias", "m"),
    "said_s": Column("said after", "s", 0),
    "cause_s": Column("cause after", "s", 0),
    "named": Column("cause named", "%"),
    "wrong_names": Column("wrong names", digits=0),
}
POSES = [
    "runs", "nees", "inside", "pair_nees", "pair_inside", "closure_nees", "wrong_unique",
    "liars", "pair_liars", "doubtful", "wide", "ate_m", "ate_x_today", "connected",
]  # fmt: skip
FAULTS = [
    "runs", "connected", "ate_m", "ate_x_clean", "healthy_x_clean", "inside", "liars", "doubtful",
    "said_s", "cause_s", "named", "wrong_names",
]  # fmt: skip


def poses(found: Mapping[str, Figures]) -> list[str]:
    """How true claims are."""
    return _figures(found, POSES)


def faults(found: Mapping[str, Figures]) -> list[str]:
    """What becomes of faults, and whether they are named."""
    return _figures(found, FAULTS)


def promised(found: Sequence[Check]) -> list[str]:
    """Each promise beside what is reached."""
    rows = [["case", "figure", "reached", "promised", ""]]
    for check in found:
        column = COLUMNS[check.promise.figure]
        mark = "yes" if check.is_kept else "**no**"
        rows.append(
            [check.case, column.heading, column.text(check.reached), wanted(check.promise), mark]
        )
    return markdown(rows, (0, 1, 3, 4))


def wanted(promise: Promise) -> str:
    """In words."""
    text = COLUMNS[promise.figure].text
    if promise.least == -INFINITE:
        return f"at most {text(promise.most)}" if promise.most else "none"
    if promise.most == INFINITE:
        return f"at least {text(promise.least)}"
    return f"{text(promise.least)} to {text(promise.most)}"


def _figures(found: Mapping[str, Figures], names: Sequence[str]) -> list[str]:
    rows = [["case", *(COLUMNS[name].heading for name in names)]]
    for title, figures in found.items():
        cells = (COLUMNS[name].text(float(getattr(figures, name))) for name in names)
        rows.append([title, *cells])
    return markdown(rows)


def markdown(rows: Sequence[Sequence[str]], words: Collection[int] = (0,)) -> list[str]:
    """A table whose first row heads it; columns of words stand to the left, the others right."""
    widths = [max(3, *map(len, column)) for column in zip(*rows, strict=True)]
    rule = ["-" * w if k in words else "-" * (w - 1) + ":" for k, w in enumerate(widths)]
    lines = []
    for row in [rows[0], rule, *rows[1:]]:
        sized = enumerate(zip(row, widths, strict=True))
        cells = [cell.ljust(w) if k in words else cell.rjust(w) for k, (cell, w) in sized]
        lines.append(f"| {' | '.join(cells)} |")
    return lines
