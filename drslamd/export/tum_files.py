"""Trajectories as evo and most other tools read them: ``t x y z qx qy qz qw``, seconds, metres.

Times are UNIX time. The first line of a file is a comment with how wrong they may be.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from drslamd.export import stamps
from drslamd.export.answers import seconds
from drslamd.export.files import replaced


def write(folder: Path, trajectories: dict[str, Any]) -> list[Path]:
    """One file per robot out of an answer to ``trajectory``; the files.

    Raises:
        OSError: the folder or a file cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for robot, path in sorted(trajectories["robots"].items()):
        wall, clock = trajectories["wall"], path["clock"]
        known = stamps.unix_stamps(path["utime"], clock, wall)
        if known is None:
            continue
        frame = f"in the odometry frame of robot {trajectories['frame']}"
        lines = [f"# {stamps.sentences(robot, clock, known, wall)}; {frame}"]
        lines += [
            f"{seconds(unix_us)} {x:.6f} {y:.6f} 0 0 0 "
            f"{math.sin(th / 2):.9f} {math.cos(th / 2):.9f}"
            for unix_us, (x, y, th) in zip(known.unix_us.tolist(), path["poses"], strict=True)
        ]
        paths.append(folder / f"robot{robot}.txt")
        replaced(paths[-1], "\n".join(lines) + "\n")
    return paths
