"""What grows, as a picture: one panel for each curve of the rows."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt

from lab.benchmark.rows import Row
from lab.files import drawn

LABELS = {"ms": "ms for one update", "MB": "MB sent a minute"}
"""By the unit of a curve's rows."""


def draw(rows: list[Row], path: Path) -> int:
    """Write a picture of all rows that are points of a curve, if there are any; the exit code."""
    panels: dict[str, list[tuple[float, Row]]] = {}
    for row in rows:
        if row.curve is not None:
            panels.setdefault(row.curve[0], []).append((row.curve[1], row))
    if not panels:
        return 0
    figure, axes = plt.subplots(1, len(panels), figsize=(4 * len(panels), 3), squeeze=False)
    for panel, (axis, points) in zip(axes[0], panels.items(), strict=True):
        points.sort(key=lambda point: point[0])
        panel.plot([x for x, _ in points], [row.value for _, row in points], "o-")
        panel.set_xlabel(axis)
        panel.set_ylabel(LABELS.get(points[0][1].unit, "share of a core"))
        panel.set_xscale("log")
        panel.set_ylim(bottom=0)
        panel.grid(alpha=0.3)
    figure.tight_layout()
    code = drawn(figure, path)
    plt.close(figure)
    return code
