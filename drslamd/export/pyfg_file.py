"""The pose graph with its ranges as pyfg text (PyFactorGraph, CORA).

``VERTEX_SE2 t key x y theta`` of solved keyframes, ``EDGE_SE2 t i j x y theta`` and six of the
covariance, ``EDGE_RANGE t i j range variance``; UNIX seconds, m and rad. A key is a letter for the
robot, in the order of their ids, and the number of its keyframe; a module that no robot carries is
``VERTEX_XY``, L and its UWB id. Odometry is without the scale and
yaw rate that were learned; a range is between the keyframes themselves: without the bias that was
learned, and with antennas and short ways since carried there.
"""

from __future__ import annotations

import string
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drslamd.export.answers import Array, columns, edges, keyframe_times, seconds
from drslamd.export.files import replaced

LETTERS = [letter for letter in string.ascii_uppercase + string.ascii_lowercase if letter != "L"]
"""L is for landmarks."""


class TooManyRobots(Exception):
    """The format has no letters for so many robots; the text says so."""


def write(folder: Path, answer: Mapping[str, Any]) -> list[Path]:
    """``graph.pyfg``.

    Raises:
        OSError: the folder or the file cannot be made.
        TooManyRobots: they need another format.
    """
    folder.mkdir(parents=True, exist_ok=True)
    keyframes = columns(answer, "keyframes")
    path = folder / "graph.pyfg"
    if not keyframes:
        replaced(path, "")
        return [path]
    at, names = keyframe_times(answer), _names(keyframes)
    poses = np.stack([keyframes["x_m"], keyframes["y_m"], keyframes["theta_rad"]], axis=-1)
    where = dict(zip(names, poses, strict=True))
    lines = [
        f"VERTEX_SE2 {seconds(at[key])} {names[key]} {_numbers(where[key])}"
        for key in names
        if key in at
    ]
    for table in ("odometry", "closures"):
        ends, measured, covariances = edges(answer, table)
        for (i, j), pose, covariance in zip(ends.tolist(), measured, covariances, strict=True):
            if {i, j} <= at.keys():
                packed = covariance[np.triu_indices(3)]
                stamp, ij = seconds(at[j]), f"{names[i]} {names[j]}"
                lines.append(f"EDGE_SE2 {stamp} {ij} {_numbers(pose)} {_numbers(packed)}")
    lines += _ranges(columns(answer, "ranges"), at, names, where)
    lines += _landmarks(answer, at, names, where)
    replaced(path, "".join(f"{line}\n" for line in lines))
    return [path]


def _names(keyframes: Mapping[str, Array]) -> dict[int, str]:
    robots = sorted(set(keyframes["robot"].astype(int).tolist()))
    if len(robots) > len(LETTERS):
        raise TooManyRobots(
            f"{len(robots)} robots, and pyfg has letters for {len(LETTERS)}; take csv or g2o"
        )
    count, out = dict.fromkeys(robots, 0), {}
    pairs = zip(keyframes["key"].tolist(), keyframes["robot"].tolist(), strict=True)
    for key, robot in pairs:
        out[int(key)] = f"{LETTERS[robots.index(int(robot))]}{count[int(robot)]}"
        count[int(robot)] += 1
    return out


def _ranges(
    ranges: Mapping[str, Array],
    at: Mapping[int, int],
    names: Mapping[int, str],
    where: Mapping[int, Array],
) -> list[str]:
    out = []
    told = [ranges[name].tolist() for name in ("i", "j", "sigma_m", "residual_m")]
    rows = zip(*told, strict=True)
    for first, second, sigma, residual in rows:
        i, j = int(first), int(second)
        if {i, j} <= at.keys():
            between = float(np.hypot(*(where[j] - where[i])[:2])) - residual
            ij = f"{names[i]} {names[j]}"
            out.append(f"EDGE_RANGE {seconds(at[i])} {ij} {between:.6f} {sigma * sigma:.9g}")
    return out


def _landmarks(
    answer: Mapping[str, Any],
    at: Mapping[int, int],
    names: Mapping[int, str],
    where: Mapping[int, Array],
) -> list[str]:
    """Modules that no robot carries, and the ranges to them."""
    places = {int(k): np.array([m["x_m"], m["y_m"]]) for k, m in answer.get("modules", {}).items()}
    out = [f"VERTEX_XY L{k} {_numbers(place)}" for k, place in sorted(places.items())]
    ranges = columns(answer, "module_ranges")
    if not ranges:
        return out
    told = [ranges[name].tolist() for name in ("module", "i", "sigma_m", "residual_m")]
    for module, first, sigma, residual in zip(*told, strict=True):
        k, i = int(module), int(first)
        if i in at and k in places:
            between = float(np.hypot(*(places[k] - where[i][:2]))) - residual
            ends = f"{names[i]} L{k}"
            out.append(f"EDGE_RANGE {seconds(at[i])} {ends} {between:.6f} {sigma * sigma:.9g}")
    return out


def _numbers(values: Any) -> str:
    return " ".join(f"{value:.9g}" for value in values)
