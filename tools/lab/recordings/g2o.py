"""Reader of ``.g2o``, the text format of planar pose graphs.

Lines: ``VERTEX_SE2 id x y yaw`` and ``EDGE_SE2 i j dx dy dyaw I11 I12 I13 I22 I23 I33``
(information of x, y, yaw in the frame of i). ``FIX id`` says nothing that is needed here. Every
edge line is one measurement: two between the same two poses both count, and an empty line is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.recordings.recording import Array, BadRecording

Index = NDArray[np.int64]


@dataclass(frozen=True)
class G2o:
    """One graph.

    Attributes:
        ids: (k,) of all poses that an edge or a vertex names, ascending.
        vertices: (k, 3) what the file says of them, nan where it says nothing.
        i, j: (m,) places in `ids` of the ends of each edge.
        measured: (m, 3) pose of j in i; information: (m, 3, 3).
    """

    name: str
    ids: Index
    vertices: Array
    i: Index
    j: Index
    measured: Array
    information: Array


def read(path: Path) -> G2o:
    """Read one file.

    Raises:
        BadRecording: not a planar g2o file, or one without edges.
    """
    vertices: dict[int, list[float]] = {}
    ends: list[tuple[int, int]] = []
    values: list[list[float]] = []
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        words = line.split()
        try:
            if not words or words[0] == "FIX":
                continue
            if words[0] == "VERTEX_SE2":
                vertices[int(words[1])] = _numbers(words[2:], 3)
            elif words[0] == "EDGE_SE2":
                ends.append((int(words[1]), int(words[2])))
                values.append(_numbers(words[3:], 9))
            else:
                raise ValueError(f"{words[0]} is not a line of a planar pose graph")
        except (IndexError, ValueError) as error:
            raise BadRecording(f"{path.name} line {number}: {error}") from None
    if not ends:
        raise BadRecording(f"{path.name}: no EDGE_SE2 line")
    named = np.array(ends, dtype=np.int64)
    stated = np.array(list(vertices), dtype=np.int64)
    ids = np.unique(np.concatenate([named.ravel(), stated]))
    poses = np.full((len(ids), 3), np.nan)
    poses[np.searchsorted(ids, stated)] = np.array(list(vertices.values())).reshape(-1, 3)
    i, j = np.searchsorted(ids, named).T
    table = np.array(values)
    information = table[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3)
    return G2o(path.name, ids, poses, i, j, table[:, :3], information)


def _numbers(words: list[str], count: int) -> list[float]:
    if len(words) != count:
        raise ValueError(f"{len(words)} numbers, {count} belong here")
    values = [float(word) for word in words]
    if not np.isfinite(values).all():
        raise ValueError("a number that is not finite")
    return values
