"""Reader of ``.g2o``, the text format of planar pose graphs.

Lines: ``VERTEX_SE2 id x y yaw`` and ``EDGE_SE2 i j dx dy dyaw I11 I12 I13 I22 I23 I33``
(information of x, y, yaw in the frame of i). ``FIX id`` says nothing that is needed here. Every
edge line is one measurement: two between the same two poses both count; empty lines and comments
are none. An id is a whole number, be it one of GTSAM with the letter of a robot in its upper byte.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.recordings import text_lines
from lab.recordings.recording import Array, BadRecording

Index = NDArray[np.int64]

EDGE = "dx dy dyaw I11 I12 I13 I22 I23 I33"


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
    for number, words in text_lines.worded(path):
        try:
            if words[0] == "VERTEX_SE2":
                vertices[_key(words, 1)] = text_lines.numbers(words[2:], "x y yaw")
            elif words[0] == "EDGE_SE2":
                ends.append((_key(words, 1), _key(words, 2)))
                values.append(text_lines.numbers(words[3:], EDGE))
            elif words[0] != "FIX":
                raise ValueError(
                    f"{words[0][:40]} is not a line of a planar pose graph: "
                    "VERTEX_SE2, EDGE_SE2 and FIX are"
                )
        except ValueError as error:
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


def _key(words: list[str], place: int) -> int:
    word = words[place] if place < len(words) else "nothing"
    if not (word.isdecimal() and len(word) < 20 and int(word) < 1 << 63):
        raise ValueError(f"{word[:40]} is no id: a whole number below 2^63 belongs there")
    return int(word)
