"""Tables of an answer to ``graph`` as arrays, and the times of its keyframes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drslamd.export import stamps

Array = NDArray[Any]


def columns(answer: Mapping[str, Any], table: str) -> dict[str, Array]:
    """Every column of a table by its name; empty ones of a robot that is in no group."""
    told = answer.get(table)
    if told is None:
        return {}
    rows = np.array(told["rows"], dtype=np.float64).reshape(-1, len(told["columns"]))
    return dict(zip(told["columns"], rows.T, strict=True))


def keyframe_times(answer: Mapping[str, Any]) -> dict[int, int]:
    """UNIX time of each keyframe, us; those of robots whose clock nobody knows are left out."""
    keyframes = columns(answer, "keyframes")
    out: dict[int, int] = {}
    for robot in np.unique(keyframes["robot"]).astype(int).tolist() if keyframes else ():
        mine = keyframes["robot"] == robot
        times = keyframes["utime"][mine].astype(np.int64).tolist()
        known = stamps.unix_stamps(times, answer["clocks"][str(robot)], answer["wall"])
        if known is not None:
            keys = keyframes["key"][mine].astype(int).tolist()
            out.update(zip(keys, known.unix_us.tolist(), strict=True))
    return out


def edges(answer: Mapping[str, Any], table: str) -> tuple[Array, Array, Array]:
    """Of ``odometry`` or ``closures``, between keyframes that are told: keys (m, 2), pose of the
    second in the first (m, 3) and covariances (m, 3, 3)."""
    told, keys = columns(answer, table), columns(answer, "keyframes")
    if not told:
        return np.zeros((0, 2), dtype=int), np.zeros((0, 3)), np.zeros((0, 3, 3))
    ends = np.stack([told["i"], told["j"]], axis=-1).astype(int)
    measured = np.stack([told["x_m"], told["y_m"], told["theta_rad"]], axis=-1)
    packed = np.stack([values for name, values in told.items()][5:], axis=-1)
    covariances = packed[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    both = np.isin(ends, keys["key"]).all(axis=1)
    return ends[both], measured[both], covariances[both]


def seconds(unix_us: int) -> str:
    """UNIX seconds to the microsecond."""
    return f"{unix_us / 1e6:.6f}"
