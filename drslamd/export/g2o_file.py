"""The pose graph as g2o text: solved keyframes, odometry and closures between robots.

``VERTEX_SE2 key x y theta``, ``EDGE_SE2 i j x y theta`` and six of the information matrix; m, rad.
Nothing is said to be fixed: GTSAM reads no edge behind ``FIX``. Odometry is without the scale
and yaw rate that were learned. Ranges have no line in this format (`pyfg_file` has them);
whose keyframe a key is, and when, is in ``keyframes.csv``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drslamd.export.answers import columns, edges
from drslamd.export.csv_tables import keyframe_rows
from drslamd.export.files import replaced


def write(folder: Path, answer: Mapping[str, Any]) -> list[Path]:
    """``graph.g2o`` and ``keyframes.csv``.

    Raises:
        OSError: the folder or a file cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    keyframes = columns(answer, "keyframes")
    lines = []
    if keyframes:
        keys = keyframes["key"].astype(int).tolist()
        poses = np.stack([keyframes["x_m"], keyframes["y_m"], keyframes["theta_rad"]], axis=-1)
        lines = [
            f"VERTEX_SE2 {key} {x:.6f} {y:.6f} {theta:.6f}"
            for key, (x, y, theta) in zip(keys, poses.tolist(), strict=True)
        ]
    for table in ("odometry", "closures"):
        ends, measured, covariances = edges(answer, table)
        for (i, j), pose, covariance in zip(ends.tolist(), measured, covariances, strict=True):
            information = np.linalg.inv(covariance)[np.triu_indices(3)]
            lines.append(f"EDGE_SE2 {i} {j} {_numbers(pose)} {_numbers(information)}")
    paths = [folder / "graph.g2o", folder / "keyframes.csv"]
    replaced(paths[0], "".join(f"{line}\n" for line in lines))
    replaced(paths[1], keyframe_rows(answer))
    return paths


def _numbers(values: Any) -> str:
    return " ".join(f"{value:.9g}" for value in values)
