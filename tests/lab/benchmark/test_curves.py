"""Which rows become a picture."""

from __future__ import annotations

from pathlib import Path

from lab.benchmark import curves
from lab.benchmark.rows import Row


def test_rows_with_a_place_on_a_curve_are_drawn(tmp_path: Path) -> None:
    rows = [Row(3, f"{x}", 10.0 * x, "ms", curve=("hours", x)) for x in (2.0, 1.0, 8.0)]
    curves.draw([*rows, Row(1, "no curve", 1.0, "ms")], tmp_path / "deep" / "growth.svg")
    drawn = (tmp_path / "deep" / "growth.svg").read_text()
    assert drawn.startswith("<?xml")
    curves.draw([Row(1, "no curve", 1.0, "ms")], tmp_path / "none.svg")
    assert not (tmp_path / "none.svg").exists()
