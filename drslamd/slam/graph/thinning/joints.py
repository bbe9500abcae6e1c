"""Which segments closures join."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from drslamd.conventions import Segment
from drslamd.slam.graph.tables import ClosureTable
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.graph.thinning.pair_view import PairView


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


def joints_of(chains: Mapping[int, ChainView], pairs: list[PairView]) -> list[Joint]:
    """Segments that are joined by closures whose both keyframes are held."""
    out = []
    for pair in pairs:
        if not len(pair.closures):
            continue
        a, b = (chains[chain.robot].keyframes for chain in (pair.a, pair.b))
        if a.is_one_segment and b.is_one_segment:
            out.append(_joint(pair, int(a.rows[0, 1]), int(b.rows[0, 1]), pair.closures))
            continue
        at_a, _ = a.find(pair.closures.a_n)
        at_b, _ = b.find(pair.closures.b_n)
        ends = np.stack([a.segment[at_a], b.segment[at_b]], axis=-1)
        for one, other in np.unique(ends, axis=0).tolist():
            these = pair.closures.chosen((ends == (one, other)).all(axis=1))
            out.append(_joint(pair, one, other, these))
    return out


def _joint(pair: PairView, one: int, other: int, these: ClosureTable) -> Joint:
    """Of two segments; who says a whole pose is believed before who says but a place, and wheels as
    configured before any that turn the other way."""
    place_only, mirrored = these.tells_place_only, these.is_mirrored
    kinds = (~place_only & ~mirrored, ~place_only, np.ones(len(these), dtype=bool))
    best = next(kind for kind in kinds if kind.any())
    found = these if best.all() else these.chosen(best)
    says_pose, is_mirrored = not place_only[best].any(), bool(mirrored[best].all())
    ends = Segment(*pair.a, one), Segment(*pair.b, other)
    return Joint(*ends, found, not says_pose, says_pose and is_mirrored)
