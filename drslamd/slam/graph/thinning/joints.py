"""Which segments closures join."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from drslamd.conventions import Segment
from drslamd.slam.graph.tables import ClosureTable
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.graph.thinning.pair_view import PairView, believed


class Joint(NamedTuple):
    """Two segments, and the closures that join them.

    Attributes:
        tells_place_only: do these say where b stood and nothing of its heading?
        is_mirrored: were they found with b turning the other way?
    """

    a: Segment
    b: Segment
    closures: ClosureTable
    tells_place_only: bool = False
    is_mirrored: bool = False


def only_segments(chains: Mapping[int, ChainView]) -> dict[int, Segment]:
    """By robot, of those that have one."""
    return {
        robot: Segment(*view.chain, int(view.keyframes.rows[0, 1]))
        for robot, view in chains.items()
        if view.keyframes.is_one_segment
    }


def joints_of(
    chains: Mapping[int, ChainView], only: Mapping[int, Segment], pairs: list[PairView]
) -> list[Joint]:
    """Segments that are joined by closures whose both keyframes are held.

    Args:
        only: see `only_segments`.
    """
    out = []
    for pair in pairs:
        if not len(pair.closures):
            continue
        if pair.a.robot in only and pair.b.robot in only:
            found, place_only, is_mirrored = pair.believed
            ends = only[pair.a.robot], only[pair.b.robot]
            out.append(Joint(*ends, found, place_only, is_mirrored))
            continue
        a, b = (chains[chain.robot].keyframes for chain in (pair.a, pair.b))
        at_a, _ = a.find(pair.closures.a_n)
        at_b, _ = b.find(pair.closures.b_n)
        segments = np.stack([a.segment[at_a], b.segment[at_b]], axis=-1)
        for one, other in np.unique(segments, axis=0).tolist():
            these = pair.closures.chosen((segments == (one, other)).all(axis=1))
            ends = Segment(*pair.a, one), Segment(*pair.b, other)
            found, place_only, is_mirrored = believed(these)
            out.append(Joint(*ends, found, place_only, is_mirrored))
    return out
