"""Which few poses take part in many edges."""

from __future__ import annotations

import numpy as np

from drslamd.slam.se2 import Index


def vertex_cover(i: Index, j: Index, most: int) -> Index:
    """Up to `most` poses that take part in all edges (m,), or in as many as can be."""
    chosen: list[int] = []
    while len(i) and len(chosen) < most:
        pose = int(np.argmax(np.bincount(np.concatenate([i, j]))))
        chosen.append(pose)
        left = (i != pose) & (j != pose)
        i, j = i[left], j[left]
    return np.array(sorted(chosen), dtype=np.int64)
