"""Trajectories as evo and most other tools read them: ``t x y z qx qy qz qw``, seconds, metres."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any


def write(folder: Path, trajectories: dict[str, Any]) -> list[Path]:
    """One file per robot out of an answer to ``trajectory``; the files.

    Raises:
        OSError: the folder or a file cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for robot, path in sorted(trajectories["robots"].items()):
        lines = [
            f"{utime / 1e6:.6f} {x:.6f} {y:.6f} 0 0 0 {math.sin(th / 2):.9f} {math.cos(th / 2):.9f}"
            for utime, (x, y, th) in zip(path["utime"], path["poses"], strict=True)
        ]
        paths.append(folder / f"robot{robot}.txt")
        paths[-1].write_text("\n".join(lines) + "\n")
    return paths
